"""Observers that fall when they are told to, for the tests of the banks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.isolation.bank import Bank
from svo.logs.log import Log


@dataclass
class FakeModel:
    n_states: int = 1
    n_inputs: int = 1
    n_outputs: int = 1
    Ts: float = 0.1


@dataclass
class FakeStep:
    verdict: str
    certificate: Any
    box: tuple[np.ndarray, np.ndarray]
    seconds: float = 1e-4

    @property
    def set(self) -> HPolytope:
        lower, upper = self.box
        return HPolytope.empty(1) if np.isnan(lower[0]) else HPolytope.box(lower, upper)


@dataclass
class FakeObserver:
    """Falls where y equals (one of) its poison, and stays falsified until reset; x moves by u; boxes are x +- 1."""

    poison: float | tuple[float, ...]
    model: FakeModel = field(default_factory=FakeModel)
    undecided_at: float = 1e9
    certified: bool = True
    calls: list[tuple[Any, ...]] = field(default_factory=list)
    centre: float = 0.0
    width: float = 1.0
    fallen: bool = False
    started: bool = False

    def update(self, y0: Any, u: Any = None, schedule: Any = None) -> FakeStep:
        assert not self.started, "a second update without a reset"
        self.started = True
        self.calls.append(("update", *y0, schedule))
        return self._answer(y0)

    def step(self, u: Any, y: Any, u_next: Any = None, schedule: Any = None) -> FakeStep:
        assert self.started
        self.calls.append(("step", *u, *y, schedule))
        self.centre += float(u[0])
        return self._answer(y)

    def reset(self, set: HPolytope) -> None:
        lower, upper = set.bounding_box()
        self.centre, self.width = float(lower[0] + upper[0]) / 2, float(upper[0] - lower[0]) / 2
        self.fallen, self.started = False, False
        self.calls.append(("reset", float(lower[0]), float(upper[0])))

    def warm_up(self) -> float:
        return 0.25

    def _answer(self, y: Any) -> FakeStep:
        self.fallen |= bool(np.isin(y[0], self.poison))
        if self.fallen:
            nan = np.array([np.nan])
            return FakeStep("falsified", ("proof", self.poison) if self.certified else None, (nan, nan))
        box = (np.array([self.centre - self.width]), np.array([self.centre + self.width]))
        return FakeStep("undecided" if y[0] == self.undecided_at else "consistent", None, box)


def fake(of: Bank, name: str) -> FakeObserver:
    observer = of.observers[name]
    assert isinstance(observer, FakeObserver)
    return observer


def log_of(*y: float) -> Log:
    return Log(time=np.arange(len(y)) * 0.1, u=np.ones((len(y), 1)), y=np.array(y)[:, None])
