"""Observers that are each broken in one way that a user would, and the rule that says so."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from docs.examples.interval_observer import IntervalObserver, IntervalStep, Reading
from polytopes import HPolytope
from svo import WindowObserver
from svo.observers.base import Step


class RoundsInward(IntervalObserver):
    """Its sets are smaller by 1e-9 of their width on either side, as by bounds computed with a tolerance."""

    def _read(self, reading: Reading) -> Step:
        step = super()._read(reading)
        if self._now is not None:
            lower, upper = self._now
            self._now = lower + 1e-9 * (upper - lower), upper - 1e-9 * (upper - lower)
            step = replace(step, lower=self._now[0], upper=self._now[1])
        return step


class AlarmWithoutProof(IntervalObserver):
    """It sees that no state is left, and says so without keeping the proof."""

    def _read(self, reading: Reading) -> Step:
        return replace(super()._read(reading), certificate=None)


class RemembersTheLastRun(IntervalObserver):
    """After reset it goes on with the part of the new set that its last set holds."""

    def _reset(self, set: HPolytope, lower: Any, upper: Any) -> None:
        last = getattr(self, "_now", None)
        self._before = (lower, upper) if last is None else (np.maximum(lower, last[0]), np.minimum(upper, last[1]))


class MissingAsZero(IntervalObserver):
    """A sensor that is missing reads zero."""

    def _read(self, reading: Reading) -> Step:
        return super()._read(replace(reading, y=np.nan_to_num(reading.y)))


class InputOfTheSampleBefore(IntervalObserver):
    """The set moves with the input that drove the sample before."""

    _held: Any = None

    def _step(self, u: Any, *rest: Any) -> Step:
        held, self._held = self._held, u.copy()
        return super()._step(u if held is None else held, *rest)

    def _reset(self, *given: Any) -> None:
        super()._reset(*given)
        self._held = None


class ForgetsTheClock(IntervalObserver):
    """A saved state does not say which sample it is of; the first one, one would think."""

    def _state(self) -> dict[str, Any]:
        return super()._state() | {"number": np.array(min(self._number, 0))}


class LateAtTheWrongTime(WindowObserver):
    """A late measurement is put at the sample after its own, as by a window that has moved on."""

    def _late_update(self, y: Any, sample: int) -> Step:
        return super()._late_update(y, min(sample + 1, self.window[1]))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StepWithInnerBox(IntervalStep):
    def _box(self) -> tuple[Any, Any]:
        middle = 0.5 * self.lower + 0.5 * self.upper
        half = np.min(self.upper - middle)
        return middle - half, middle + half

    def _set(self) -> HPolytope:
        bounded = np.isfinite(self.lower).all()
        return HPolytope.box(self.lower, self.upper) if bounded else HPolytope.whole_space(self.n)


class InnerBox(IntervalObserver):
    """Its box is that of the largest ball in the set."""

    def _read(self, reading: Reading) -> Step:
        step = super()._read(reading)
        return step if np.isinf(step.lower).any() else StepWithInnerBox(
            verdict=step.verdict, certificate=step.certificate, lower=step.lower, upper=step.upper
        )  # fmt: skip


class RaisesForUndecided(IntervalObserver):
    """A set that has outgrown all bounds is an error."""

    def _read(self, reading: Reading) -> Step:
        step = super()._read(reading)
        if step.verdict == "undecided":
            raise OverflowError("the set of states is unbounded")
        return step


class FalsifiedForGood(IntervalObserver):
    """Its reset is its own and forgets the data, but not the alarm."""

    def reset(self, set: HPolytope) -> None:
        self._reset(set, *set.bounding_box())
        self._number = -1


BROKEN_OBSERVERS = {
    RoundsInward: "every possible state",
    AlarmWithoutProof: "alarm with proof",
    RemembersTheLastRun: "runs apart",
    MissingAsZero: "missing readings",
    InputOfTheSampleBefore: "input of its sample",
    ForgetsTheClock: "saved state",
    LateAtTheWrongTime: "late at its sample",
    InnerBox: "box",
    RaisesForUndecided: "undecided is an answer",
    FalsifiedForGood: "reset after falsification",
}
