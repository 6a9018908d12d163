"""One grid of the sampling time for all channels: what is on it, what is moved to it and at what price.

A model of discrete time reckons with inputs that change at its samples, and with readings of its samples. So an input
is never moved: one that changes elsewhere is an error. A reading is moved in time only at its price, the stated bound
of its rate times the time moved, by which its noise is wider; without such a bound it is no reading of the grid.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from svo.checks import Array
from svo.logs.columns import TIME_TOLERANCE
from svo.logs.dialect.rules import Channel, Times
from svo.logs.dialect.series import Series
from svo.logs.dialect.stamps import UNITS, moment, seconds

_FITS = 0.05  # relative: a unit fits if with it the median step is the sampling time within so much
_FASTER = 0.75  # of the sampling time: readings that come sooner are those of a faster channel
_ROUNDING = 1e-9  # relative; of a time in floats, which is not what the tolerance of the grid is for


@dataclass(frozen=True, eq=False)
class Placed:
    """A channel on the grid.

    Attributes
    ----------
    values : (K,) array
        NaN where there is none.
    moved : float
        The longest time by which a reading was moved [s].
    price : float
        What that adds to the bound of its noise.
    left_out : int
        Readings off the grid that are none of it.
    """

    values: Array
    moved: float = 0.0
    price: float = 0.0
    left_out: int = 0


def grid_of(anchor: Series, Ts: float) -> Array:
    """Times (K,) of the grid [s], the first at 0: those of a channel, and whole sampling times between them.

    A channel that drifts keeps its own times as long as its steps are sampling times within 1 %.
    """
    time = anchor.time(anchor.stamp(0))
    _check_span(anchor, time, Ts)
    index = np.round(time / Ts)
    tolerance = _tolerance(Ts)
    if (np.abs(time - index * Ts) <= tolerance).all() and (np.diff(index) > 0).all():
        return np.asarray(Ts * np.arange(int(index[-1]) + 1), dtype=float)
    counts = np.round(np.diff(time) / Ts)
    if (counts > 0).all() and (np.abs(np.diff(time) - counts * Ts) <= tolerance * counts).all():
        own = np.concatenate([[0.0], np.cumsum(counts)])
        return np.asarray(np.interp(np.arange(int(own[-1]) + 1), own, time), dtype=float)
    return np.asarray(Ts * np.arange(int(np.floor((time[-1] + tolerance) / Ts)) + 1), dtype=float)


def most_samples(readings: int) -> int:
    """Samples that a grid may have: a stamp far from all others would make one of nothing but lost samples."""
    return 1000 * readings + 1_000_000


def _check_span(one: Series, time: Array, Ts: float) -> None:
    if time.size and time[-1] / Ts > most_samples(time.size):
        i = int(np.argmax(np.diff(time))) + 1
        raise ValueError(
            f"{one.place(i)}: time jumps from {time[i - 1]:.9g} s to {time[i]:.9g} s after the first reading, which "
            f"would be {(time[i] - time[i - 1]) / Ts:.3g} lost samples; is that stamp right, and its unit?"
        )


def check_unit(anchor: Series, Ts: float, rule: Times, every: int = 1) -> None:
    """Raise a ValueError if the steps of a channel are the sampling time in another unit than the stated one.

    One of ``every`` so many readings is on the grid.
    """
    steps = np.diff(anchor.time(anchor.stamp(0)))
    if not steps.size:
        return
    step = float(np.median(steps))
    if _fits(step, Ts) or _fits(step * every, Ts):
        return
    if rule.format == "duration" and _fits(60 * step, Ts):
        _check_hours(anchor, rule)
    if rule.format is not None or rule.step is not None:
        return  # the unit is not in question
    stated = rule.unit or "s"
    raw = step / seconds(UNITS[stated]) / rule.scale
    fits = [f'unit = "{name}"' for name, pico in UNITS.items() if _fits(raw * seconds(pico), Ts)]
    fits += [
        f'unit = "{name}" and scale = 1e{power}'
        for name in ("day", "s")
        for power in (-6, -3, 3, 6)
        if _fits(raw * seconds(UNITS[name]) * 10.0**power, Ts)
    ]
    if fits:
        raise ValueError(
            f"{anchor.block.source.source}, {anchor.block.called}: the median step is {raw:.6g}, read as "
            f"{stated}; the sampling time is {Ts:g} s. It fits {' or '.join(fits[:2])} in [log.time]"
        )


def _check_hours(anchor: Series, rule: Times) -> None:
    """10:15 is read as minutes and seconds; raise a ValueError if hours and minutes would fit."""
    text = str(anchor.block.source.column(rule.columns[0])[anchor.block.rows[0]])
    if re.fullmatch(r"\d{1,2}:\d\d", text):
        raise ValueError(
            f"{anchor.place(0)}: {text!r} is read as minutes and seconds; as hours and minutes its steps are the "
            'sampling time: state format = "%H:%M" in [log.time]'
        )


def place_output(series: Series, rule: Channel, grid: Array, origin: int, Ts: float) -> Placed:
    """The readings of a sensor on the grid.

    Raises
    ------
    ValueError
        If the channel is faster than the grid and does not say so.
    """
    time = series.time(origin)
    inside = (time >= grid[0] - Ts / 2) & (time <= grid[-1] + Ts / 2)
    nearest, away, on = _against(time, grid, Ts)
    off = inside & ~on
    values = np.full(grid.size, np.nan)
    values[nearest[on]] = series.values[on]
    _check_rate(series, rule, time, off, Ts)
    if rule.rate is None or not off.any():
        return Placed(values, left_out=int(off.sum()))
    best = np.flatnonzero(off)[np.argsort(-away[off], kind="stable")]  # the nearest one is written last
    best = best[np.isnan(values[nearest[best]])]
    values[nearest[best]] = series.values[best]
    # A later one that is nearer overwrites: only what stands there counts.
    moved = _moved(nearest[best], away[best])
    return Placed(values, moved, rule.rate * moved, int(off.sum()) - np.unique(nearest[best]).size)


def place_input(series: Series, rule: Channel, grid: Array, origin: int, Ts: float) -> Placed:
    """An input on the grid; NaN where it is not known.

    Raises
    ------
    ValueError
        If it changes between samples.
    """
    time = series.time(origin)
    nearest, _, on = _against(time, grid, Ts)
    inside = (time > grid[0]) & (time < grid[-1])
    _check_rate(series, rule, time, ~on, Ts)
    changes = np.concatenate([[False], np.diff(series.values) != 0])
    between = np.flatnonzero(changes & ~on & inside)
    if between.size and rule.every == 1:
        raise _changes_between(series, time, int(between[0]), grid, Ts, len(between))
    values = np.full(grid.size, np.nan)
    values[nearest[on]] = series.values[on]
    for k in np.flatnonzero(np.isnan(values)):
        after = int(np.searchsorted(time, grid[k]))
        close = 0 < after < time.size and time[after] - time[after - 1] < 2 * Ts * (1 - TIME_TOLERANCE)
        if after and (rule.hold or (close and series.values[after] == series.values[after - 1])):
            values[k] = series.values[after - 1]
    return Placed(values, left_out=int((~on & inside).sum()))


def _changes_between(series: Series, time: Array, i: int, grid: Array, Ts: float, count: int) -> ValueError:
    away = abs(time[i] - grid[_nearest(time[i : i + 1], grid)[0]])
    return ValueError(
        f"{series.place(i)}: input {series.name} changes at {time[i]:.9g} s, {away:.3g} s off the samples of {Ts:g} s "
        f"({count} such changes). An input is never moved in time: a model of discrete time takes inputs that change "
        "at its samples. If it does, and only its stamps are late, state its times, "
        f"[log.columns.{series.name}] time = {{ start = {_start(series)}, step = {Ts:g} }}"
    )


def _start(series: Series) -> str:
    """The time of the first row as a description states it."""
    first = series.block.time[0]
    if not series.block.is_date:
        return f"{seconds(first):.15g}"
    return moment(first).replace(" ", "T") + ("" if series.block.is_local else "Z")


def _check_rate(series: Series, rule: Channel, time: Array, off: np.ndarray, Ts: float) -> None:
    """A channel that is faster than the grid says so, and by how much."""
    if time.size < 2:
        return
    step = float(np.median(np.diff(time)))
    if rule.every > 1 and not abs(step * rule.every - Ts) <= 0.25 * Ts:
        raise ValueError(
            f"{series.place(0)}: every = {rule.every}, but readings come each {step:.6g} s and the sampling time is "
            f"{Ts:g} s; expected every = {max(1, round(Ts / step))}"
        )
    if rule.every == 1 and rule.rate is None and off.any() and step < _FASTER * Ts:
        i = int(np.flatnonzero(off)[0])
        raise ValueError(
            f"{series.place(i)}: the reading of {time[i]:.9g} s is between the samples of {Ts:g} s, as "
            f"{int(off.sum())} are: {series.name} comes each {step:.6g} s. State every = {max(2, round(Ts / step))} in "
            f"[log.columns.{series.name}] if the readings between are to be left out"
        )


def _against(time: Array, grid: Array, Ts: float) -> tuple[np.ndarray, Array, np.ndarray]:
    """The sample that is nearest to each time, how far away it is, and which times are on it: one a sample."""
    nearest = _nearest(time, grid)
    away = np.abs(time - grid[nearest])
    on = away <= _tolerance(Ts)
    order = np.lexsort((away, nearest))
    again = order[1:][nearest[order][1:] == nearest[order][:-1]]
    on[again] = False
    return nearest, away, on


def _nearest(time: Array, grid: Array) -> np.ndarray:
    after = np.clip(np.searchsorted(grid, time), 1, max(grid.size - 1, 1))
    if grid.size == 1:
        return np.zeros(time.size, dtype=int)
    return np.where(time - grid[after - 1] <= grid[after] - time, after - 1, after)


def _moved(where: np.ndarray, away: Array) -> float:
    """The longest way of those that are kept: the nearest reading of each sample."""
    if not where.size:
        return 0.0
    least: dict[int, float] = {}
    for k, distance in zip(where.tolist(), away.tolist(), strict=True):
        least[k] = min(distance, least.get(k, distance))
    return max(least.values())


def _tolerance(Ts: float) -> float:
    return TIME_TOLERANCE * Ts * (1 + _ROUNDING)


def _fits(step: float, Ts: float) -> bool:
    return abs(step - Ts) <= _FITS * Ts
