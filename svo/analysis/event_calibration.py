"""A linear plant in continuous time whose log keeps its own times, as the equations that a calibration takes there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.models.intervals import has_own_intervals
from svo.models.nonlinear import NonlinearModel
from svo.models.origin import Origin
from svo.observers.window.observer import WindowObserver

_LARGEST = 1e9  # times what the log and its plant have in numbers: a set of a linear plant starts again from there
_ROOM, _MOST_ROOMS = 1.002, 20  # times the widenings, while rounding alone still falsifies the discrete model


@dataclass(frozen=True)
class ContinuousPlant:
    """The plant of a model that `UncertainModel.from_continuous` made."""

    origin: Origin
    names: Mapping[str, Any]

    @classmethod
    def of(cls, model: UncertainModel) -> ContinuousPlant:
        """ValueError unless its transitions may take any time, and it has neither a Delta nor a polytope of w."""
        origin = model.origin
        if origin is None or not has_own_intervals(model):
            raise ValueError(
                "the log keeps its own times (Log.events), and the model is in discrete time; expected one by "
                "UncertainModel.from_continuous, or a NonlinearModel"
            )
        if origin.plant.uncertainties or origin.plant.disturbance_polytope is not None:
            raise ValueError(
                "the log keeps its own times (Log.events), and the model has a Delta or a polytope of disturbances; "
                "expected bounds of noise and of single disturbances, or a NonlinearModel with parameters"
            )
        return cls(origin, model.names or {})

    def equations(self, log: Log) -> NonlinearModel:
        """dx/dt and y as functions, with the names that the model's bounds have."""
        plant = self.origin.plant
        A, B, a, E, C, D, c, F = (plant.block(name) for name in ("A", "B", "a", "E", "C", "D", "c", "F"))
        size = 1.0 + max(np.abs(v[~np.isnan(v)]).max(initial=0.0) for v in (log.u, log.y))
        far: Array = np.full(plant.n_states, _LARGEST * size)
        lower, upper, noise = plant.bounds(plant.schedule)
        return NonlinearModel(
            lambda x, u, w: A @ x + B @ u + a + E @ w, lambda x, u, w: C @ x + D @ u + c + F @ w,
            states=[f"state {i}" for i in range(plant.n_states)], inputs=[f"input {i}" for i in range(plant.n_inputs)],
            outputs=self._called("outputs", "y", plant.n_outputs),
            disturbances=self._called("disturbances", "w", plant.n_disturbances), Ts=plant.Ts, n=noise,
            w=(lower, upper), varying="w" if plant.n_disturbances and self.origin.varying else (), largest=(-far, far),
        )  # fmt: skip

    def widened(self, amounts: Mapping[str, float], log: Log, initial: HPolytope) -> UncertainModel:
        """The model with these bounds as wide, and a little more where its own matrices ask for it.

        Raises
        ------
        RuntimeError
            If it is still falsified.
        """
        plant = self.origin.plant
        lower, upper, noise = plant.bounds(plant.schedule)
        by = lambda kind, names: np.array([amounts.get(f"{kind} {name}", 0.0) for name in names])  # noqa: E731
        n = by("noise", self._called("outputs", "y", plant.n_outputs))
        w = by("disturbance", self._called("disturbances", "w", plant.n_disturbances))
        for k in range(_MOST_ROOMS):
            room = _ROOM**k
            wider = plant.replace(n=noise + room * n, w=(lower - room * w, upper + room * w) if w.size else None)
            model: UncertainModel = replace(self.origin, plant=wider).model()
            if "falsified" not in WindowObserver(model, initial).run(log).verdicts:
                return model
        raise RuntimeError("the widened model is still falsified by the log; let bounds contain more")

    def _called(self, what: str, letter: str, count: int) -> tuple[str, ...]:
        """Names of some of the plant's signals, or what stands in for them."""
        given = (self.names.get(what) or ())[:count]
        return tuple(given) or tuple(f"{letter}[{i}]" for i in range(count))
