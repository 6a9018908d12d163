"""Rows and named columns of a text file, every cell as the text that it is."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from svo.logs.dialect.rules import Dialect, Which
from svo.logs.dialect.text import lines_of

_SAMPLES = re.compile(r'"?((?:number of )?(?:samples|rows|records|points))\b"?[\s:;,=]+"?(\d{1,12})\b', re.IGNORECASE)


@dataclass(frozen=True)
class Sheet:
    """The rows of a text file.

    Attributes
    ----------
    source : str
        The file, for messages.
    names : tuple of str
        Of the columns; "" where one has none.
    rows : sequence of sequence of str
        Cells, as many a row as there are names.
    lines : sequence of int
        The line of the file that each row begins in.
    again : tuple of int
        Lines in which the names stood again.
    notes : tuple of str
    """

    source: str
    names: tuple[str, ...]
    rows: Sequence[Sequence[str]]
    lines: Sequence[int]
    again: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    def place(self, row: int) -> str:
        """Where a row stands, for messages."""
        return f"line {self.lines[row]}"

    def size(self, which: Which) -> int:
        """Rows of a column."""
        return len(self.rows)

    def line(self, row: int) -> int:
        """The line that a row begins in."""
        return self.lines[row]

    def column(self, which: Which) -> list[str]:
        """The cells of a column.

        Raises
        ------
        ValueError
            If there is no such column, or more than one.
        """
        at = self.position(which)
        return [row[at] for row in self.rows]

    def label(self, which: Which) -> str:
        """How messages call a column."""
        return f"column {which!r}" if isinstance(which, str) else f"column {which} ({self.names[which - 1]!r})"

    def position(self, which: Which) -> int:
        """Where a column stands, from 0 on."""
        if isinstance(which, int):
            if not 1 <= which <= len(self.names):
                raise ValueError(f"{self.source} has no column {which}; expected a number from 1 to {len(self.names)}")
            return which - 1
        found = [i for i, name in enumerate(self.names) if name == _one_line(which)]
        if not found:
            raise ValueError(f"{self.source} has no column {which!r}; {self._others(which)}")
        if len(found) > 1:
            where = " and ".join(str(i + 1) for i in found)
            raise ValueError(f"{self.source}: {which!r} is the name of columns {where}; state the number instead")
        return found[0]

    def _others(self, which: str) -> str:
        named = [name for name in self.names if name]
        close = get_close_matches(which, named, n=1)
        meant = f"; is {close[0]!r} meant?" if close else ""
        return f"found {', '.join(map(repr, named)) or 'no names'}{meant}"


def read_sheet(path: Path, dialect: Dialect) -> Sheet:
    """Read a text file as a dialect states it.

    Raises
    ------
    ValueError
        Naming the file and the line.
    OSError
        If the file cannot be opened.
    """
    lines, whole = lines_of(path, dialect.encoding)
    notes = []
    if lines and not whole:
        notes.append(_no_end(len(lines)))
        lines = lines[:-1] if len(lines) > 1 else lines
    names, behind, skipped = _names(str(path), lines, dialect)
    feed = _Feed(lines, max(behind, dialect.first_row or 0), dialect)
    feed.keeps_blank = dialect.counts_rows and len(names) == 1
    found, numbers, again = [], [], []
    names_cut = _ends_cut(names)
    for line, row in _rows(str(path), feed, dialect):
        cells = [cell.strip() for cell in row]
        if not any(cells) and not dialect.counts_rows:
            continue
        if any(cells) and _one_line(cells[0]) == names[0] and _ends_cut([*map(_one_line, cells)]) == names_cut:
            again.append(line)
            continue
        found.append(fitted(str(path), line, cells, names, dialect.separator))
        numbers.append(line)
    while found and not any(found[-1]):  # nothing tells empty rows at the end from samples
        del found[-1], numbers[-1]
    notes += _promised(lines, dialect, len(found))
    if dialect.counts_rows and not feed.keeps_blank:
        notes += _blank_between(lines, numbers)
    if skipped + feed.skipped:
        notes.append(f"{skipped + feed.skipped} lines are skipped, as [log] states")
    if again:
        notes.append(f"the names stand again in line{'s' * (len(again) > 1)} {', '.join(map(str, again[:5]))}")
    return Sheet(str(path), names, found, numbers, tuple(again), tuple(notes))


def _promised(lines: Sequence[str], dialect: Dialect, rows: int) -> list[str]:
    """A note if the lines before the names say another number of rows than there are."""
    for line in lines[: (dialect.header or 1) - 1]:
        said = _SAMPLES.match(line)
        if said and int(said[2]) != rows:
            return [f"the preamble says {said[1]} {said[2]}, but there are {rows} rows; the rows count"]
    return []


def _blank_between(lines: Sequence[str], numbers: Sequence[int]) -> list[str]:
    """A note if lines between the rows are blank, where the place of a row is its time."""
    blank = [k for k in range(numbers[0], numbers[-1]) if not lines[k - 1].strip()] if numbers else []
    if not blank:
        return []
    return [
        f"{len(blank)} blank lines between the rows (line {blank[0]} the first) are taken for no samples; if one is, "
        "write its separators"
    ]


def _no_end(line: int) -> str:
    return (
        f"the last line ({line}) has no end and was left out, since it may be cut; if it is whole, put a line break "
        "behind it"
    )


def _names(source: str, lines: Sequence[str], dialect: Dialect) -> tuple[tuple[str, ...], int, int]:
    """The names, the line behind them (they may stand in several), and how many lines were skipped before them."""
    if dialect.names:
        return tuple(map(_one_line, dialect.names)), 1, 0
    if dialect.header is None:
        feed = _Feed(lines, 1, dialect)
    elif len(lines) < dialect.header:
        raise ValueError(
            f"{source} ends at line {len(lines)}; expected the names of the columns in line {dialect.header}, as "
            "header of [log] states"
        )
    elif not lines[dialect.header - 1].strip():
        raise ValueError(f"{source}, line {dialect.header}: the line is blank; expected the names of the columns")
    else:
        feed = _Feed(lines, dialect.header, replace(dialect, skip=()))
    row = next(_rows(source, feed, dialect), None)
    if row is None:
        raise ValueError(f"{source} is empty; expected a line with the names of the columns and one row a sample")
    return tuple(map(_one_line, row[1])), feed.last + 1, feed.skipped


class _Feed:
    """Hands lines to the reader of cells, and knows where the row that it makes begins and ends."""

    def __init__(self, lines: Sequence[str], first: int, dialect: Dialect) -> None:
        self._lines, self._first = lines, first
        self._skip = [re.compile(pattern) for pattern in dialect.skip]
        self._separator, self._blanks = dialect.separator, dialect.separator == " "
        self.begin: int | None = None
        self.last = 0
        self.skipped = 0
        self.keeps_blank = False

    def __iter__(self) -> Iterator[str]:
        for number, line in enumerate(self._lines[self._first - 1 :], start=self._first):
            self.last = number
            if number == 1 and line.strip() == f"sep={self._separator}":
                continue  # a spreadsheet's word on what is stated
            if any(pattern.search(line) for pattern in self._skip):
                self.skipped += 1
                continue
            if self.begin is None:
                if not line.strip() and not self.keeps_blank:
                    continue
                self.begin = number
            yield (" ".join(line.split()) if self._blanks else line) + "\n"


def _rows(source: str, feed: _Feed, dialect: Dialect) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of each row that is not blank."""
    options: dict[str, Any] = {"strict": True, "skipinitialspace": True, "delimiter": dialect.separator}
    reader = csv.reader(iter(feed), **options)
    while True:
        feed.begin = None
        try:
            row = next(reader, None)
        except csv.Error as error:
            raise ValueError(
                f"{source}, line {feed.begin}: the cells cannot be told apart ({error}); is the separator "
                f"{dialect.separator!r}, and is every quote closed?"
            ) from error
        if row is None:
            return
        if row or feed.keeps_blank:
            yield feed.begin or 0, row


