"""Writes the report on a log."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from svo.detection.alarm_folder import PICTURES, REPORT
from svo.detection.found import Detection
from svo.detection.report.facts import alarm_text, bank_of, bounds_table, log_facts, models_table
from svo.detection.report.pictures import legend_of, pictures_of
from svo.pages.page import own_file, write_page
from svo.pages.svg import inline_svg
from svo.plant.description import DescribedPlant
from svo.store import digest_of, versions


def write_report(
    folder: Path,
    found: Detection,
    path: Path | None = None,
    *,
    channels: Sequence[str] | None = None,
    formats: Sequence[str] = (),
    command: Sequence[str] = (),
) -> Path:
    """Write report.html, one file with all that it shows inside, and perhaps its pictures beside it.

    Parameters
    ----------
    folder : Path
        Made if need be.
    found : Detection
    path : Path, optional
        The file that the log is from, whose SHA-256 is told.
    channels : sequence of str, optional
        Names of the states and outputs to show; all by default.
    formats : sequence of str
        "svg", "pdf" and "png": the pictures are written into the folder ``pictures`` as such files.
    command : sequence of str
        Words of the command that makes the report.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    ValueError
        For a channel or a format of another name, and where the bounds cannot be computed (`BankRecord.boxes`).
    """
    pictures = list(pictures_of(found.record, None if channels is None else list(channels)))
    bank = bank_of(found)
    folder.mkdir(parents=True, exist_ok=True)
    if formats:
        (folder / PICTURES).mkdir(exist_ok=True)
    shown = []
    for number, picture in enumerate(pictures):
        files = picture.write(folder / PICTURES, formats)
        drawn = inline_svg(picture.figure(), picture.title, f"p{number}")
        shown.append((picture, drawn, [f"{PICTURES}/{file.name}" for file in files]))
    plant = found.plant
    texts = {file.name: (digest_of(file), file.read_text(encoding="utf-8", errors="replace")) for file in _files(found)}
    title = getattr(plant, "title", "") or plant.name
    write_page(
        folder / REPORT,
        f"Detection report: {title}",
        "log.html.j2",
        own_file("log.js"),
        subtitle=f"{found.log.source or 'a log in memory'}, {plant.name}, {found.noise} noise",
        findings=[text.strip().rstrip(".") for text in str(found).splitlines() if text.strip()],
        pictures=shown,
        legend=legend_of(found.record),
        alarms=[alarm_text(alarm, found) for alarm in found.alarms],
        tables=[models_table(bank), bounds_table(found, bank)],
        log=log_facts(found, path),
        texts=texts,
        command=shlex.join(command),
        versions=versions(),
    )
    return folder / REPORT


def _files(found: Detection) -> list[Path]:
    """The texts that describe the plant."""
    files = found.plant.files if isinstance(found.plant, DescribedPlant) else ()
    return [file for file in files if file.suffix == ".toml"]
