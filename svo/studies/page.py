"""Pages of studies, from one template: style, script and pictures are inside, and nothing is loaded from elsewhere."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from svo.plant import HEALTHY, Plant
from svo.store import write_text
from svo.studies.tables import TextTable


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
    """Write a page with the reports' style inside, and perhaps a script.

    Its policy lets a browser run that script and no other, and load nothing from elsewhere.

    Parameters
    ----------
    path : path of the HTML file
    title : str
    parts : iterable of str
        Pieces of HTML that the page begins with.
    script : str
    report : Report, optional
    """
    style = own_file("report.css")
    allowed = "; ".join(f"{what}-src {_hash(text)}" for what, text in (("style", style), ("script", script)) if text)
    policy = f"default-src 'none'; img-src data:; {allowed}; base-uri 'none'; form-action 'none'"
    text = render("page.html.j2", title=title, policy=policy, style=style, parts=parts, report=report, script=script)
    write_text(path, text + "\n")


def render(template: str, **values: Any) -> Markup:
    """A template of the folder ``pages``, filled; every text in ``values`` that is no markup is escaped."""
    return Markup(_environment().get_template(template).render(values))


def study_command(plant: Plant, configuration: Mapping[str, Any]) -> str:
    """The command that makes a study again."""
    options = [f"--runs {configuration['runs']}", f"--seed {configuration['seed']}"]
    options += [f"--noise {name}" for name in configuration["noise"]]
    options += [f"--architecture {name}" for name in configuration.get("architectures", ())]
    if list(configuration["faults"]) != [HEALTHY, *plant.faults]:
        options += [f"--fault {name}" for name in configuration["faults"]]
    return f"svo study {configuration['plant']} {' '.join(options)} --out DIR"


def own_file(name: str) -> str:
    """A style or script of the pages."""
    return files("svo.studies").joinpath("pages", name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("svo.studies", "pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda path: base64.b64encode(path.read_bytes()).decode("ascii")
    return environment


def _hash(text: str) -> str:
    """As a content security policy names the text of an element."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
