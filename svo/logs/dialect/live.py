"""Rows of a text that is still growing, one at a time: what of a dialect can be read so, and how."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from svo.checks import Array
from svo.logs.dialect.block import Block
from svo.logs.dialect.numbers import marks_of
from svo.logs.dialect.rules import Channel, Dialect, Times
from svo.logs.dialect.sheet import Sheet, fitted
from svo.logs.dialect.stamps import seconds, stamps_of
from svo.logs.dialect.values import in_model_units, values_of
from svo.logs.names import Column, Columns

_UTF8 = ("utf-8", "utf8", "utf-8-sig", "ascii")


def check_live(dialect: Dialect) -> None:
    """Raise a ValueError that names the key of `[log]` with which rows cannot be read as they come."""
    needs_all = {
        "long": dialect.long is not None,
        'order = "sort"': dialect.sort,
        "part": dialect.part is not None,
        "duplicates": dialect.duplicates != "error",
        "time.zone": dialect.time.zone is not None,
        "time.start": dialect.time.step is not None,
        f"encoding = {dialect.encoding!r}": dialect.encoding.lower().replace("_", "-") not in _UTF8,
    }
    for name, channel in dialect.channels.items():
        for key in ("file", "time", "held", "rate"):
            needs_all[f"columns.{name}.{key}"] = getattr(channel, key) is not None
        needs_all[f"columns.{name}.every"] = channel.every > 1
    keys = [key for key, is_stated in needs_all.items() if is_stated]
    if keys:
        raise ValueError(
            f"[log] states {', '.join(keys)}, and svo watch reads rows of UTF-8 text in order of time, one at a time, "
            "each with all channels; expected a [log] without that, or svo detect for the whole log"
        )


def live_widening(dialect: Dialect, columns: Columns) -> Array | None:
    """What rounding adds to the bounds of the noise, (ny,); None if nothing is stated."""
    rules = [(dialect.channel(column.name), column.unit) for column in columns.outputs]
    wider = [rule.resolution / 2 * abs(in_model_units(rule, unit)[0]) for rule, unit in rules]
    return np.array(wider) if any(wider) else None


class LiveLines:
    """Which lines of a growing text are its names and rows, and their cells."""

    def __init__(self, dialect: Dialect) -> None:
        self._dialect = dialect
        self._skip = [re.compile(pattern) for pattern in dialect.skip]

    def is_names(self, number: int) -> bool:
        """Whether a line can only be that of the names."""
        return number == self._dialect.header

    def is_skipped(self, number: int, text: str) -> bool:
        """Whether a line is neither names nor a row."""
        dialect = self._dialect
        before = dialect.header if dialect.header is not None else 1
        if number < before or (before < number < (dialect.first_row or 0)):
            return True
        if number == 1 and text.strip() == f"sep={dialect.separator}":
            return True
        return not self.is_names(number) and any(pattern.search(text) for pattern in self._skip)

    def cells(self, text: str) -> list[str]:
        """The cells of a line; errors are those of `csv.reader`."""
        mark = self._dialect.separator
        text = " ".join(text.split()) if mark == " " else text
        return [cell.strip() for cell in next(csv.reader([text], delimiter=mark, strict=True, skipinitialspace=True))]


class LiveParser:
    """Turns rows under one line of names into time, inputs and outputs.

    Parameters
    ----------
    source : str
    header : sequence of str
    columns : Columns
    dialect : Dialect

    Attributes
    ----------
    origin : int or None
        Picoseconds of the first row that was read: its time is 0.
    """

    def __init__(self, source: str, header: Sequence[str], columns: Columns, dialect: Dialect) -> None:
        self._source, self._dialect = source, dialect
        self._names = tuple(header)
        self._columns = (*columns.inputs, *columns.outputs)
        self._inputs = len(columns.inputs)
        self._times: Times = dialect.time
        if not self._times.columns:
            self._times = Times(**{**vars(self._times), "columns": (columns.time,)})
        self.origin: int | None = None
        empty = Sheet(source, self._names, [], [])
        for which in (*self._times.columns, *(self._which(column) for column in self._columns)):
            empty.position(which)

    def parse(self, line: int, row: Sequence[str]) -> list[float]:
        """Time [s], inputs and outputs of one row, NaN where there is none; all of them NaN if it holds no channel.

        Raises
        ------
        ValueError
            Naming the line and the column.
        """
        block = self._block(line, row)
        values = [self._value(column, block) for column in self._columns]
        if np.isnan(values).all():
            return [np.nan] * (1 + len(values))
        for column, value in zip(self._columns[: self._inputs], values, strict=False):
            if np.isnan(value) and not self._rule(column).hold:
                raise ValueError(
                    f'{self._source}, line {line}: input {column.name} has no reading; state missing = "hold" in '
                    f"[log.columns.{column.name}] if it stays what it was"
                )
        return [self._time(block), *values]

    def readable(self, row: Sequence[str]) -> list[float] | None:
        """What can be read of a row of which something cannot; None if not even its time."""
        try:
            block = self._block(0, row)
            time = self._time(block)
        except ValueError:
            return None
        values = []
        for column in self._columns:
            try:
                values.append(self._value(column, block))
            except ValueError:
                values.append(np.nan)
        return [time, *values]

    def _block(self, line: int, row: Sequence[str]) -> Block:
        cells = fitted(self._source, line, list(row), self._names, self._dialect.separator)
        sheet = Sheet(self._source, self._names, [cells], [line])
        return Block(sheet, [0], [0], False, False, "", (), self._times.columns)

    def _time(self, block: Block) -> float:
        cells = [" ".join(str(block.source.column(which)[0]) for which in self._times.columns).strip()]
        called = " and ".join(block.source.label(which) for which in self._times.columns)
        stamp = stamps_of(cells, lambda _: f"{block.place(0)}, {called}", self._times, marks_of(self._dialect))
        if self.origin is None:
            self.origin = stamp.picoseconds[0]
        return seconds(stamp.picoseconds[0] - self.origin)

    def _value(self, column: Column, block: Block) -> float:
        return float(values_of(block, self._which(column), self._dialect, self._rule(column), column.unit)[0])

    def _rule(self, column: Column) -> Channel:
        return self._dialect.channel(column.name)

    def _which(self, column: Column) -> Any:
        rule = self._rule(column)
        return column.name if rule.column is None else rule.column
