"""Logs in portions: a long one need not be in memory as a whole."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from svo.checks import Array
from svo.logs.columns import Place, is_sampled, parts, wrong_step
from svo.logs.log import Log
from svo.logs.names import Columns


class Rows(NamedTuple):
    """Rows of a file that follow each other.

    Attributes
    ----------
    cells : mapping of str to (rows,) array
        The columns of `svo.logs.columns.wanted_columns`, whose cells have been checked.
    place : callable
        Where one of these rows stands in the file, by its number among them.
    """

    cells: Mapping[str, Array]
    place: Place


def samples_from(first: int) -> Place:
    """The place of rows that are counted, of which the first one is sample ``first``."""
    return lambda k: f"sample {first + k}"


def portions_of(source: str, rows: Iterable[Rows], columns: Columns, Ts: float | None) -> Iterator[Log]:
    """A log of at least one sample for each portion of rows that has any, once its times are checked.

    Raises
    ------
    ValueError
        Naming the source, the place and the column; and if there is no sample at all.
    """
    last: float | None = None
    for cells, place in rows:
        time = cells[columns.time]
        if not len(time):
            continue
        if last is not None and not is_sampled(last, time[0], Ts):
            raise wrong_step(f"{source}, {place(0)}, column {columns.time!r}", last, time[0], Ts)
        last = float(time[-1])
        yield Log(**parts(source, cells, columns, Ts, place))
    if last is None:
        raise ValueError(f"{source} has a header but no samples; expected one row a sample")


def joined(portions: Sequence[Log]) -> Log:
    """The log that these are the portions of."""
    if len(portions) == 1:
        return portions[0]

    def whole(name: str) -> Any:
        arrays = [getattr(portion, name) for portion in portions]
        return None if arrays[0] is None else np.concatenate(arrays)

    arrays = {name: whole(name) for name in ("time", "u", "y", "x", "schedule")}
    return replace(portions[0], **arrays)
