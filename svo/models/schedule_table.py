"""An array that depends on a scalar schedule, tabulated and interpolated linearly."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes.shown import Shown
from svo.checks import Array, finite_array, floats, real_number


def values_over(value: Any, schedule: Array) -> Array:
    """An array, or a function of the schedule, at many samples (K, ...).

    A function that has a method ``over`` itself, as `ScheduleTable` has, is asked for all samples at once; others are
    called once a sample.
    """
    if not callable(value):
        array = floats("an array of the model", value)
        return np.broadcast_to(array, (len(schedule), *array.shape))
    if hasattr(value, "over"):
        return floats("an array over the schedule", value.over(schedule))
    return np.array([floats("an array at a schedule", value(float(at) if at.ndim == 0 else at)) for at in schedule])


class ScheduleTable(Shown):
    """A function of a scalar schedule by linear interpolation; usable wherever a model takes a function.

    A model whose scheduled arrays are all tables over the same points evaluates them together, with one
    interpolation of everything: about a fifth of the time of a function an array. Outside the points the nearest
    end is used.

    Parameters
    ----------
    points : (P,) array
        Increasing values of the schedule, P >= 2.
    values : (P, ...) array
        The array at each of them.

    Raises
    ------
    ValueError
        For points that do not increase, numbers that are not finite, or lengths that differ; when called, for a
        schedule that is not a finite number.
    """

    __slots__ = ("_knots", "_slopes", "points", "values")

    def __init__(self, points: ArrayLike, values: ArrayLike) -> None:
        self.points, self.values = finite_array("points", points), finite_array("values", values)
        if self.points.ndim != 1 or len(self.points) < 2 or not np.all(np.diff(self.points) > 0):
            raise ValueError(f"points has shape {self.points.shape}; expected at least two increasing numbers")
        if self.values.shape[:1] != self.points.shape:
            raise ValueError(f"values has shape {self.values.shape}; expected ({len(self.points)}, ...), one a point")
        self._knots: list[float] = self.points.tolist()
        steps = np.diff(self.points).reshape(-1, *[1] * (self.values.ndim - 1))
        self._slopes = np.diff(self.values, axis=0) / steps

    def __call__(self, schedule: Any) -> Array:
        """The array at one value of the schedule."""
        knots = self._knots
        at = schedule if isinstance(schedule, float) else real_number("schedule", schedule)
        if not math.isfinite(at):
            raise ValueError(f"schedule is {schedule!r}; expected a finite number")
        if at <= knots[0]:
            return self.values[0]
        if at >= knots[-1]:
            return self.values[-1]
        index = bisect_right(knots, at) - 1
        result: Array = self._slopes[index] * (at - knots[index])
        result += self.values[index]
        return result

    def over(self, schedule: ArrayLike) -> Array:
        """The array at many values (K,) of the schedule, (K, ...)."""
        at = np.clip(finite_array("schedule", schedule), self.points[0], self.points[-1])
        index = np.minimum(np.searchsorted(self.points, at, side="right") - 1, len(self.points) - 2)
        beyond = (at - self.points[index]).reshape(-1, *[1] * (self.values.ndim - 1))
        result: Array = self._slopes[index] * beyond + self.values[index]
        result[at == self.points[-1]] = self.values[-1]  # without rounding, as one value alone gives it
        return result

    def times(self, factor: Array) -> ScheduleTable:
        """The table of the array times a ``factor`` of its shape, entry by entry."""
        return ScheduleTable(self.points, self.values * factor)

    def has_points_of(self, other: ScheduleTable) -> bool:
        """Whether this table and the ``other`` are over the same points."""
        return self._knots == other._knots

    @classmethod
    def of(cls, function: Callable[..., ArrayLike], *arrays: ScheduleTable | Array) -> ScheduleTable:
        """The table of an affine function of arrays, those that are tables over the same points.

        Interpolation and the function commute only if it is affine in all of them together.
        """
        points = next(a.points for a in arrays if isinstance(a, ScheduleTable))
        rows = [
            function(*(a.values[p] if isinstance(a, ScheduleTable) else a for a in arrays)) for p in range(len(points))
        ]
        return cls(points, np.array(rows))
