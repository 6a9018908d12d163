"""Scheduling on measured airspeed: the causal filter, and one table of all scheduled matrices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array, chosen
from svo.models import ScheduleTable

FILTER_TIME_S = 0.5


class AirspeedFilter:
    """First-order low-pass of 0.5 s on measured airspeed, called with each measurement in turn.

    It starts at the first measured airspeed. A missing (NaN) airspeed holds the last value; while none has
    been measured yet, the value is ``initial``.
    """

    def __init__(self, Ts: float, initial: float) -> None:
        self._gain = 1.0 - float(np.exp(-Ts / FILTER_TIME_S))
        self._value = float(initial)
        self._started = False

    def __call__(self, y: ArrayLike) -> float:
        """Scheduling airspeed [m/s] at the sample of y = [V, alpha, theta, q]."""
        airspeed = float(np.asarray(y, dtype=float)[0])
        if not np.isnan(airspeed):
            self._value += (self._gain if self._started else 1.0) * (airspeed - self._value)
            self._started = True
        return self._value

    def state_dict(self) -> dict[str, Array]:
        """Everything that the next samples depend on (`svo.plant.SavesSchedule`)."""
        return {"value": np.array(self._value), "started": np.array(float(self._started))}

    def load_state_dict(self, state: Mapping[str, Array]) -> None:
        """Go on from what `state_dict` gave."""
        self._value, self._started = float(state["value"]), bool(state["started"])


@dataclass(frozen=True)
class ScheduledBlocks:
    """Named arrays tabulated over airspeed and interpolated linearly, all at once.

    Outside the table its nearest end is used: the derivatives are valid from 25 to 55 m/s only, and the
    mismatch bounds promise nothing beyond.

    Parameters
    ----------
    start, step : float
        First airspeed and spacing of the table [m/s].
    tables : mapping of name to (points, ...) array
    """

    start: float
    step: float
    tables: Mapping[str, Array]
    _flat: ScheduleTable = field(init=False, repr=False)
    _layout: tuple[tuple[str, slice, tuple[int, ...]], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = {len(table) for table in self.tables.values()}
        if len(points) != 1 or (count := points.pop()) < 2:
            raise ValueError(f"tables have {[len(t) for t in self.tables.values()]} points; expected one count >= 2")
        layout, first = [], 0
        for name, table in self.tables.items():
            size = int(np.prod(table.shape[1:]))
            layout.append((name, slice(first, first + size), table.shape[1:]))
            first += size
        flat = np.hstack([np.asarray(table).reshape(len(table), -1) for table in self.tables.values()])
        object.__setattr__(self, "_flat", ScheduleTable(self.start + self.step * np.arange(count), flat))
        object.__setattr__(self, "_layout", tuple(layout))

    def at(self, schedule: Any) -> dict[str, Array]:
        """All blocks at one airspeed [m/s].

        Raises
        ------
        ValueError
            If the schedule is not a finite number.
        """
        row = self._flat(schedule)
        return {name: row[where].reshape(shape) for name, where, shape in self._layout}

    def over(self, schedule: ArrayLike) -> dict[str, Array]:
        """Blocks at many airspeeds (K,): name to (K, ...) array."""
        rows = self._flat.over(schedule)
        return {name: rows[:, where].reshape(len(rows), *shape) for name, where, shape in self._layout}

    def block(self, name: str) -> ScheduleTable:
        """One block as a function of the schedule."""
        return ScheduleTable(self._flat.points, chosen("name", name, self.tables))
