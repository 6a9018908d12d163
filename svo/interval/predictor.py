"""Interval prediction of an uncertain first-order system (paper 001, Proposition 3, corrected)::

    x+ = g x + (1 - g) h u,   g in gc +- gr,   h in hc +- hr, both free to change at each sample
    xc+ = gc xc + (1 - gc) hc u                                                                       (14)
    xr+ = (|gc| + gr) xr + gr |xc - hc u| + (|1 - gc| + gr) hr |u|                                    (15)

Printed, (15) has ``gc |xc - hc u|`` and u without its absolute value: the first is some thirty times too wide, the
second loses the state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, expect_shape, is_finite_number, real_number
from svo.interval import kernel
from svo.interval.bounds import GainBounds, GainLaw
from svo.interval.residual import dead_zone
from svo.logs.log import Log


class Interval(NamedTuple):
    """All numbers in center +- radius."""

    center: float
    radius: float

    @property
    def lower(self) -> float:
        return self.center - self.radius

    @property
    def upper(self) -> float:
        return self.center + self.radius


@dataclass(frozen=True, eq=False)
class IntervalPrediction(Shown):
    """A prediction over a log of K samples, row k about the state at ``time[k]``.

    Attributes
    ----------
    time, u, y : (K,) arrays
        The log's own; y is NaN where the measurement is missing.
    center, radius : (K,) arrays
        The state lies in center +- radius while the plant keeps to the bounds of g and h.
    gc, gr, hc, hr : (K,) arrays
        Bounds used for the transition from sample k to k + 1 (that of the last sample is not made).
    """

    time: Array
    u: Array
    y: Array
    center: Array
    radius: Array
    gc: Array
    gr: Array
    hc: Array
    hr: Array

    def __len__(self) -> int:
        return int(self.time.size)

    @property
    def lower(self) -> Array:
        return self.center - self.radius

    @property
    def upper(self) -> Array:
        return self.center + self.radius

    @property
    def residual(self) -> Array:
        """What of y the prediction cannot explain (18), (K,); NaN where the measurement is missing."""
        return dead_zone(self.y, self.lower, self.upper)


class IntervalPredictor(Shown):
    """Interval predictor of one state; it uses inputs only, measurements at most to choose the bounds.

    Parameters
    ----------
    gains : GainBounds or function of (u, y, schedule)
        Bounds of g and h: constant, given for each sample of a record, or a `GainLaw`.
    initial : (center, radius)
        Interval of the state at the first sample.

    Raises
    ------
    TypeError
        If ``gains`` is neither, or gives something else than a `GainBounds`.
    ValueError
        For an initial radius that is negative, or numbers that are not finite.

    Notes
    -----
    Guaranteed, rounding included: while every g and h is inside its bounds, the state is inside the interval.
    """

    def __init__(self, gains: GainBounds | GainLaw, initial: tuple[float, float]) -> None:
        if not isinstance(gains, GainBounds) and not callable(gains):
            raise TypeError(f"gains is {type(gains).__name__}; expected GainBounds or a function (u, y, schedule)")
        self.gains = gains
        self.reset(*initial)

    @property
    def interval(self) -> Interval:
        """Where the state is at the present sample."""
        return self._interval

    @property
    def sample(self) -> int:
        """Transitions made since the start."""
        return self._sample

    def reset(self, center: float, radius: float) -> None:
        """Start again: the state at the first sample is in center +- radius."""
        self._initial = self._interval = _checked_interval(center, radius)
        self._sample = 0

    def resume(self, center: float, radius: float, sample: int) -> None:
        """Go on at a sample at which the state is in center +- radius."""
        self._interval = _checked_interval(center, radius)
        self._sample = sample

    def step(self, u: float, y: float | None = None, schedule: Any = None) -> Interval:
        """The transition from sample k to k + 1.

        Parameters
        ----------
        u, y, schedule
            Input, measurement and scheduling value of sample k. ``y`` and ``schedule`` are needed where the bounds
            depend on them.

        Returns
        -------
        Interval
            Of the state at k + 1.

        Raises
        ------
        ValueError
            If u is not finite, or the stability condition (17) fails. The predictor is unchanged.
        """
        self._advance(u, y, schedule)
        return self._interval

    def transition(self, u: float, y: float | None = None, schedule: Any = None) -> tuple[Interval, GainBounds]:
        """As `step` of u, y and schedule, and also the bounds of g and h that were used, the radius of g worked out."""
        gains, used = self._advance(u, y, schedule)
        return self._interval, GainBounds(gains.gc, used, hc=gains.hc, hr=gains.hr)

    def _advance(self, u: float, y: float | None, schedule: Any) -> tuple[GainBounds, float]:
        if not isinstance(u, float):
            u = real_number(f"u at sample {self._sample}", u)
        if not -np.inf < u < np.inf:
            raise ValueError(f"u is {u} at sample {self._sample}; expected a finite number")
        gains = self.gains if isinstance(self.gains, GainBounds) else self._bounds(u, y, schedule)
        if gains.samples is not None:
            gains = gains.at(self._sample)
        center, radius, used = kernel.move(
            *self._interval, u, gains.gc, gains.gr, gains.hc, gains.hr, gains.slope, gains.limit
        )
        if not abs(float(gains.gc)) + used < 1.0:
            raise ValueError(_unstable(self._sample, float(gains.gc), used))
        self._interval = Interval(center, radius)
        self._sample += 1
        return gains, used

    @options_by_name
    def predict(self, log: Log, *, initial: tuple[float, float] | None = None) -> IntervalPrediction:
        """The prediction over a log with one input and one output; `step` and its sample are left alone.

        Parameters
        ----------
        log : Log
        initial : (center, radius), optional
            Interval of the state at the log's first sample; that of the predictor by default.

        Raises
        ------
        ValueError
            For a log with other channels, inputs that are not finite, or a sample where (17) fails.
        """
        u, y = _channel(log, "u"), _channel(log, "y")
        wrong = np.flatnonzero(~np.isfinite(u))
        if wrong.size:
            raise ValueError(f"u is {u[wrong[0]]} at sample {wrong[0]}; expected finite numbers")
        start = self._initial if initial is None else _checked_interval(*initial)
        gains = self.gains
        if not isinstance(gains, GainBounds):
            gains = self._bounds(u, held(y, start.center), log.schedule)
        gc, gr, hc, hr, slope, limit = gains.over(len(log))
        center, radius, used = np.empty(u.size), np.empty(u.size), np.empty(u.size)
        center[:1], radius[:1] = start
        failed = kernel.propagate(u, gc, gr, hc, hr, slope, limit, center, radius, used)
        if failed >= 0:
            raise ValueError(_unstable(failed, gc[failed], used[failed]))
        return IntervalPrediction(log.time, u, y, center, radius, gc, used, hc, hr)

    def _bounds(self, u: Any, y: Any, schedule: Any) -> GainBounds:
        assert callable(self.gains)
        bounds = self.gains(u, y, schedule)
        if not isinstance(bounds, GainBounds):
            raise TypeError(f"gains gave {type(bounds).__name__} at sample {self._sample}; expected GainBounds")
        return bounds


def held(y: Array, first: float) -> Array:
    """Measurements (K,) with each missing one replaced by the last there was, or by ``first``."""
    known = ~np.isnan(y)
    if known.all():
        return y
    last = np.maximum.accumulate(np.where(known, np.arange(y.size), -1))
    return np.where(last >= 0, y[last], first)


def _channel(log: Log, name: str) -> Array:
    values: Array = getattr(log, name)
    expect_shape(values.shape[1] == 1, f"{name} of the log", values, f"({len(log)}, 1), one channel")
    return np.ascontiguousarray(values[:, 0])


def _checked_interval(center: float, radius: float) -> Interval:
    if not (is_finite_number(center) and is_finite_number(radius) and radius >= 0):
        raise ValueError(f"the initial interval is {center} +- {radius}; expected finite numbers and a radius >= 0")
    return Interval(float(center), float(radius))


def _unstable(sample: int, gc: float, gr: float) -> str:
    return (
        f"the bounds of g at sample {sample} are {gc:g} +- {gr:g}, so |gc| + gr = {abs(gc) + gr:g}; expected less than "
        "1 (17), else the interval grows without end: lower gr or give it a limit"
    )
