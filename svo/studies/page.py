"""Pages of studies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from svo.pages import page
from svo.pages.tables import TextTable
from svo.plant import HEALTHY, Plant


@dataclass(frozen=True)
class Picture:
    """A picture that has been written, and what it shows."""

    path: Path
    title: str
    caption: str


@dataclass(frozen=True)
class Report:
    """What the report of a study says.

    Attributes
    ----------
    subtitle : str
    findings : sequence of str
        A line each, without its full stop.
    tables : sequence of TextTable
    paper : str
        Where figures beside ours come from; may be empty.
    pictures : sequence of Picture
    glossary : mapping of str to str
        Words of the report, and what is counted as them.
    command : str
        That makes the study again.
    configuration, versions : mapping
        Of the study, as stored with it.
    has_alarms : bool
        Whether the study stores alarms with certificates.
    interactive : Markup
        Views that a reader can move in, for the page's script; may be empty.
    """

    subtitle: str
    findings: Sequence[str]
    tables: Sequence[TextTable]
    paper: str
    pictures: Sequence[Picture]
    glossary: Mapping[str, str]
    command: str
    configuration: Mapping[str, Any]
    versions: Mapping[str, str]
    has_alarms: bool = False
    interactive: Markup = Markup()  # noqa: RUF009 (immutable, as a str is)


def write_page(
    path: Path, title: str, parts: Iterable[str] = (), script: str = "", report: Report | None = None
) -> None:
    """Write a page with the reports' style inside, and perhaps a script; see `svo.pages.page.write_page`.

    Parameters
    ----------
    path : path of the HTML file
    title : str
    parts : iterable of str
        Pieces of HTML that the page begins with.
    script : str
    report : Report, optional
    """
    page.write_page(path, title, "study.html.j2", script, parts=parts, report=report)


def study_command(plant: Plant, configuration: Mapping[str, Any]) -> str:
    """The command that makes a study again."""
    options = [f"--runs {configuration['runs']}", f"--seed {configuration['seed']}"]
    options += [f"--noise {name}" for name in configuration["noise"]]
    options += [f"--architecture {name}" for name in configuration.get("architectures", ())]
    options += [f"--models {kind}" for kind in configuration.get("models", ())]
    if list(configuration["faults"]) != [HEALTHY, *plant.faults]:
        options += [f"--fault {name}" for name in configuration["faults"]]
    return f"svo study {configuration['plant']} {' '.join(options)} --out DIR"
