"""The documentation site: `make docs` builds it offline, with broken links and references as errors."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from importlib.metadata import version as installed
from pathlib import Path
from typing import Any

project = "svo-fdi"
author = "The svo-fdi developers"
copyright = "The svo-fdi developers, BSD-3-Clause"
release = installed("svo-fdi")

extensions = ["myst_nb", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
exclude_patterns = ["_build", "conf.py"]
html_theme = "furo"
html_title = f"svo-fdi {release}"
html_show_sphinx = False

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
    # The command line's own help, as a page.
    write = [sys.executable, "-m", "typer", "svo.cli", "utils", "docs", "--name", "svo", "--title", "Command line"]
    subprocess.run([*write, "--output", str(_COPIED / "command_line.md")], check=True, stdout=subprocess.DEVNULL)


def _to_copies(app: Any, page: str, source: list[str]) -> None:
    """Links that lead out of this folder on GitHub lead to the copies here."""
    if not page.startswith("_copied/"):
        source[0] = re.sub(r"\]\(\.\./(?:notebooks/)?([\w-]+\.(?:md|ipynb))", r"](_copied/\1", source[0])


def _keep_bars(_app: Any, _what: str, _name: str, _obj: Any, _options: Any, lines: list[str]) -> None:
    """Bars in a docstring are absolute values, where reStructuredText would see a substitution."""
    for i, line in enumerate(lines):
        lines[i] = re.sub(r"``.*?``|\|", lambda found: "\\|" if found[0] == "|" else found[0], line)


def setup(app: Any) -> None:
    _copy_pages()
    app.connect("autodoc-process-docstring", _keep_bars)
    app.connect("source-read", _to_copies)
