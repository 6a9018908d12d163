"""The rows of a file that share their stamps, in order of time: all rows of a table, or those of a tag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import Decimal

import numpy as np

from svo.logs.dialect.numbers import Marks
from svo.logs.dialect.rules import Times, Which
from svo.logs.dialect.source import Source
from svo.logs.dialect.stamps import UNITS, Stamps, counted, seconds, stamps_of, stamps_of_rows

_DAY = 86400.0
SUMMER = (3600.0, 1800.0)  # by which clocks are changed; half an hour on Lord Howe Island


@dataclass(frozen=True)
class Block:
    """Rows and their stamps.

    Attributes
    ----------
    source : Source
    rows : list of int
        Positions in the columns of the source.
    time : list of int
        Picoseconds, in no order yet if `ordered` was not asked.
    is_date, is_local : bool
        As of `Stamps`.
    called : str
        How messages call the stamps.
    columns : tuple of str or int
        That they stand in.
    notes : tuple of str
    """

    source: Source
    rows: list[int]
    time: list[int]
    is_date: bool
    is_local: bool
    called: str
    notes: tuple[str, ...]
    columns: tuple[Which, ...]

    def place(self, i: int) -> str:
        return f"{self.source.source}, {self.source.place(self.rows[i])}"

    def taken(self, chosen: Sequence[int]) -> Block:
        """Some of its rows."""
        return replace(self, rows=[self.rows[i] for i in chosen], time=[self.time[i] for i in chosen])


def block_of(
    source: Source, rows: list[int], rule: Times, marks: Marks, used: Sequence[Which], *, in_order: bool = True
) -> Block:
    """Rows with the stamps that a rule gives them; rows that hold neither time nor a reading of ``used`` are left out.

    Local stamps of the hour that comes twice need rows ``in_order`` of time.

    Raises
    ------
    ValueError
        Naming the line and the column.
    """
    if rule.step is not None:
        called = "start and step"
        stamps = stamps_of_rows(len(rows), lambda _: f"{source.source}, start of [log.time]", rule)
        return Block(source, rows, stamps.picoseconds, stamps.is_date, stamps.is_local, called, stamps.notes, ())
    columns = [source.column(which) for which in rule.columns]
    for which, column in zip(rule.columns, columns, strict=True):
        other = next((value for value in used if source.size(value) != len(column)), None)
        if other is not None:
            raise ValueError(
                f"{source.source}: {source.label(which)} has {len(column)} samples and {source.label(other)} has "
                f"{source.size(other)}; expected times of the readings"
            )
    called = " and ".join(source.label(which) for which in rule.columns)
    if len(columns) == 1 and isinstance(columns[0], np.ndarray):
        stamps = _of_numbers(source, columns[0], rows, rule, called, in_order)
    else:
        values = [source.column(which) for which in used]
        texts = {row: " ".join(str(column[row]) for column in columns).strip() for row in rows}
        rows = [row for row in rows if texts[row] or any(str(column[row]) for column in values)]
        cells = [texts[row] for row in rows]

        def where(i: int) -> str:
            return f"{source.source}, {source.place(rows[i])}, {called}"

        stamps = stamps_of(cells, where, rule, marks, in_order=in_order)
    return Block(source, rows, stamps.picoseconds, stamps.is_date, stamps.is_local, called, stamps.notes, rule.columns)


def _of_numbers(
    source: Source, values: np.ndarray, rows: Sequence[int], rule: Times, called: str, in_order: bool
) -> Stamps:
    if rule.format is not None:
        raise ValueError(
            f"{source.source}, {called} holds numbers, and [log.time] states a format of texts; state unit"
        )
    taken = values[list(rows)]
    bad = np.flatnonzero(~np.isfinite(taken))
    if bad.size:
        raise ValueError(f"{source.source}, {source.place(rows[bad[0]])}, {called}: {taken[bad[0]]} is no time")
    factor, unit = Decimal(repr(rule.scale)), UNITS[rule.unit or "s"]
    time = [round(Decimal(repr(value)) * factor * unit) for value in taken.tolist()]
    return counted(time, lambda i: f"{source.source}, {source.place(rows[i])}, {called}", rule, in_order=in_order)


def ordered(block: Block, *, part: int | None, sort: bool) -> Block:
    """One recording, in order of time.

    Parameters
    ----------
    block : Block
    part : int or None
        Which one, from 1 on, where time goes back between them.
    sort : bool
        Rows may stand in any order.

    Raises
    ------
    ValueError
        If time goes back although there is one recording, or there is no such part.
    """
    back = [i for i in range(1, len(block.time)) if block.time[i] < block.time[i - 1]]
    if sort:
        return block.taken(sorted(range(len(block.time)), key=block.time.__getitem__))
    ends = [0, *back, len(block.time)]
    if part is not None:
        if part > len(back) + 1:
            raise ValueError(
                f"{block.source.source} has {len(back) + 1} part{'s' * bool(back)}, and [log] asks for part {part}"
            )
        return block.taken(range(ends[part - 1], ends[part]))
    if back:
        raise _goes_back(block, back, np.diff(ends).tolist())
    return block


def _goes_back(block: Block, back: Sequence[int], counts: Sequence[int]) -> ValueError:
    i = back[0]
    step = seconds(block.time[i - 1] - block.time[i])
    between = range(block.source.line(block.rows[i - 1]), block.source.line(block.rows[i]))
    again = [line for line in block.source.again if line in between]
    found = f"{block.place(i)}: time goes back by {step:.9g} s"
    if not block.is_date:
        found += f", from {seconds(block.time[i - 1]):.9g} s to {seconds(block.time[i]):.9g} s"
    if again:
        found += f", after the names came again in line {again[-1]}"
    sort = 'order = "sort" if its rows are in no order'
    if len(back) > 9:
        return ValueError(f"{found}, and at {len(back) - 1} places more; state in [log] {sort}")
    sizes = f"{', '.join(map(str, counts[:-1]))} and {counts[-1]}"
    parts = f"{len(counts)} recordings, of {sizes} samples? The time between is not in the file: state part"
    if len(back) == 1 and block.is_local and any(0.5 * by < step <= by for by in SUMMER):
        return ValueError(
            f"{found}; the end of summer time (state zone in [log.time]), or a restart, {parts} in [log] (or {sort})"
        )
    midnight = "; midnight? Then the date is needed too" if _DAY / 2 < step < _DAY and not block.is_date else ""
    return ValueError(f"{found}{midnight}: {parts} in [log], or {sort}")
