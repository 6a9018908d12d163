"""The bounds of a model's disturbances and noise, at a sample or at many."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from svo.checks import Array, check_disturbance_box, check_noise, finite_array, floats
from svo.models.schedule_table import ScheduleTable, values_over


@dataclass(frozen=True, eq=False)
class Bounds:
    """Disturbances between ``lower`` and ``upper`` (nw,), noise within ``noise`` (ny,): arrays or functions.

    Three tables over the same points are one table, checked at its points; anything else is checked at each sample.
    """

    lower: Any
    upper: Any
    noise: Any
    nw: int
    ny: int
    scheduled: bool = field(init=False)
    table: ScheduleTable | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "scheduled", any(callable(edge) for edge in self.edges))
        object.__setattr__(self, "table", self._as_table())

    @property
    def edges(self) -> tuple[Any, Any, Any]:
        """Lower, upper and noise, each an array or a function of the schedule."""
        return self.lower, self.upper, self.noise

    def at(self, schedule: Any) -> tuple[Array, Array, Array]:
        """See `UncertainModel.bounds`."""
        if not self.scheduled:
            return self.edges
        if self.table is not None:
            return self._split(self.table(schedule))
        edges = zip("wwn", self.edges, strict=True)
        return self._checked(*(floats(name, e(schedule)) if callable(e) else e for name, e in edges))

    def over(self, schedule: ArrayLike) -> tuple[Array, Array, Array]:
        """See `UncertainModel.bounds_over`."""
        values = finite_array("schedule", schedule)
        if self.table is not None:
            return self._split(self.table.over(values))
        found = tuple(values_over(edge, values) for edge in self.edges)
        return self._checked_over(*found) if self.scheduled else found  # type: ignore[return-value]

    def _checked_over(self, lower: Array, upper: Array, noise: Array) -> tuple[Array, Array, Array]:
        """Many samples at once; one by one only to name the first that is wrong."""
        shapes = [array.shape[1:] for array in (lower, upper, noise)]
        right = shapes == [(self.nw,), (self.nw,), (self.ny,)] and all(
            test.all()
            for test in (np.isfinite(lower), np.isfinite(upper), lower <= upper, np.isfinite(noise), noise >= 0)
        )
        if not right:
            for sample in zip(lower, upper, noise, strict=True):
                self._checked(*sample)
        return lower, upper, noise

    def _checked(self, lower: Array, upper: Array, noise: Array) -> tuple[Array, Array, Array]:
        check_disturbance_box(lower, upper, self.nw)
        check_noise(noise, self.ny)
        return lower, upper, noise

    def _split(self, row: Array) -> tuple[Array, Array, Array]:
        """The parts of one row or of many; interpolation may round an interval of no width to one below that."""
        lower, upper, noise = row[..., : self.nw], row[..., self.nw : 2 * self.nw], row[..., 2 * self.nw :]
        return lower, np.maximum(lower, upper), np.maximum(noise, 0.0)

    def _as_table(self) -> ScheduleTable | None:
        tables = [edge for edge in self.edges if isinstance(edge, ScheduleTable)]
        functions = [edge for edge in self.edges if callable(edge)]
        if not tables or len(tables) < len(functions) or not all(t.has_points_of(tables[0]) for t in tables):
            return None
        points = tables[0].points
        parts = [e.values if isinstance(e, ScheduleTable) else values_over(e, points) for e in self.edges]
        return ScheduleTable(points, np.hstack(self._checked_over(*parts)))


def bounds_of(w: Any, n: Any, nw: int, ny: int) -> Bounds:
    """From the arguments w and n of `UncertainModel`.

    Raises
    ------
    ValueError
        For a missing, empty or unbounded w, wrong shapes, and bounds out of order or not finite.
    """
    return Bounds(*_disturbances(w, nw), _noise(n, ny), nw, ny)


def _disturbances(w: Any, nw: int) -> tuple[Any, Any]:
    if w is None:
        if nw:
            raise ValueError(
                f"w is missing: E or F has {nw} columns; give (lower, upper), a half-width ({nw},) or an HPolytope"
            )
        return np.zeros(0), np.zeros(0)
    if isinstance(w, HPolytope):
        return _box_of(w, nw)
    if isinstance(w, tuple) and len(w) == 2:
        lower, upper = (b if callable(b) else finite_array("w", b) for b in w)
    else:
        upper = finite_array("w", w)
        lower = -upper
    if not (callable(lower) or callable(upper)):
        lower, upper = (np.broadcast_to(b, (nw,)).copy() if b.ndim == 0 else b for b in (lower, upper))
        check_disturbance_box(lower, upper, nw)
    return lower, upper


def _box_of(w: HPolytope, nw: int) -> tuple[Array, Array]:
    if w.dim != nw:
        raise ValueError(f"w is a polytope of dimension {w.dim}; expected {nw}, the number of columns of E")
    if w.emptiness().status == "empty":
        raise ValueError("w is an empty polytope; expected a bounded set with a point")
    lower, upper = w.bounding_box()
    check_disturbance_box(lower, upper, nw)
    return lower, upper


def _noise(n: Any, ny: int) -> Any:
    if n is None:
        return np.zeros(ny)
    if callable(n):
        return n
    noise = finite_array("n", n)
    noise = np.full(ny, float(noise)) if noise.ndim == 0 else noise
    check_noise(noise, ny)
    return noise
