"""Logs as CSV text: a header with column names, then one row a sample; UTF-8, commas.

Floats are written in their shortest form that reads back to the same bits.
"""

from __future__ import annotations

import csv
import io
import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from svo.logs.columns import Array, LogNote, may_be_missing, not_finite, not_there, parts, wanted_columns
from svo.logs.log import Log
from svo.logs.names import Columns


def write_csv(path: Path, cells: Mapping[str, Array]) -> None:
    """Write columns (K,) by name; NaN becomes an empty cell."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(cells)
        for row in np.column_stack(list(cells.values())).tolist():
            writer.writerow("" if math.isnan(value) else repr(value) for value in row)


def read_csv(path: Path, columns: Columns, Ts: float) -> Log:
    """Read a log; errors name the line and the column.

    A last line without its end is no sample: nobody can tell "2" from the beginning of "2.638". It is left out with a
    `LogNote`.
    """
    with io.TextIOWrapper(_complete_lines(path), newline="", encoding="utf-8-sig") as file, csv_errors(str(path)):
        rows = _rows(file)
        parser = RowParser(str(path), next(rows, (0, []))[1], columns)
        lines, values = [], []
        for line, row in rows:
            lines.append(line)
            values.append(parser.parse(line, row))
    table = np.array(values).reshape(-1, len(parser.names))
    cells = {name: table[:, i].copy() for i, name in enumerate(parser.names)}
    return Log(**parts(str(path), cells, columns, Ts, lambda k: f"line {lines[k]}"))


def _complete_lines(path: Path) -> io.BytesIO:
    """The bytes of a file up to the end of its last line that has one, or all of its only line."""
    data = path.read_bytes()
    end = max(data.rfind(b"\n"), data.rfind(b"\r")) + 1 or len(data)  # one line is a header, whole or not: no sample
    if data[end:].strip():
        lines = data.count(b"\n", 0, end) or data.count(b"\r", 0, end)
        warnings.warn(f"{path}: {no_end(lines + 1)}", LogNote, stacklevel=4)
    return io.BytesIO(data[:end])


def no_end(line: int) -> str:
    """What is said of a last line that may be cut."""
    return (
        f"the last line ({line}) has no end and was left out, since it may be cut; "
        "if it is whole, put a line break behind it"
    )


DIALECT: dict[str, Any] = {"strict": True, "skipinitialspace": True}  # of `csv.reader`


class RowParser:
    """Turns the rows under one header into numbers, in the order of ``names``.

    Attributes
    ----------
    names : list of str
        The columns that are read: time, inputs, outputs and, if all are there, states.
    """

    def __init__(self, source: str, header: Sequence[str], columns: Columns) -> None:
        if not header:
            raise ValueError(f"{source} is empty; expected a header line with column names and one row a sample")
        present = [name.strip() for name in header]
        _check_separator(source, present, columns)
        self.names = wanted_columns(source, present, columns)
        self._source, self._width = source, len(present)
        self._where = [present.index(name) for name in self.names]
        unknown = may_be_missing(columns)
        self._may_be_missing = [name in unknown for name in self.names]

    def parse(self, line: int, row: Sequence[str]) -> list[float]:
        """Numbers of one row.

        Raises
        ------
        ValueError
            Naming the line and the column.
        """
        if len(row) != self._width:
            raise ValueError(f"{self._source}, line {line}: {len(row)} cells; expected {self._width}, as in the header")
        return [self._number(line, i, row[position]) for i, position in enumerate(self._where)]

    def readable(self, row: Sequence[str]) -> list[float] | None:
        """The numbers of a row in which not every cell is one, NaN elsewhere; None if its cells can't be told apart."""
        if len(row) != self._width:
            return None
        return [number if math.isfinite(number := _number(row[at])) else math.nan for at in self._where]

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
def csv_errors(source: str) -> Iterator[None]:
    """Say of bytes that are no CSV text what they are not."""
    try:
        yield
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(
            f"{source} is not a CSV text file ({error}); expected comma-separated columns in UTF-8"
        ) from error


def _rows(file: TextIO) -> Iterator[tuple[int, list[str]]]:
    """Line numbers and cells of the rows that are not blank."""
    reader = csv.reader(file, **DIALECT)
    for row in reader:
        if row:
            yield reader.line_num, row
