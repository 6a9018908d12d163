"""Shapes of a fault in time: abrupt, incipient, intermittent (Marzat et al. 2012, section 2.2).

A profile is the fraction of the fault's magnitude that is present at a time. Times are in seconds.
A sample that is meant to fall on an edge is taken as on it: sample times such as 57 * 0.01 differ
from the written 0.57 in the last digit, and the first faulty sample must not depend on that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes.shown import Shown
from svo.checks import Array, expect, expect_kind, finite_array, is_finite_number, positive_number, readings, real_array

EDGE_TOLERANCE_S = 1e-9


@runtime_checkable
class Profile(Protocol):
    """A shape in time: zero before ``start``, and in [0, 1] from then on."""

    @property
    def start(self) -> float:
        """Time of the first faulty sample [s]."""
        ...

    def value(self, t: ArrayLike) -> Array:
        """Fraction of the magnitude present at time t [s]; same shape as t, one value in [0, 1] each."""
        ...


@dataclass(frozen=True)
class Step(Shown):
    """Abrupt fault: 0 before ``start`` [s], 1 from it on."""

    start: float = 0.0

    def __post_init__(self) -> None:
        _check_finite("start", self.start)

    def value(self, t: ArrayLike) -> Array:
        """Fraction present at time t [s], of the shape of t."""
        return _started(_elapsed(t, self.start)).astype(float)


@dataclass(frozen=True)
class Ramp(Shown):
    """Incipient fault: grows linearly from 0 at ``start`` [s] to 1 after ``duration`` [s], then stays."""

    start: float
    duration: float

    def __post_init__(self) -> None:
        _check_finite("start", self.start)
        positive_number("duration", self.duration, "time in seconds")

    def value(self, t: ArrayLike) -> Array:
        """Fraction present at time t [s], of the shape of t."""
        return np.clip(_elapsed(t, self.start) / self.duration, 0.0, 1.0)


@dataclass(frozen=True)
class Exponential(Shown):
    """Incipient fault: 1 - exp(-(t - start) / time_constant), both in seconds."""

    start: float
    time_constant: float

    def __post_init__(self) -> None:
        _check_finite("start", self.start)
        positive_number("time_constant", self.time_constant, "time in seconds")

    def value(self, t: ArrayLike) -> Array:
        """Fraction present at time t [s], of the shape of t."""
        return -np.expm1(-np.maximum(_elapsed(t, self.start), 0.0) / self.time_constant)


@dataclass(frozen=True)
class Intermittent(Shown):
    """On for the first ``duty`` (0 < duty < 1) of every ``period`` [s] from ``start`` [s] on, off otherwise."""

    start: float
    period: float
    duty: float = 0.5

    def __post_init__(self) -> None:
        _check_finite("start", self.start)
        positive_number("period", self.period, "time in seconds")
        expect(0 < self.duty < 1, "duty", self.duty, "a fraction of the period strictly between 0 and 1")

    def value(self, t: ArrayLike) -> Array:
        """Fraction present at time t [s], of the shape of t."""
        elapsed = _elapsed(t, self.start)
        phase = np.mod(elapsed + EDGE_TOLERANCE_S, self.period)
        return (_started(elapsed) & (phase < self.duty * self.period)).astype(float)


def _elapsed(t: ArrayLike, start: float) -> Array:
    return finite_array("t", t) - start


def _started(elapsed: Array) -> NDArray[np.bool_]:
    return np.asarray(elapsed >= -EDGE_TOLERANCE_S)


def at_times(name: str, t: ArrayLike, values: ArrayLike) -> Array:
    """A copy of a vector a time: (channels,) at one time, (K, channels) at K times."""
    array = readings(name, values) if name == "y" else real_array(name, values)
    times = finite_array("t", t).shape
    if array.ndim != len(times) + 1 or array.shape[:-1] != times:
        expected = "(channels,)" if not times else f"({', '.join(map(str, times))}, channels)"
        raise ValueError(f"{name} has shape {array.shape}; expected {expected} for t of shape {times}")
    return array


def check_profile(profile: Any) -> None:
    """Refuse what has no ``start`` and ``value``."""
    expect_kind("profile", profile, Profile, "a Profile, such as Step(1.0)")


def _check_finite(name: str, value: float) -> None:
    expect(is_finite_number(value), name, value, "a finite time in seconds")
