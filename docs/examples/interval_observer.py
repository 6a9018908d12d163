"""An observer of one's own, complete: an interval for each state, in exact arithmetic, rounded outward.

It is sound for every model, since it takes each entry of an uncertain matrix, each disturbance and each state as free
in its interval; it is wide where these belong together, which `svo.WindowObserver` knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo import UncertainModel
from svo.observers.base import Certificate, Observer, Step

Array = NDArray[np.float64]
Interval = tuple[Fraction, Fraction]
ROUNDING = Fraction(1, 10**9)  # of a reading: that of whoever computed it
LARGEST = Fraction(10**100)  # beyond it a bound is of no use


# -- interval arithmetic ---------------------------------------------------------------------------


def between(lower: Any, upper: Any) -> list[Interval]:
    return [(Fraction(low), Fraction(high)) for low, high in zip(lower, upper, strict=True)]


def exactly(values: Any) -> list[Interval]:
    return between(values, values)


def total(terms: Sequence[Interval]) -> Interval:
    return sum((low for low, _ in terms), Fraction(0)), sum((high for _, high in terms), Fraction(0))


def times(a: Interval, b: Interval) -> Interval:
    ends = [p * q for p in a for q in b]
    return min(ends), max(ends)


def dot(row: Sequence[Interval], values: Sequence[Interval]) -> Interval:
    return total([times(a, b) for a, b in zip(row, values, strict=True) if any(a)])


def outward(intervals: Sequence[Interval]) -> tuple[Array, Array]:
    """Floats that are not inside."""
    lower = [_from(low, -1) for low, _ in intervals]
    upper = [_from(high, 1) for _, high in intervals]
    return np.array(lower), np.array(upper)


def _from(value: Fraction, side: int) -> float:
    near = float(value)
    return near if side * (Fraction(near) - value) >= 0 else float(np.nextafter(near, side * np.inf))


# -- one sample --------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Reading:
    """Model and data of a sample; NaN in y = that sensor is missing.

    Attributes
    ----------
    stack : (1 + nd, n + ny, n + nu + 1 + nw) array
        [[A B a E], [C D c F]] and the same of each uncertainty, whose Delta is between ``delta`` (nd, 2).
    """

    stack: Array
    delta: Array
    w_lower: Array
    w_upper: Array
    noise: Array
    u: Array
    y: Array

    @classmethod
    def of(cls, model: UncertainModel, u: Array, y: Array, schedule: Any) -> Reading:
        delta = np.array([q.bounds for q in model.uncertainties], dtype=float).reshape(-1, 2)
        return cls(model.stack(schedule), delta, *model.bounds(schedule), u, y)

    def row(self, i: int) -> list[Interval]:
        """A row of the matrices, every Delta free in its bounds."""
        columns = zip(*(item[i].tolist() for item in self.stack), strict=True)
        weights = [*exactly([1.0]), *between(*self.delta.T.tolist())] if len(self.delta) else exactly([1.0])
        return [dot(exactly(column), weights) for column in columns]

    def beside(self, x: Sequence[Interval], u: Array) -> list[Interval]:
        """All that a row is multiplied with."""
        return [*x, *exactly(u.tolist()), *exactly([1.0]), *between(self.w_lower.tolist(), self.w_upper.tolist())]

    def moved(self, x: Sequence[Interval], u: Array) -> list[Interval]:
        """Where the states are one sample later."""
        return [dot(self.row(i), self.beside(x, u)) for i in range(len(x))]

    def explained(self, x: Sequence[Interval]) -> list[Interval] | None:
        """The part of the states that every reading allows; None if there is none."""
        x, n = list(x), len(x)
        for i in np.flatnonzero(~np.isnan(self.y)).tolist():
            row, half = self.row(n + i), Fraction(self.noise[i]) + ROUNDING * abs(Fraction(self.y[i]))
            read = Fraction(self.y[i]) - half, Fraction(self.y[i]) + half
            for j in range(n):
                if row[j][0] <= 0 <= row[j][1]:
                    continue
                terms = [times(a, b) for a, b in zip(row, self.beside(x, self.u), strict=True)]
                others = total(terms[:j] + terms[j + 1 :])
                allowed = times((read[0] - others[1], read[1] - others[0]), (1 / row[j][1], 1 / row[j][0]))
                x[j] = max(x[j][0], allowed[0]), min(x[j][1], allowed[1])
                if x[j][0] > x[j][1]:
                    return None
        return x


# -- what the observer answers -----------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class IntervalCertificate(Certificate):
    """The readings of the last sample exclude every state between ``lower`` and ``upper``."""

    kind: ClassVar[str] = "interval"
    samples: tuple[Reading, ...]
    lower: Array
    upper: Array

    def verify(self) -> bool:
        """A stored proof may hold anything: an error while it is checked, or an empty set before, proves nothing."""
        try:
            before = between(self.lower.tolist(), self.upper.tolist())
            return all(low <= high for low, high in before) and self.samples[-1].explained(before) is None
        except (AttributeError, LookupError, OverflowError, TypeError, ValueError):
            return False

    def premise(self, sample: int) -> str:
        return f"the bounds of the state at sample {sample} before its readings"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class IntervalStep(Step):
    lower: Array
    upper: Array

    @property
    def n(self) -> int:
        return len(self.lower)

    def _box(self) -> tuple[Array, Array]:
        return self.lower.copy(), self.upper.copy()


class IntervalObserver(Observer):
    """See `svo.observers.base.Observer` for what is checked before these hooks are called."""

    kind = "interval"
    saves_state = True

    def __init__(self, model: UncertainModel, initial: HPolytope) -> None:
        super().__init__(model)
        self.reset(initial)

    def _reset(self, set: HPolytope, lower: Array, upper: Array) -> None:
        self._before = lower, upper  # of the next reading, until there is one

    def _update(self, y: Array, u: Array, schedule: Any) -> Step:
        return self._read(Reading.of(self.model, u, y, schedule))

    def _step(self, u: Array, y: Array, u_next: Array, schedule: Any, end: float | None) -> Step:
        reading = Reading.of(self.model, u_next, y, schedule)
        if self._now is not None:
            now = self._reading.moved(between(*(ends.tolist() for ends in self._now)), u)
            lost = max(abs(end) for interval in now for end in interval) > LARGEST
            self._before = (np.full(len(now), -np.inf), np.full(len(now), np.inf)) if lost else outward(now)
        return self._read(reading)

    def _read(self, reading: Reading) -> Step:
        """Cut the set by a reading."""
        lower, upper = self._before
        self._reading, self._now = reading, None
        if np.isinf(lower).any():
            return IntervalStep(verdict="undecided", reason="outgrown", lower=lower, upper=upper)
        explained = reading.explained(between(lower.tolist(), upper.tolist()))
        if explained is None:
            proof = IntervalCertificate((reading,), lower, upper)
            return IntervalStep(verdict="falsified", certificate=proof, lower=lower, upper=upper)
        self._now = outward(explained)
        return IntervalStep(verdict="consistent", lower=self._now[0], upper=self._now[1])

    # -- saved states: the last reading and the set before it, from which the rest follows -------------

    def _state(self) -> dict[str, NDArray[Any]]:
        lower, upper = self._before
        state = {"lower": lower, "upper": upper, "number": np.array(self._number)}
        return state | (vars(self._reading) if self._number >= 0 else {})

    def _set_up(self, model: UncertainModel, state: Any) -> None:
        self.model = model

    def _resume(self, state: Any) -> Step | None:
        self._before, self._number = (state["lower"], state["upper"]), int(state["number"])
        if self._number < 0:
            return None
        step = self._read(Reading(**{name: state[name] for name in Reading.__dataclass_fields__}))
        return step if step.verdict == "falsified" else None


if __name__ == "__main__":
    from svo.testing import check_observer

    print(f"{len(check_observer(IntervalObserver).kept)} rules hold")
