"""What a constrained-zonotope observer answers at a sample."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from svo.checks import Array
from svo.models import NormalForm
from svo.models.state_range import within
from svo.observers.answers import Step
from svo.observers.given_units import zonotope_out
from svo.observers.zonotope.program import ZonotopeProgram
from svo.observers.zonotope.zonotope import ConstrainedZonotope


@dataclass(frozen=True, slots=True, eq=False)
class ZonotopeStep(Step):
    """Answer of a `ConstrainedZonotopeObserver` at one sample; its set is the box, see `joint` for the whole set.

    Box, set and support are cut to the range of states that the model promises.
    """

    _joint: ConstrainedZonotope | None
    _form: NormalForm
    _bounds: list[tuple[Array, Array]] = field(default_factory=list, repr=False)

    @property
    def n(self) -> int:
        return self._form.given.n_states

    @property
    def joint(self) -> ConstrainedZonotope | None:
        """Contains the state at this sample and, behind it, w and the channels where the output depends on them.

        None while the set is outgrown.
        """
        if self._joint is None:
            return None
        unit = np.concatenate([self._form.x, self._form.w, np.ones(self._joint.dim)])[: self._joint.dim]
        return zonotope_out(self._joint, unit)

    def _box(self) -> tuple[Array, Array]:
        if not self._bounds:
            axes = np.eye(self.n)
            ends = self._outer(np.vstack([axes, -axes]))
            self._bounds.append(within(self._form.given.physical_range, -ends[self.n :], ends[: self.n]))
        lower, upper = self._bounds[0]
        return lower.copy(), upper.copy()

    def _support(self, rows: Array) -> Array:
        values, physical = self._outer(rows), self._form.given.physical_range
        return values if physical is None else np.minimum(values, physical.support(rows))

    def _outer(self, rows: Array) -> Array:
        """Bounds of rows x over the zonotope."""
        if self._joint is None:
            return np.full(len(rows), np.inf)
        wide = np.hstack([rows * self._form.x, np.zeros((len(rows), self._joint.dim - self.n))])
        return ZonotopeProgram(self._joint).support(wide)
