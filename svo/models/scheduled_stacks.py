"""The stacks of some samples, as a table over the schedule and the scheduling values of the samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polytopes.shown import Shown
from svo.checks import Array
from svo.models.schedule_table import ScheduleTable


@dataclass(frozen=True, eq=False)
class ScheduledStacks(Shown):
    """Stacks of k samples by linear interpolation, rounded as `ScheduleTable` rounds.

    Attributes
    ----------
    points : (p,) array
        Increasing values of the schedule.
    stacks : (p, items, n + ny, n + nu + 1 + nw) array
        The stack at each of them.
    schedule : (k,) array
        Scheduling value of each sample.
    """

    points: Array
    stacks: Array
    schedule: Array

    def at_samples(self) -> Array:
        """The stacks (k, items, n + ny, n + nu + 1 + nw).

        Raises
        ------
        ValueError
            If the points are no two or more that increase, or numbers are not finite.
        """
        table = ScheduleTable(self.points, self.stacks)
        return np.array([table(float(value)) for value in self.schedule])

    @classmethod
    def of(cls, table: ScheduleTable, schedule: Array) -> ScheduledStacks:
        """That part of a table which the scheduling values of some samples need."""
        points = table.points
        first = int(np.clip(np.searchsorted(points, schedule.min(), side="right") - 1, 0, len(points) - 2))
        last = int(np.clip(np.searchsorted(points, schedule.max(), side="right"), first + 1, len(points) - 1))
        part = slice(first, last + 1)
        return cls(points[part].copy(), table.values[part].copy(), schedule)
