"""The command line in the process of a test, and logs for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from typer.testing import CliRunner

from svo.cli import app


def svo(*arguments: str | Path, **options: Any) -> Any:
    """What a command answers: ``exit_code``, ``stdout``, ``stderr``, ``output``."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments], **options)


def one_line(result: Any) -> str:
    """The error of a command that failed as it should."""
    assert result.exit_code == 1
    lines = [line for line in result.stderr.splitlines() if line.startswith("error:")]
    assert len(lines) == 1
    assert "Traceback" not in result.output + result.stderr
    return lines[0]


def edited(log: Path, line: int, column: str, cell: str) -> Path:
    """A log with another cell in a column of a line."""
    rows = [row.split(",") for row in log.read_text().splitlines()]
    rows[line - 1][rows[0].index(column)] = cell
    log.write_text("".join(",".join(row) + "\n" for row in rows))
    return log
