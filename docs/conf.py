"""The documentation site: `make docs` builds it offline, with broken links and references as errors."""

from __future__ import annotations

import inspect
import re
import shutil
import subprocess
import sys
from importlib.metadata import version as installed
from pathlib import Path
from textwrap import dedent
from typing import Any

from sphinx.util import logging

import polytopes
import svo
import svo.baselines
import svo.faults
import svo.interval
import svo.residual_tests
import svo.testing

project = "svo-fdi"
author = "The svo-fdi developers"
copyright = "The svo-fdi developers, BSD-3-Clause"
release = installed("svo-fdi")

extensions = ["myst_nb", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
smartquotes = False  # "--noise" is to be copied as it stands
exclude_patterns = ["_build", "conf.py"]
html_theme = "furo"
html_title = f"svo-fdi {release}"
html_show_sphinx = False
html_static_path = ["static"]
html_css_files = ["wide.css"]

myst_heading_anchors = 3
nb_execution_mode = "off"  # notebooks show what they printed when a test last ran them

autodoc_typehints = "none"  # the numpydoc sections say types and shapes
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

_DOCS = Path(__file__).parent
_ROOT = _DOCS.parent
_COPIED = _DOCS / "_copied"  # pages that live outside this folder, where GitHub's readers look for them


def _copy_pages() -> None:
    shutil.rmtree(_COPIED, ignore_errors=True)
    _COPIED.mkdir()
    for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff"):
        text = (_ROOT / name).read_text(encoding="utf-8")
        text = re.sub(r"\]\(docs/", "](../", text)
        text = re.sub(r"\]\(notebooks/", "](", text)
        (_COPIED / name).write_text(text, encoding="utf-8")
    for notebook in (_ROOT / "notebooks").glob("*.ipynb"):
        shutil.copy(notebook, _COPIED)
    (_COPIED / "command_line.md").write_text(_command_line(), encoding="utf-8")


def _command_line() -> str:
    """The command line's own help, as a page."""
    write = [sys.executable, "-m", "typer", "svo.cli", "utils", "docs", "--name", "svo", "--title", "Command line"]
    text = subprocess.run(write, check=True, capture_output=True, text=True).stdout
    text = re.sub(r"\*\*Commands\*\*:\n\n(\* .*\n)+", "", text)  # cut short; each command has its section
    # What the help prints as it stands follows a backspace.
    return re.sub(r"\x08\n(?:Examples?:)?\n?((?: .*\n)+)", lambda found: f"```console\n{dedent(found[1])}```\n", text)


def _to_copies(app: Any, page: str, source: list[str]) -> None:
    """Links that lead out of this folder on GitHub lead to the copies here."""
    if "/" not in page:  # those of a folder link to pages of the site
        source[0] = re.sub(r"\]\(\.\./(?:notebooks/)?([\w-]+\.(?:md|ipynb))", r"](_copied/\1", source[0])


def _keep_bars(_app: Any, _what: str, _name: str, _obj: Any, _options: Any, lines: list[str]) -> None:
    """Bars in a docstring are absolute values, where reStructuredText would see a substitution."""
    for i, line in enumerate(lines):
        lines[i] = re.sub(r"``.*?``|\|", lambda found: "\\|" if found[0] == "|" else found[0], line)


def _load_public_names() -> None:
    """`svo` imports its names when they are asked for; autodoc sees only what is there."""
    for name in svo.__all__:
        setattr(svo, name, getattr(svo, name))


def _check_public_names(_app: Any, env: Any) -> None:
    """A public name that no page of the reference describes is an error."""
    for package in (polytopes, svo, svo.baselines, svo.faults, svo.interval, svo.residual_tests, svo.testing):
        for name in package.__all__:
            described = inspect.isroutine(value := getattr(package, name)) or inspect.isclass(value)  # no type alias
            if described and f"{package.__name__}.{name}" not in env.domaindata["py"]["objects"]:
                logging.getLogger(__name__).warning("%s.%s is on no page of the reference", package.__name__, name)


def setup(app: Any) -> None:
    _copy_pages()
    _load_public_names()
    app.connect("env-check-consistency", _check_public_names)
    app.connect("autodoc-process-docstring", _keep_bars)
    app.connect("source-read", _to_copies)
