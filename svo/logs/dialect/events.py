"""Channels at their own times, merged into events: no reading is moved in time, and no grid is asked for.

An event is an instant at which a sensor is read or an input changes. The sensors that are not read there are missing,
and each input is what it was last said to be. Stamps are compared as they stand, in picoseconds.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from svo.checks import Array
from svo.logs.dialect.channels import Channels, when
from svo.logs.dialect.clocks import check_counts, check_kinds
from svo.logs.dialect.series import Series
from svo.logs.dialect.stamps import seconds
from svo.logs.log import Log
from svo.logs.names import Columns


def merged(
    path: Path, columns: Columns, Ts: float, channels: Channels, series: Mapping[str, Series]
) -> tuple[Log, str]:
    """The log of all channels, whose time begins at 0, and its first event's own time for people.

    Events before all inputs are known, and after the last reading of one that is not held, are left out and noted.

    Raises
    ------
    ValueError
        Naming the file, the line and the column.
    """
    channels.check_clocks(series, Ts)
    check_counts(channels, series)
    check_kinds(series)
    inputs, outputs = ([series[column.name] for column in group] for group in (columns.inputs, columns.outputs))
    for one in inputs:
        if not channels.rule(one.name).hold:
            _check_known(one)
    changes = {one.name: _changes(one) for one in inputs}
    read = {one.name: _stamps(one) for one in outputs}
    stamps = sorted(set().union(*changes.values(), *read.values()))
    first = bisect_left(stamps, max((_stamps(one)[0] for one in inputs), default=stamps[0]))
    ends = [one.stamp(-1) for one in inputs if not channels.rule(one.name).hold]
    last = bisect_right(stamps, min(ends, default=stamps[-1]))
    chosen = stamps[first:last]
    if not any(chosen[0] <= stamp <= chosen[-1] for stamps in read.values() for stamp in stamps):
        raise ValueError(f"{path}: no sensor is read while {', '.join(changes)} are known")
    for name, own in read.items():
        beside = len(own) - bisect_right(own, chosen[-1]) + bisect_left(own, chosen[0])
        if beside:
            channels.notes.append(f"{beside} readings of {name}, where an input is not known, are left out")
    where = {stamp: k for k, stamp in enumerate(chosen)}
    y = np.full((len(chosen), len(outputs)), np.nan)
    for j, one in enumerate(outputs):
        for stamp, value in zip(read[one.name], one.values.tolist(), strict=True):
            if stamp in where:
                y[where[stamp], j] = value
    u = np.array([_held(one, chosen) for one in inputs]).reshape(len(inputs), len(chosen)).T
    time = np.array([seconds(stamp - chosen[0]) for stamp in chosen])
    anchor = next(one for one in series.values() if one.values.size)
    return Log(time, u, y, events=True), when(anchor, chosen[0])


def _stamps(one: Series) -> list[int]:
    return [one.block.time[i] for i in one.at.tolist()]


def _changes(one: Series) -> list[int]:
    """When an input begins and changes."""
    differs = np.append(True, np.diff(one.values) != 0)
    return [one.block.time[i] for i in one.at[differs].tolist()]


def _held(one: Series, stamps: list[int]) -> Array:
    """The values of an input at events, each what was read last."""
    own = _stamps(one)
    return one.values[[bisect_right(own, stamp) - 1 for stamp in stamps]]


def _check_known(one: Series) -> None:
    """An input has a reading in each of its rows, from its first reading to its last."""
    own = _stamps(one)
    read = set(own)
    for i, stamp in enumerate(one.block.time):
        if own[0] < stamp < own[-1] and stamp not in read:
            raise ValueError(
                f"{one.block.place(i)}, {one.label}: input {one.name} has no reading. An input must be known: state "
                f'missing = "hold" in [log.columns.{one.name}] if it stays what it was'
            )
