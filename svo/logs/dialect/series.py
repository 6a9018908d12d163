"""The readings of a channel: times and values, one each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.logs.dialect.block import Block
from svo.logs.dialect.stamps import moment, seconds

_COUNTS: dict[str, Callable[[Array], float]] = {
    "error": lambda readings: float(readings[0]),
    "first": lambda readings: float(readings[0]),
    "last": lambda readings: float(readings[-1]),
    "mean": lambda readings: float(readings.mean()),
}


@dataclass(frozen=True, eq=False)
class Series:
    """Readings of a channel in order of time.

    Attributes
    ----------
    name : str
        Of the channel.
    label : str
        How messages call its cells.
    block : Block
        Its rows, those without a reading too.
    at : (N,) array of int
        Positions of the readings in the block.
    values : (N,) array
    repeats : int
        Readings that were dropped since they stood there already.
    """

    name: str
    label: str
    block: Block
    at: NDArray[np.int64]
    values: Array
    repeats: int = 0

    def place(self, i: int) -> str:
        """Where a reading stands, for messages."""
        return f"{self.block.place(int(self.at[i]))}, {self.label}"

    def stamp(self, i: int) -> int:
        """Time of a reading in picoseconds."""
        return self.block.time[int(self.at[i])]

    def time(self, origin: int) -> Array:
        """Times of the readings [s] since ``origin`` [ps]."""
        return np.array([seconds(self.block.time[i] - origin) for i in self.at.tolist()])

    def taken(self, chosen: NDArray[np.bool_]) -> Series:
        """Some of its readings."""
        return Series(self.name, self.label, self.block, self.at[chosen], self.values[chosen], self.repeats)


def series_of(name: str, label: str, block: Block, values: Array, duplicates: str) -> Series:
    """The readings of a channel, one a time.

    Parameters
    ----------
    name, label : str
        As of `Series`.
    block : Block
    values : (rows of the block,) array
        NaN where there is no reading.
    duplicates : {"error", "first", "last", "mean"}
        What counts where readings of one time differ.

    Raises
    ------
    ValueError
        If readings of one time differ, and none is stated to count.
    """
    known = np.flatnonzero(~np.isnan(values))
    time = [block.time[i] for i in known.tolist()]
    begins = [i for i in range(len(time)) if i == 0 or time[i] != time[i - 1]]
    repeats = len(time) - len(begins)
    if not repeats:
        return Series(name, label, block, known, values[known])
    groups = [known[a:b] for a, b in zip(begins, [*begins[1:], len(time)], strict=True)]
    differ = [group for group in groups if np.ptp(values[group])]
    if differ and duplicates == "error":
        raise _conflict(name, label, block, values, differ[0])
    chosen = np.array([_COUNTS[duplicates](values[group]) for group in groups])
    return Series(name, label, block, known[begins], chosen, repeats)


def _conflict(name: str, label: str, block: Block, values: Array, group: NDArray[np.int64]) -> ValueError:
    stamp = block.time[int(group[0])]
    when = moment(stamp) if block.is_date else f"{seconds(stamp):.9g} s"
    ends = f"{values[group[0]]:g} and {values[group[-1]]:g}"
    several = f"{len(group)} readings of {name} share {when} ({ends} among them)"
    finer = _finer(block, len(set(block.time)))
    if block.columns and _is_whole(block.time) and len(group) > 2:
        rows = _rows_of(block, int(group[0]))
        several += f", as {rows} rows do: the resolution of {block.called} is 1 s" + (
            f", {finer} has more" if finer else ""
        )
    return ValueError(
        f"{block.place(int(group[-1]))}, {label}: {several}. State other times, or which one counts: duplicates = "
        '"first", "last" or "mean" in [log]'
    )


def _rows_of(block: Block, i: int) -> int:
    """How many rows of the file have the text of a stamp, whatever else is in them."""
    columns = [block.source.column(which) for which in block.columns]
    texts = list(zip(*(map(str, column) for column in columns), strict=True))
    return texts.count(texts[block.rows[i]]) if texts else 0


def _is_whole(time: Sequence[int]) -> bool:
    return all(stamp % 10**12 == 0 for stamp in time)


def _finer(block: Block, distinct: int) -> str | None:
    """A column of numbers beside the stamps that tells more rows apart than they do, and never goes back."""
    names = [name for name in getattr(block.source, "names", ()) if name]
    for name in names:
        if names.count(name) > 1:
            continue
        cells = [str(block.source.column(name)[row]).replace(",", ".") for row in block.rows]
        try:
            numbers = [float(cell) for cell in cells]
        except ValueError:
            continue
        if len(set(numbers)) > distinct and numbers == sorted(numbers):
            return f"column {name!r}"
    return None
