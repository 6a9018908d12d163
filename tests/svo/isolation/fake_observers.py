"""Observers that fall when they are told to, for the tests of the banks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo import Log, UncertainModel
from svo.isolation.bank import Bank
from svo.observers.base import Certificate, Observer, Step


def fake_model(n_states: int = 1, n_inputs: int = 1, n_outputs: int = 1, Ts: float = 0.1) -> UncertainModel:
    A, B, C = np.eye(n_states), np.ones((n_states, n_inputs)), np.ones((n_outputs, n_states))
    return UncertainModel(A, B, C, n=np.ones(n_outputs), Ts=Ts)


@dataclass(frozen=True)
class FakeProof(Certificate):
    poison: float | tuple[float, ...]
    samples = ()

    def verify(self) -> bool:
        return True

    def premise(self, sample: int) -> str:
        return "nothing"


@dataclass(frozen=True, slots=True, eq=False)
class FakeStep(Step):
    centre: float
    width: float
    n = 1

    def _box(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array([self.centre - self.width]), np.array([self.centre + self.width])


class FakeObserver(Observer):
    """Falls where y equals (one of) its poison; x moves by u; boxes are x +- 1."""

    answer: type[FakeStep] = FakeStep

    def __init__(
        self,
        poison: float | tuple[float, ...],
        model: UncertainModel | None = None,
        undecided_at: float = 1e9,
        certified: bool = True,
        width: float = 1.0,
    ) -> None:
        super().__init__(model or fake_model())
        self.poison, self.undecided_at, self.certified = poison, undecided_at, certified
        self.centre, self.width = 0.0, width
        self.calls: list[tuple[Any, ...]] = []

    def _reset(self, set: HPolytope, lower: Any, upper: Any) -> None:
        self.centre, self.width = float(lower[0] + upper[0]) / 2, float(upper[0] - lower[0]) / 2
        self.calls.append(("reset", float(lower[0]), float(upper[0])))

    def _update(self, y: Any, u: Any, schedule: Any) -> Step:
        self.calls.append(("update", *y, schedule))
        return self._judged(y)

    def _step(self, u: Any, y: Any, u_next: Any, schedule: Any, end: float | None) -> Step:
        self.calls.append(("step", *u, *y, schedule))
        self.centre += float(u[0])
        return self._judged(y)

    def warm_up(self) -> float:
        return 0.25

    def _judged(self, y: Any) -> Step:
        verdict: Any = "undecided" if y[0] == self.undecided_at else "consistent"
        proof = None
        if np.isin(y[0], self.poison):
            verdict, proof = "falsified", FakeProof(self.poison) if self.certified else None
        return self.answer(self.centre, self.width, verdict=verdict, certificate=proof)


def fake(of: Bank, name: str) -> FakeObserver:
    observer = of.observers[name]
    assert isinstance(observer, FakeObserver)
    return observer


def log_of(*y: float) -> Log:
    return Log(time=np.arange(len(y)) * 0.1, u=np.ones((len(y), 1)), y=np.array(y)[:, None])
