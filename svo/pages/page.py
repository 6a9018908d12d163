"""Pages from one template: style, script and pictures are inside, and nothing is loaded from elsewhere."""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from svo.store import write_text


def write_page(path: Path, title: str, template: str, script: str = "", **values: Any) -> None:
    """Write a page with the pages' style inside, and perhaps a script.

    Its policy lets a browser run that script and no other, and load nothing from elsewhere.

    Parameters
    ----------
    path : path of the HTML file
    title : str
    template : str
        One that extends page.html.j2.
    script : str
    values
        For the template.
    """
    style = own_file("report.css")
    allowed = "; ".join(f"{what}-src {_hash(text)}" for what, text in (("style", style), ("script", script)) if text)
    policy = f"default-src 'none'; img-src data:; {allowed}; base-uri 'none'; form-action 'none'"
    text = render(template, title=title, policy=policy, style=style, script=script, **values)
    write_text(path, text + "\n")


def render(template: str, **values: Any) -> Markup:
    """A template of the folder ``templates``, filled; every text in ``values`` that is no markup is escaped."""
    return Markup(_environment().get_template(template).render(values))


def own_file(name: str) -> str:
    """A style or script of the pages."""
    return files("svo.pages").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("svo.pages", "templates"),
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
