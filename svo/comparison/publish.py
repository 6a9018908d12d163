"""From a finished comparison to what people read: runs.csv, a picture and report.html."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any

from svo.comparison.comparison import Compared
from svo.comparison.figures import write_comparison
from svo.comparison.summary import DetectorComparison, summarise, write_runs
from svo.comparison.tables import comparison_table
from svo.interval.study.run import LearnsDetectors
from svo.plant import Plant
from svo.study.configuration import versions
from svo.study.figures import Picture
from svo.study.report import html_facts, html_figure, html_table, write_page

_GLOSSARY = {
    "level": "The one knob of a detector: a factor on its threshold, or on the bounds of a set-membership model. It is "
    "tuned to the false-alarm rate on training runs, unless the bounds are stated; judged runs have other seeds.",
    "false alarms": "Judged fault-free runs with an alarm.",
    "delay": "From the first faulty sample, which counts as one sampling time, to the first alarm, over the runs "
    "without an alarm before the fault (early).",
    "width": "Mean width of the detector's bounds on the state in fault-free runs.",
    "alarm": "That of a set-valued observer with bounds that hold is a proof; that of the others, and of observers "
    "whose bounds were scaled below what holds, is a crossed threshold.",
}


def publish(compared: Compared, plant: Plant, folder: Path) -> list[DetectorComparison]:
    """Write runs.csv, the pictures and report.html into a folder, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    summaries = summarise(compared)
    write_runs(folder / "runs.csv", compared.rows)
    pictures = [write_comparison(folder / "delays.png", summaries)]
    if isinstance(plant, LearnsDetectors):
        from svo.interval.study.run_figures import write_run_figures

        pictures += write_run_figures(folder, plant, compared.comparison.noise, compared.comparison.seed)
    _write_report(folder / "report.html", compared, plant, summaries, pictures)
    return summaries


def by_distribution(summaries: Sequence[DetectorComparison]) -> list[list[DetectorComparison]]:
    """The summaries of each distribution of the noise."""
    return [[s for s in summaries if s.distribution == d] for d in dict.fromkeys(s.distribution for s in summaries)]


def to_json(summaries: Sequence[DetectorComparison]) -> list[dict[str, Any]]:
    """Summaries as plain dictionaries."""
    return [asdict(s) for s in summaries]


def _write_report(
    path: Path,
    compared: Compared,
    plant: Plant,
    summaries: Sequence[DetectorComparison],
    pictures: Sequence[Picture],
) -> None:
    configuration = {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(compared.comparison).items()}
    parts = [
        f"<h1>Detectors side by side: {escape(plant.title)}</h1>",
        *(html_table(comparison_table(group)) for group in by_distribution(summaries)),
        *(html_figure(picture) for picture in pictures),
        "<h2>What is counted</h2>",
        "<dl>" + "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in _GLOSSARY.items()) + "</dl>",
        "<p>Every judged run is a row of <code>runs.csv</code>.</p>",
        html_facts("Configuration", configuration),
        html_facts("Versions", versions()),
    ]
    write_page(path, f"Detectors side by side: {plant.title}", parts)
