"""The small models that observers are asked about, and runs of them on the edge of every bound.

All numbers but those of `RICH`, which has no exact sets, are short binary fractions, so that runs are exact in floats.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.logs.log import Log
from svo.models import UncertainModel, Uncertainty
from svo.testing.exact_states import Point, exact_states


@dataclass(frozen=True)
class System:
    """A model with the bounds of its first state.

    Attributes
    ----------
    name : str
        What it has that others do not.
    model : UncertainModel
    first : tuple of (lower, upper)
        One pair a state.
    """

    name: str
    model: UncertainModel
    first: tuple[tuple[float, float], ...]

    @property
    def initial(self) -> HPolytope:
        lower, upper = np.array(self.first).T
        return HPolytope.box(lower, upper)

    def states(self, log: Log) -> list[tuple[Point, ...]]:
        """Vertices of every state that the model and the data allow, sample by sample."""
        return _states(self, log.u.tobytes(), log.y.tobytes())

    @cache  # noqa: B019 - a few systems that live as long as the module
    def scaled(self, unit: float) -> System:
        """The same system with every quantity in a unit that is ``1 / unit`` of the given one (a power of two)."""
        model, keep = self.model, {"a": _times(self.model.a, unit), "c": _times(self.model.c, unit)}
        lower, upper, noise = model.bounds()
        scaled = model.replace(w=(unit * lower, unit * upper), n=unit * noise, **keep)
        return System(self.name, scaled, tuple((unit * low, unit * high) for low, high in self.first))

    def edge(self, u: Any, seed: int) -> Log:
        """A run with every unknown at an end of its bounds, the first state at a corner; a schedule is a sine."""
        rng = np.random.default_rng(seed)
        start = [ends[rng.integers(2)] for ends in self.first]
        schedule = np.sin(0.3 * np.arange(len(u))) if self.model.is_scheduled else None
        return self.model.simulate(start, u, rng, corners=True, schedule=schedule)

    def calm(self, u: Any, seed: int) -> Log:
        """A run with every unknown half as large as that: only what is wrong by more than rounding excludes it."""
        lower, upper, noise = self.model.bounds()
        halves = [replace(q, bounds=(q.bounds[0] / 2, q.bounds[1] / 2)) for q in self.model.uncertainties]
        model = self.model.replace(w=(lower / 2, upper / 2), n=noise / 2, uncertainties=halves)
        return replace(self, model=model, first=tuple((low / 2, high / 2) for low, high in self.first)).edge(u, seed)


@cache
def _states(system: System, u: bytes, y: bytes) -> list[tuple[Point, ...]]:
    inputs, readings = np.frombuffer(u), np.frombuffer(y)
    columns = system.model.n_inputs, system.model.n_outputs
    given = (data.reshape(-1, width) for data, width in zip((inputs, readings), columns, strict=True))
    return exact_states(system.model, system.first, *given)


def _times(value: Any, unit: float) -> Array | None:
    return None if value is None else unit * np.asarray(value)


def _system(name: str, first: Any, A: Any, C: Any, **rest: Any) -> System:
    model = UncertainModel(A, rest.pop("B", np.ones((len(A), 1))), C, Ts=1.0, **rest)
    return System(name, model, tuple(first))


PLAIN = _system("one state", [(-1.0, 1.0)], [[0.5]], [[1.0]], E=[[1.0]], w=[0.25], n=[0.5])
UNSEEN = _system(
    "a state that no sensor sees", [(-1.0, 1.0), (-2.0, 1.0)], [[0.5, 0.0], [0.0, 0.75]], [[1.0, 0.0]],
    E=np.eye(2), w=[0.25, 0.125], n=[0.5],
)  # fmt: skip
TURNING = _system(
    "two states that mix", [(-1.0, 1.0), (-1.0, 2.0)], [[0.5, -0.5], [0.25, 0.75]], [[1.0, 1.0]],
    B=[[1.0], [0.0]], E=[[0.0], [1.0]], w=[0.25], n=[0.5], a=[0.25, 0.0],
)  # fmt: skip
TWO_SENSORS = _system(
    "two sensors", [(-1.0, 1.0)], [[0.5]], [[1.0], [2.0]], E=[[1.0]], w=[0.25], n=[0.5, 0.75], c=[0.0, 0.5]
)
FEEDTHROUGH = _system("feedthrough", [(-1.0, 1.0)], [[0.5]], [[1.0]], D=[[2.0]], E=[[1.0]], w=[0.25], n=[0.5])
UNCERTAIN_GAIN = _system(
    "an uncertain input gain", [(-1.0, 1.0), (-1.0, 1.0)], [[0.5, 0.25], [0.0, 0.5]], [[1.0, 0.0]],
    E=[[0.0], [1.0]], w=[0.25], n=[0.5], uncertainties=[Uncertainty(B=[[0.0], [0.5]], bounds=(-1.0, 1.0))],
)  # fmt: skip
UNCERTAIN_POLE = _system(
    "an uncertain pole", [(-1.0, 1.0)], [[0.5]], [[1.0]],
    E=[[1.0]], w=[0.25], n=[0.5], uncertainties=[Uncertainty(A=[[0.25]], bounds=(-1.0, 1.0))],
)  # fmt: skip
EXACT_SENSOR = _system(
    "an exact sensor", [(-1.0, 1.0), (-1.0, 1.0)], [[0.5, 0.25], [0.0, 0.5]], [[1.0, 0.0]],
    E=[[0.0], [1.0]], w=[0.25], n=[0.0],
)  # fmt: skip

EXACT: Mapping[str, System] = MappingProxyType(
    {
        system.name: system
        for system in (
            PLAIN, UNSEEN, TURNING, TWO_SENSORS, FEEDTHROUGH, UNCERTAIN_GAIN, UNCERTAIN_POLE, EXACT_SENSOR,
        )
    }
)  # fmt: skip

UNSTABLE = _system("an unstable pole", [(-1.0, 1.0)], [[1024.0]], [[1.0]], E=[[1.0]], w=[0.25], n=[0.5])
TWO_EXACT_SENSORS = _system(
    "two exact sensors of one state", [(-1.0, 1.0)], [[0.5]], [[1.0], [1.0]], E=[[1.0]], w=[16.0], n=[0.0, 0.0]
)


def _rich(name: str, first: Any = ((-1.0, 1.0), (-1.0, 1.0)), **changes: Any) -> System:
    given: dict[str, Any] = {
        "A": [[1.0, 0.1], [0.0, 0.95]], "B": [[0.005], [0.1]], "C": [[1.0, 0.0]],
        "E": [[0.005], [0.1]], "w": [0.2], "n": [0.05], "Ts": 0.1,
    }  # fmt: skip
    return System(name, UncertainModel(**given | changes), first)


RICH = (
    _rich("several uncertainties", uncertainties=[
        Uncertainty(A=[[0.0, 0.0], [0.0, 0.05]], B=[[0.0], [0.02]], bounds=(-1.0, 1.0)),
        Uncertainty(B=[[0.0], [0.03]], bounds=(0.0, 1.0)),
    ]),
    _rich("an uncertain output", uncertainties=[Uncertainty(C=[[0.05, 0.0]], bounds=(-1.0, 1.0))]),
    _rich("a schedule", A=lambda s: np.array([[1.0, 0.1], [0.0, 0.9 + 0.05 * s]]), schedule=0.0),
    _rich("the disturbance in the output", F=[[0.3]]),
    _rich("a schedule of bounds and sensors", n=lambda s: [0.05 + 0.5 * s * s], C=lambda s: [[1.0, 0.5 * s]],
          B=lambda s: [[0.0], [0.1 + 0.3 * s]], w=(lambda s: [-0.5 - s * s], lambda s: [0.5 + s * s]), schedule=0.0),
    _rich("an uncertain constant", uncertainties=[Uncertainty(a=[0.0, 0.3]), Uncertainty(c=[0.3])]),
    _rich("an uncertain disturbance gain", uncertainties=[Uncertainty(E=[[0.0], [1.0]])]),
    _rich("an uncertain feedthrough", uncertainties=[Uncertainty(D=[[0.2]])]),
    _rich("an uncertain disturbance in the output", w=[1.0], uncertainties=[Uncertainty(F=[[0.5]])]),
    _rich("disturbances in a polytope", E=np.eye(2), w=HPolytope([[1, 1], [-1, 0], [0, -1]], [0.25, 0.125, 0.125])),
    _rich("several disturbances", E=np.eye(2), w=[0.02, 0.05], a=[0.01, 0.0], c=[0.2], D=[[0.1]]),
    _rich("first states on a line", first=((0.5, 0.5), (-1.0, 1.0))),
    _rich("three states", first=((-1.0, 1.0),) * 3, A=[[1.0, 0.1, 0.0], [0.0, 0.9, 0.1], [0.0, -0.1, 0.9]],
          B=[[0.0], [0.0], [0.1]], C=[[1.0, 0.0, 0.0]], E=[[0.0], [0.0], [0.1]]),
)  # fmt: skip
