"""Columns of Parquet files: numbers as they are, all else as texts."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from svo.logs.dialect.rules import Which
from svo.logs.dialect.source import Cells
from svo.logs.parquet import read_table


@dataclass(frozen=True)
class ParquetColumns:
    """The columns of a table of pyarrow.

    Attributes
    ----------
    source : str
        The file, for messages.
    """

    source: str
    table: Any
    again: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        return list(self.table.column_names)

    def column(self, which: Which) -> Cells:
        """Numbers (K,), NaN where there is none; or texts, "" there.

        Raises
        ------
        ValueError
            If there is no such column, or more than one.
        """
        column = self.table.column(self._position(which)).combine_chunks()
        kind = str(column.type)
        if kind.startswith(("int", "uint", "float", "double", "halffloat", "decimal")):
            whole = kind.startswith(("int", "uint")) and not column.null_count
            return column.to_numpy(zero_copy_only=False).astype(None if whole else float)
        return [str(text or "").strip() for text in column.cast("string").to_pylist()]

    def size(self, which: Which) -> int:
        return int(self.table.num_rows)

    def label(self, which: Which) -> str:
        return f"column {which!r}"

    def place(self, row: int) -> str:
        return f"sample {row}"

    def line(self, row: int) -> int:
        return row

    def _position(self, which: Which) -> int:
        names = self.names
        if isinstance(which, int):
            if not 1 <= which <= len(names):
                raise ValueError(f"{self.source} has no column {which}; expected a number from 1 to {len(names)}")
            return which - 1
        if names.count(which) != 1:
            close = get_close_matches(which, names, n=1)
            meant = f"; is {close[0]!r} meant?" if close else ""
            raise ValueError(f"{self.source} has {names.count(which) or 'no'} column {which!r}; found {names}{meant}")
        return names.index(which)


def read_parquet_columns(path: Path) -> ParquetColumns:
    """The columns of a Parquet file.

    Raises
    ------
    ValueError
        If it is damaged or cut off.
    OSError
        If it cannot be opened.
    ImportError
        If pyarrow is not installed.
    """
    return ParquetColumns(str(path), read_table(path))