def _one_line(name: str) -> str:
    """A name with single blanks, also where it is broken into lines."""
    return " ".join(name.split())


def _ends_cut(cells: Sequence[str]) -> list[str]:
    """Without the empty cells at the end."""
    last = max((i for i, cell in enumerate(cells) if cell), default=-1)
    return list(cells[: last + 1])


def fitted(source: str, line: int, cells: list[str], names: Sequence[str], separator: str) -> list[str]:
    """As many cells as there are names: a short row is padded, and what is too much must be empty.

    Raises
    ------
    ValueError
        If cells are too many; or too few, and between blanks, where nothing shows which of them is empty.
    """
    if separator == " " and any(cells) and len(cells) < len(names):
        raise ValueError(
            f"{source}, line {line}: {len(cells)} cells, but {len(names)} names of columns, and between blanks nothing "
            "shows which cell is empty; state names in [log] if the line of the names has more words than columns, or "
            "skip if the line is no row"
        )
    if len(cells) == len(names):
        return cells
    extra = [cell for cell in cells[len(names) :] if cell]
    if extra:
        raise ValueError(
            f"{source}, line {line}: {len(cells)} cells ({extra[0]!r:.60} among them), but {len(names)} names of "
            "columns; state skip in [log] if the line is no row, or another header or separator"
        )
    return cells[: len(names)] + [""] * (len(names) - len(cells))
