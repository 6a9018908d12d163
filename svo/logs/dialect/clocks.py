"""Whether the times of channels can be compared: two clocks, and rows that are counted though they have stamps."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np

from svo.logs.dialect.channels import Channels, when
from svo.logs.dialect.series import Series
from svo.logs.dialect.stamps import PICO, seconds


def check_kinds(series: Mapping[str, Series]) -> None:
    """Raise a ValueError if channels have times of different kinds, which cannot be compared.

    Parameters
    ----------
    series : mapping of str to Series
    """
    known = [one for one in series.values() if one.values.size]
    for one in known[1:]:
        _check_kind(known[0], one)


def check_counts(channels: Channels, series: Mapping[str, Series]) -> None:
    """Raise a ValueError if rows are counted that have other times by their stamps.

    Parameters
    ----------
    channels : Channels
    series : mapping of str to Series
    """
    known = [one for one in series.values() if one.values.size]
    counted = [one for one in known if channels.times(one.name).step is not None]
    stamped = [one for one in known if channels.times(one.name).step is None]
    for one, other in product(counted, stamped):
        if one.block.source is other.block.source and _kind(one) == _kind(other):
            _check_count(one, other, channels.times(one.name).step or 0.0)


def slow_note(series: Mapping[str, Series], Ts: float) -> list[str]:
    """A note if no channel has readings as often as the model has samples.

    Parameters
    ----------
    series : mapping of str to Series
    Ts : float
        Sampling time of the model [s].
    """
    known = [one for one in series.values() if one.values.size > 1]
    steps = [float(np.median(np.diff(one.time(one.stamp(0))))) for one in known]
    if not steps or min(steps) < 1.5 * Ts:
        return []
    return [f"readings come each {min(steps):.6g} s at most, and the sampling time is {Ts:g} s; is Ts right?"]


def _check_kind(one: Series, other: Series) -> None:
    """Dates, local dates and seconds are three kinds of times."""
    if _kind(one) == _kind(other):
        return
    raise ValueError(
        f"{other.block.source.source}: times of {one.name} are {_kind(one)} ({when(one, one.stamp(0))}), those of "
        f"{other.name} are {_kind(other)} ({when(other, other.stamp(0))}), so they cannot be compared; state both "
        "alike (start may be a date, such as start = 2025-03-14T10:15:00Z; zone is that of local dates)"
    )


def _kind(one: Series) -> str:
    if not one.block.is_date:
        return "seconds"
    return "local dates" if one.block.is_local else "dates"


def _check_count(one: Series, other: Series, step: float) -> None:
    """A row that is lost, or stands twice, moves all that are counted behind it."""
    stamps = dict(zip(other.block.rows, other.block.time, strict=True))
    for i, (row, time) in enumerate(zip(one.block.rows, one.block.time, strict=True)):
        if row in stamps and abs(stamps[row] - time) > step / 2 * PICO:
            raise ValueError(
                f"{one.block.place(i)}: the row is at {seconds(stamps[row] - one.block.time[0]):.9g} s by its stamp, "
                f"and at {seconds(time - one.block.time[0]):.9g} s by start and step of {one.name}: is a row lost "
                "before it, or there twice? Put one with a stamp and empty cells in its place, or leave "
                "start and step out"
            )
