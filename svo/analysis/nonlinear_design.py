"""Inputs for nonlinear models: candidates from linear ones along a trajectory, accepted by a proof in tubes only."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.analysis.distinguish import Distinguishability, distinguishability
from svo.analysis.tube import with_free_inputs
from svo.checks import Array
from svo.models.nonlinear import NonlinearModel

_ROUNDS = 4  # of linear designs, each about the one before, and asked for more
_MORE = 4.0  # times the margin of the round before
_NEAR = 0.05  # of the range of an input: over which its slope is taken

Checks = tuple[Distinguishability, ...]


@dataclass(frozen=True)
class Models:
    """A plant, and the models that it is to falsify, with their sets of first states."""

    plant: Any
    observers: Sequence[Any]
    initial: HPolytope
    sets: Sequence[HPolytope]
    schedule: Any

    @property
    def are_linear(self) -> bool:
        return not any(isinstance(model, NonlinearModel) for model in (self.plant, *self.observers))

    def checked(self, u: Array) -> Checks:
        """What is proven of inputs (N, nu) against each observer's model."""
        return tuple(
            distinguishability(
                self.plant, model, len(u), initial=self.initial, observer_initial=start, u=u, schedule=self.schedule
            )
            for model, start in zip(self.observers, self.sets, strict=True)
        )

    def near(self, u: Array, limits: tuple[Array, Array]) -> Models | None:
        """Linear models of inputs near a sequence (N, nu); None where it is not enclosed to its end."""
        reach = np.maximum(_NEAR * (limits[1] - limits[0]).max(axis=0), 1e-9)
        linear = []
        starts = (self.initial, *self.sets)
        for model, start in zip((self.plant, *self.observers), starts, strict=True):
            if not isinstance(model, NonlinearModel):
                linear.append(model if self.schedule is None else model.along(np.asarray(self.schedule)[: len(u)]))
                continue
            tube = with_free_inputs("initial", model, start, u, reach)
            if tube.samples < len(u):
                return None
            linear.append(tube.model)
        plant, *observers = linear
        return Models(plant, observers, self.initial, self.sets, np.arange(float(len(u))))


def candidates(
    models: Models, reference: Array, limits: tuple[Array, Array], margin: float, design: Callable[..., Array | None],
    waves: Sequence[NDArray[np.bool_]],
) -> Iterator[Array]:
    """Inputs to be checked: designs about the reference, then about the one before, then those at the limits.

    ``design`` gives inputs for linear models and a margin; ``waves`` are (N,) booleans, where an input is up.
    """  # fmt: skip
    u = reference
    for _ in range(_ROUNDS):
        linear = models.near(u, limits)
        found = None if linear is None else design(linear, margin)
        if found is None:
            break
        yield found
        u, margin = found, margin * _MORE
    for wave in waves:
        yield np.where(wave[:, None], limits[1], limits[0])


def separating(models: Models, every: Iterator[Array]) -> tuple[Array | None, float, Checks]:
    """The first of some inputs that is proven to separate, its separation and what proves it; or the largest one."""
    largest = -np.inf
    for u in every:
        checks = models.checked(u)
        separation = min(check.separation for check in checks)
        if all(check.horizon is not None for check in checks):
            return u, separation, checks
        largest = max(largest, separation)
    return None, largest, ()
