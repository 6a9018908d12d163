"""What a polytope observer answers at a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.models import NormalForm, set_in
from svo.observers.answers import Step


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
        lower, upper = self._joint.bounding_box()
        return lower[: self.n] * self._form.x, upper[: self.n] * self._form.x

    def _support(self, rows: Array) -> Array:
        of_disturbances = np.zeros((len(rows), self._joint.dim - self.n))
        return np.asarray(self._joint.support(np.hstack([rows * self._form.x, of_disturbances])))
