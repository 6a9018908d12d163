"""Which reader a file needs: by its suffix, and all others are text."""

from __future__ import annotations

from pathlib import Path

from svo.logs.dialect.mat import read_mat_columns
from svo.logs.dialect.parquet import read_parquet_columns
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
    ImportError
        If it needs a package that is not installed.
    """
    suffix = path.suffix.lower()
    if suffix == ".mat":
        return read_mat_columns(path)
    return read_parquet_columns(path) if suffix == ".parquet" else read_sheet(path, dialect)
