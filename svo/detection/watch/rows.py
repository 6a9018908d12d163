"""Rows out of the lines of logs: which lines are headers, and what can be read of a line that is damaged."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from svo.detection.watch.lines import Line
from svo.detection.watch.timeline import Row
from svo.logs.csv import DIALECT, RowParser, csv_errors
from svo.logs.dialect.live import LiveLines, LiveParser

if TYPE_CHECKING:
    from svo.logs.dialect.rules import Dialect
    from svo.logs.names import Columns


class RowReader:
    """Reads lines under the header that came before them.

    Parameters
    ----------
    source : str
        Name of the log, for messages.
    columns : Columns
    bad : callable
        Called with the reason for each line that cannot be read.
    dialect : Dialect, optional
        How the log is written, if it is not a plain one.
    """

    def __init__(
        self, source: str, columns: Columns, bad: Callable[[str], None], dialect: Dialect | None = None
    ) -> None:
        self.line = 0
        self._source, self._columns, self._bad, self._dialect = source, columns, bad, dialect
        self._live = None if dialect is None else LiveLines(dialect)
        self._header: list[str] = []
        self._parser: RowParser | LiveParser | None = None
        self._is_first, self._is_new_file = True, False
        if dialect is not None and dialect.names:
            self._read_header(list(dialect.names))
            self._is_first = False

    def begin_file(self) -> None:
        """The next lines are those of another file: with a header, or without one under the header of before."""
        self.line, self._is_new_file = 0, True

    def row(self, line: Line) -> Row | None:
        """The row in a line; None for headers, blank lines, and lines that cannot be read.

        Raises
        ------
        ValueError
            If the first line of all is no header of the columns.
        """
        self.line = line.number
        place = f"{self._source}, line {line.number}"
        if line.fault is not None and self._is_first:
            raise ValueError(f"{place}: {line.fault}; expected a header line with column names, in UTF-8")
        if line.fault is not None:
            self._bad(f"{place}: {line.fault}")
            return None
        if not line.text.strip() or (self._live is not None and self._live.is_skipped(line.number, line.text)):
            return None
        if self._is_first:
            self._read_header(self._cells(place, line.text))
            self._is_first = False
            return None
        try:
            return self._row(place, self._cells(place, line.text), line.number)
        except ValueError as error:
            self._bad(str(error))
            return None

    def _cells(self, place: str, text: str) -> list[str]:
        with csv_errors(f"{place}:"):
            if self._live is not None:
                return self._live.cells(text)
            return [cell.strip() for cell in next(csv.reader([text], **DIALECT))]

    def _row(self, place: str, cells: list[str], number: int) -> Row | None:
        starts, self._is_new_file = self._is_new_file, False
        if (cells == self._header and self._parser is not None) or not any(cells):
            return None
        if self._live is not None and self._live.is_names(number):
            self._read_header(cells)
            return None
        if starts or self._parser is None:
            try:
                self._read_header(cells)
                return None
            except ValueError:
                if self._parser is None:
                    raise
                if self._may_be_header(cells):
                    self._parser = None  # the columns may stand in another order from here on
                    raise
        assert self._parser is not None
        return self._values(self._parser, place, cells, number)

    def _values(self, parser: RowParser | LiveParser, place: str, cells: Sequence[str], number: int) -> Row | None:
        """What a row says; of a damaged one its time and inputs, where these can be read, and no reading."""
        inputs, outputs = len(self._columns.inputs), len(self._columns.outputs)
        try:
            values = np.array(parser.parse(number, cells))
        except ValueError as error:
            self._bad(str(error))
            readable = parser.readable(cells)
            if readable is None or np.isnan(readable[0]):
                return None
            values = np.array(readable)
            values[1 + inputs :] = np.nan
        if np.isnan(values[0]):
            return None  # nothing of the plant is in this row
        return Row(float(values[0]), values[1 : 1 + inputs], values[1 + inputs : 1 + inputs + outputs], place)

    def _read_header(self, cells: list[str]) -> None:
        origin = self._parser.origin if isinstance(self._parser, LiveParser) else None
        if self._dialect is None:
            self._parser = RowParser(self._source, cells, self._columns)
        else:
            self._parser = LiveParser(self._source, cells, self._columns, self._dialect)
            self._parser.origin = origin
        self._header = cells

    def _may_be_header(self, cells: Sequence[str]) -> bool:
        """Whether a line that is no good header is a wrong one, and not a row or the end of one."""
        if self._dialect is not None:
            return False
        time = self._header.index(self._columns.time)
        return len(cells) == len(self._header) and not _is_number(cells[time]) and cells[time] != ""

    def state(self) -> dict[str, Any]:
        """The header, and where time begins, for JSON."""
        return {"names": self._header, "origin": getattr(self._parser, "origin", None)}

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on under a header that `state` gave; the log may be another file by now."""
        if state["names"]:
            self._read_header(list(state["names"]))
            if isinstance(self._parser, LiveParser) and state["origin"] is not None:
                self._parser.origin = int(state["origin"])
            self._is_first, self._is_new_file = False, True


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
