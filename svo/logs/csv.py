"""Logs as CSV text: a header with column names, then one row a sample; UTF-8, commas.

Floats are written in their shortest form that reads back to the same bits.
"""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from svo.logs.columns import Array, Note, may_be_missing, not_finite, not_there, noted, wanted_columns
from svo.logs.dialect.hints import seems_written
from svo.logs.lines import Lines
from svo.logs.names import Columns
from svo.logs.portions import Rows
from svo.logs.quick_csv import quick_columns

BLOCK = 1 << 20


def write_csv(path: Path, cells: Mapping[str, Array]) -> None:
    """Write columns (K,) by name; NaN becomes an empty cell."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(cells)
        for row in np.column_stack(list(cells.values())).tolist():
            writer.writerow("" if math.isnan(value) else repr(value) for value in row)


def read_csv(
    path: Path, columns: Columns, note: Note = noted, *, block: int = BLOCK, quick_from: int = BLOCK
) -> Iterator[Rows]:
    """The rows of a log, a block of the file at a time; errors name the line and the column.

    A last line without its end is no sample: nobody can tell "2" from the beginning of "2.638". It is left out with a
    note.

    Parameters
    ----------
    path : path
    columns : Columns
    note : callable
    block : int
        Bytes to read at once.
    quick_from : int
        Bytes from which on a file is worth loading pyarrow for, if it is installed. What is read does not depend on it.
    """
    with path.open("rb") as file, csv_errors(str(path)):
        lines = Lines(str(path), file, block, note)
        with _hinted(path):
            header = next((row for row in csv.reader(lines, **DIALECT) if row), [])
            parser = RowParser(str(path), header, columns)
        is_long = os.fstat(file.fileno()).st_size > quick_from
        while lines.block():
            quick = _quick_rows(lines, parser) if is_long else None
            yield from _rows(lines, parser) if quick is None else [quick]


def _quick_rows(lines: Lines, parser: RowParser) -> Rows | None:
    """The next block of lines, if it is an ordinary one with all cells that must be there."""
    numbers = quick_columns(lines.block(), parser.width, parser.positions)
    if numbers is None or not parser.may_be(numbers):
        return None
    first = lines.number + 1
    lines.take_block()
    return Rows(dict(zip(parser.names, numbers, strict=True)), lambda k: f"line {first + k}")


def _rows(lines: Lines, parser: RowParser) -> Iterator[Rows]:
    """The rows of the next block of lines, and the rest of a row that goes on in the one behind it."""
    numbers, values = [], []
    wrong: Exception | None = None
    try:
        for row in csv.reader(lines, **DIALECT):
            if row:
                values.append(parser.parse(lines.number, row))
                numbers.append(lines.number)
            if lines.is_between_blocks:
                break
    except (ValueError, csv.Error) as error:
        wrong = error  # first those before it, in which something else may be wrong
    table = np.array(values).reshape(-1, len(parser.names))
    yield Rows({name: table[:, i].copy() for i, name in enumerate(parser.names)}, lambda k: f"line {numbers[k]}")
    if wrong is not None:
        raise wrong


DIALECT: dict[str, Any] = {"strict": True, "skipinitialspace": True}  # of `csv.reader`


class RowParser:
    """Turns the rows under one header into numbers, in the order of ``names``.

    Attributes
    ----------
    names : list of str
        The columns that are read: time, inputs, outputs and, if all are there, states.
    positions : list of int
        Where they stand.
    width : int
        Cells of a row.
    """

    def __init__(self, source: str, header: Sequence[str], columns: Columns) -> None:
        if not header:
            raise ValueError(f"{source} is empty; expected a header line with column names and one row a sample")
        present = [name.strip() for name in header]
        _check_separator(source, present, columns)
        self.names = wanted_columns(source, present, columns)
        self._source, self.width = source, len(present)
        self.positions = [present.index(name) for name in self.names]
        unknown = may_be_missing(columns)
        self._may_be_missing = [name in unknown for name in self.names]

    def parse(self, line: int, row: Sequence[str]) -> list[float]:
        """Numbers of one row.

        Raises
        ------
        ValueError
            Naming the line and the column.
        """
        if len(row) != self.width:
            raise ValueError(f"{self._source}, line {line}: {len(row)} cells; expected {self.width}, as in the header")
        return [self._number(line, i, row[position]) for i, position in enumerate(self.positions)]

    def may_be(self, columns: Sequence[Array]) -> bool:
        """Whether NaN stands in these columns only where it has a meaning."""
        return all(may or not np.isnan(c).any() for may, c in zip(self._may_be_missing, columns, strict=True))

    def readable(self, row: Sequence[str]) -> list[float] | None:
        """The numbers of a row in which not every cell is one, NaN elsewhere; None if its cells can't be told apart."""
        if len(row) != self.width:
            return None
        return [number if math.isfinite(number := _number(row[at])) else math.nan for at in self.positions]

    def _number(self, line: int, i: int, cell: str) -> float:
        value = _number(cell)
        if math.isinf(value):
            raise not_finite(self._place(line, i), cell)
        if math.isnan(value) and not self._may_be_missing[i]:
            raise not_there(self._place(line, i))
        return value

    def _place(self, line: int, i: int) -> str:
        return f"{self._source}, line {line}, column {self.names[i]!r}"


def _number(cell: str) -> float:
    """NaN for an empty cell, infinity for what is no number."""
    text = cell.strip()
    try:
        return float(text) if text and "_" not in text else math.inf if text else math.nan
    except ValueError:
        return math.inf


def _check_separator(source: str, present: Sequence[str], columns: Columns) -> None:
    """Refuse a header that another separator than the comma would split."""
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(present) == 1 and columns.time in [cell.strip(' "') for cell in present[0].split(separator)]:
            raise ValueError(
                f"{source} has no column {columns.time!r}: its header {present[0]!r} is split by {name}; "
                "expected commas between the cells, and a decimal point in numbers"
            )


@contextmanager
def _hinted(path: Path) -> Iterator[None]:
    """Say of a header that is none how the file seems to be written."""
    try:
        with csv_errors(str(path)):
            yield
    except ValueError as error:
        raise ValueError(f"{error}{seems_written(path)}") from error


@contextmanager
def csv_errors(source: str) -> Iterator[None]:
    """Say of bytes that are no CSV text what they are not."""
    try:
        yield
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(
            f"{source} is not a CSV text file ({error}); expected comma-separated columns in UTF-8"
        ) from error
