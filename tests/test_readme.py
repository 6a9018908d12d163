"""What the pages promise: Python blocks run and print what they say, links lead to files."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_python_blocks_run_and_print_what_they_say(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "docs").symlink_to(ROOT / "docs")  # what a block writes stays out of the tree
    monkeypatch.chdir(tmp_path)
    form = r"^```python\n(.*?)^```(?:\n\n```text\n(.*?)^```)?"
    blocks = re.findall(form, page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert blocks or page.name != "README.md"
    for block, output in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(block, page.name, "exec"), {})
        expected = output.splitlines() or re.findall(r"^print\(.*\)  # (.*)$", block, re.MULTILINE)
        assert printed.getvalue().splitlines() == expected


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        if not target.startswith("https://"):
            assert (page.parent / target).exists(), target


def test_the_citation_file_says_what_the_format_asks_for() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    for key in ("cff-version: 1.2.0", "message:", "title:", "authors:"):
        assert re.search(f"^{key}", text, re.MULTILINE), key
    version = re.search(r'^version = "(.*)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)
    assert version is not None
    assert f"version: {version[1]}" in text


@pytest.mark.parametrize("page", [*PAGES, *sorted((ROOT / "notebooks").glob("*.ipynb"))], ids=lambda page: page.name)
def test_examples_say_which_is_the_input_and_which_the_measurement(page: Path) -> None:
    """`update(y0, u)` but `step(u, y)`: with one of each, a swap would be a silent falsification."""
    text = page.read_text(encoding="utf-8")
    assert not re.findall(r"\.(?:step|update)\([^()=\n]+,[^\n]*", text)
