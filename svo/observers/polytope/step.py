"""What a polytope observer answers at a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.models import NormalForm, set_in
from svo.observers.answers import Step
from svo.observers.polytope.vertex_images import outer_support
from svo.observers.readings import OUTGROWN


@dataclass(frozen=True, slots=True, eq=False)
class PolytopeStep(Step):
    """Answer of a `PolytopeObserver` at one sample."""

    _joint: HPolytope
    _form: NormalForm

    @property
    def n(self) -> int:
        return self._form.given.n_states

    @property
    def joint(self) -> HPolytope:
        """Contains the state at this sample and, behind it, w of the same sample where the output depends on it."""
        return set_in(self._joint, 1.0 / np.concatenate([self._form.x, self._form.w])[: self._joint.dim])

    def _set(self) -> HPolytope:
        states = self._joint if self._joint.dim == self.n else self._joint.project(range(self.n))
        return set_in(states, 1.0 / self._form.x)

    def _box(self) -> tuple[Array, Array]:
        unit = self._form.x
        if self.reason == OUTGROWN:
            lower, upper = self._joint.bounding_box()
            return lower * unit, upper * unit
        axes = np.eye(self.n, self._joint.dim)
        ends = outer_support(self._joint, np.vstack([axes, -axes]))
        return -ends[self.n :] * unit, ends[: self.n] * unit

    def _support(self, rows: Array) -> Array:
        normal = rows * self._form.x
        if self.reason == OUTGROWN:
            return np.asarray(self._joint.support(normal), dtype=np.float64)
        return outer_support(self._joint, np.hstack([normal, np.zeros((len(rows), self._joint.dim - self.n))]))
