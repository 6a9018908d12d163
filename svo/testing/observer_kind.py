"""A kind of observer as its rules see it, and how its answers are held against the exact states."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from math import isfinite, nan
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.testing.exact_states import Point, exactly, product
from svo.testing.rules import NotApplicable
from svo.testing.systems import PLAIN, System

Make = Callable[[UncertainModel, HPolytope], Any]
Answer = tuple[Any, ...]
Rows = list[tuple[list[float], float]]
SLANTED = [[1.0, 1.0], [1.0, -1.0], [3.0, -2.0], [-1.0, 4.0]]
COARSE = Fraction(1, 10**6)  # of a set's width: for rules that are about another thing than rounding


class Kind:
    """A kind of observer, and the models that it refused with the reason.

    Parameters
    ----------
    make : callable
        As `check_observer` takes it.
    """

    def __init__(self, make: Make) -> None:
        self._make = make
        self.refused: dict[str, str] = {}

    def observer(self, system: System = PLAIN) -> Any:
        """A fresh one for a ``system``.

        Raises
        ------
        NotApplicable
            If the kind refuses this model; the plainest one it may not refuse.
        """
        try:
            return self._make(system.model, system.initial)
        except (NotImplementedError, ValueError) as error:
            if system is PLAIN:
                raise
            self.refused[system.name] = str(error)
            raise NotApplicable(f"the observer refuses a model with {system.name}: {error}") from error

    def taken(self, systems: Collection[System]) -> list[System]:
        """The ``systems`` that it does not refuse."""
        found = []
        for system in systems:
            try:
                self.observer(system)
                found.append(system)
            except NotApplicable:
                continue
        return found

    def that_can(self, capability: str) -> None:
        """Raise `NotApplicable` unless it declares a ``capability``, such as "takes_late"."""
        if not getattr(self.observer(), capability, False):
            raise NotApplicable(f"the observer does not declare {capability}")

    def answers(self, log: Log, system: System = PLAIN) -> list[Answer]:
        """Those of a fresh observer for a ``system`` over a ``log``."""
        return answers_of(self.observer(system), log)


def answers_of(observer: Any, log: Log) -> list[Answer]:
    return [answer(step) for step in drive(observer, log)]


def answer(step: Any) -> Answer:
    """What is compared bit for bit: the verdict and the box."""
    return step.verdict, *(np.asarray(end, dtype=float).tobytes() for end in step.box)


def left_out(kind: Kind, system: System, log: Log, parts: Collection[str], share: Fraction = COARSE) -> Iterator[str]:
    """Where the answers over a log leave out more than a share of what the exact states reach."""
    states = system.states(log)
    for k, step in enumerate(drive(kind.observer(system), log)):
        for breach in short_of(step, states[k], parts, share):
            yield f"{system.name}, sample {k}: {breach}"


def short_of(step: Any, states: Sequence[Point], parts: Collection[str], share: Fraction) -> Iterator[str]:
    """What of the exact states an answer leaves out, beyond a share of their width."""
    if step.verdict == "falsified":
        yield "falsified, though the data are those of the model"
        return
    for part in parts:
        for row, bound in _ROWS[part](step, len(states[0])):
            reached, width = _reach(row, states)
            if not _at_least(bound, reached - share * width):
                missing = float((reached - Fraction(bound)) / (width or 1)) if isfinite(bound) else nan
                yield f"{part} in direction {row} stops {missing:.2g} of the width before a state that is possible"


def _axes(n: int) -> Array:
    return np.vstack([np.eye(n), -np.eye(n)])


def _rows_of_box(step: Any, n: int) -> Rows:
    lower, upper = step.box
    return _pairs(_axes(n), np.concatenate([upper, -lower]))


def _rows_of_support(step: Any, n: int) -> Rows:
    directions = np.vstack([_axes(n), SLANTED]) if n == 2 else _axes(n)
    return _pairs(directions, step.support(directions))


def _rows_of_set(step: Any, n: int) -> Rows:
    P = step.set
    return _pairs(np.vstack([P.A, P.C, -P.C]), np.concatenate([P.b, P.d, -P.d]))


def _pairs(rows: Array, bounds: Array) -> Rows:
    """Rows d'x <= bound."""
    return list(zip(rows.tolist(), np.asarray(bounds, dtype=float).tolist(), strict=True))


_ROWS: Mapping[str, Callable[[Any, int], Rows]] = {
    "box": _rows_of_box,
    "support": _rows_of_support,
    "set": _rows_of_set,
}


def _reach(row: Sequence[float], states: Sequence[Point]) -> tuple[Fraction, Fraction]:
    """Largest value of row'x over exact states, and how far it is from the smallest."""
    normal = exactly(row)
    values = [product(normal, x) for x in states]
    return max(values), max(values) - min(values)


def _at_least(bound: float, value: Fraction) -> bool:
    return bound == float("inf") or (isfinite(bound) and Fraction(bound) >= value)


def missing(log: Log, sensors: Mapping[int, Sequence[int]]) -> Log:
    """A log without the readings of some sensors, by sample."""
    y: Array = log.y.copy()
    for k, channels in sensors.items():
        y[k, list(channels)] = np.nan
    return replace(log, y=y)
