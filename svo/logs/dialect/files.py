"""Which reader a file needs: by its suffix, and all others are text."""

from __future__ import annotations

from pathlib import Path

from svo.logs.dialect.rules import Dialect
from svo.logs.dialect.sheet import read_sheet
from svo.logs.dialect.source import Source


def open_source(path: Path, dialect: Dialect) -> Source:
    """The columns of a file.

    Raises
    ------
    ValueError
        If it is damaged, or not what its suffix says.
    OSError
        If it cannot be opened.
    """
    return read_sheet(path, dialect)
