"""The page of described models: its commands print what it shows, and its file is the one that ships."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from svo.cli import app

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "own_model.md").read_text(encoding="utf-8")


def test_the_file_on_the_page_is_the_example() -> None:
    block = re.search(r"^```toml\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    assert block is not None
    assert block[1] == (DOCS / "examples" / "cart.toml").read_text(encoding="utf-8")


def test_the_commands_print_what_the_page_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("cart.toml", "cart.csv"):
        shutil.copy(DOCS / "examples" / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```console\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    commands = re.findall(r"^\$ svo (.*?)\n((?:[^$].*\n)*)", "".join(blocks), re.MULTILINE)
    assert len(commands) == 4
    for arguments, shown in commands:
        done = CliRunner().invoke(app, arguments.split())
        assert done.exit_code == 0, done.output
        assert _without_durations(done.stdout) == _without_durations(shown)


def _without_durations(printed: str) -> str:
    """Times of computation differ from run to run."""
    return re.sub(r"in \d+\.\d\d s$|\d+\.\d\d ms each", "...", printed, flags=re.MULTILINE)
