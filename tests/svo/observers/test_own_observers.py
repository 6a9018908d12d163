"""An observer of one's own: three hooks, and the base class checks, counts, times and refuses what it cannot do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, ConstrainedZonotopeObserver, Log, PolytopeObserver, UncertainModel, WindowObserver
from svo.observers.base import Observer, Step
from svo.observers.readings import Readings

TANK = UncertainModel([[0.9]], [[0.1]], [[1.0]], E=[[1.0]], w=[0.01], n=[0.05], Ts=1.0)
START = HPolytope.box([0.0], [2.0])


@dataclass(frozen=True, slots=True, eq=False)
class Bounds(Step):
    lower: Any
    upper: Any
    n = 1

    def _box(self) -> Any:
        return self.lower, self.upper


class Hull(Observer):
    """Bounds of the state of a tank, moved on by the model and cut by the readings; it proves nothing."""

    def _reset(self, set: HPolytope, lower: Any, upper: Any) -> None:
        self.lower, self.upper = lower, upper

    def _update(self, y: Any, u: Any, schedule: Any) -> Bounds:
        low, high = np.fmax(self.lower, y - 0.05 - 1e-9), np.fmin(self.upper, y + 0.05 + 1e-9)
        if (low > high).any():
            return Bounds(self.lower, self.upper, verdict="undecided")
        self.lower, self.upper = low, high
        return Bounds(low, high, verdict="consistent")

    def _step(self, u: Any, y: Any, u_next: Any, schedule: Any, end: float | None) -> Bounds:
        self.lower = 0.9 * self.lower + 0.1 * u - 0.01 - 1e-9
        self.upper = 0.9 * self.upper + 0.1 * u + 0.01 + 1e-9
        return self._update(y, u_next, schedule)


def hull() -> Hull:
    observer = Hull(TANK)
    observer.reset(START)
    return observer


def flight(samples: int = 20) -> Log:
    rng = np.random.default_rng(4)
    return TANK.simulate([1.0], rng.uniform(0.0, 1.0, (samples, 1)), rng, corners=True)


def test_three_hooks_make_an_observer_that_banks_take() -> None:
    log = flight()
    record = hull().run(log)
    assert log.x is not None
    assert (record.lower <= log.x).all()
    assert (log.x <= record.upper).all()
    assert set(record.verdicts) == {"consistent"}
    assert (record.seconds > 0.0).all()
    assert ArchitectureI(hull(), {"leak": WindowObserver(TANK, START)}).run(log).alive.all()


def test_answers_are_numbered_and_sets_come_from_the_box() -> None:
    log, observer = flight(3), hull()
    observer.update(log.y[0])
    step = observer.step(log.u[0], [np.nan])
    assert step.sample == 1
    assert step.set.contains(log.x[1], tol=1e-12)
    np.testing.assert_allclose(step.support([[2.0]]), 2.0 * step.box[1])


CANNOT: dict[str, tuple[Callable[[Any], Any], str]] = {
    "deadline": (lambda o: o.step([0.0], [1.0], deadline=1.0), "Hull has no deadline"),
    "late": (lambda o: o.late_update([1.0], 0), "Hull takes no measurements that come late"),
    "window": (lambda o: o.window, "Hull takes no measurements that come late"),
    "saved": (lambda o: o.state_dict(), "Hull has no state_dict"),
    "restored": (lambda o: Hull.from_state_dict(TANK, {}), "Hull has no state_dict"),
    "lost": (lambda o: o.lose_set(), "Hull has no lose_set"),
}


@pytest.mark.parametrize("what", CANNOT)
def test_what_an_observer_does_not_declare_is_refused_by_name(what: str) -> None:
    observer = hull()
    observer.update([1.0])
    call, message = CANNOT[what]
    with pytest.raises(TypeError, match=message):
        call(observer)
    assert observer.step([0.0], [1.0]).sample == 1


def test_what_only_looks_like_an_observer_is_no_observer() -> None:
    class Duck:
        model = TANK

        def step(self, u: Any, y: Any) -> None: ...

    with pytest.raises(TypeError, match=r"'nominal' is a Duck; .* subclass of svo.observers.base.Observer"):
        ArchitectureI(Duck(), {})  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver])
def test_after_a_falsification_every_answer_is_that_of_the_falsification(kind: Any) -> None:
    observer = kind(TANK, START)
    observer.update([1.0])
    alarm = observer.step([0.0], [5.0])
    later = observer.step([0.0], [0.9])
    assert (later.verdict, later.sample, later.certificate) == ("falsified", 1, alarm.certificate)
    observer.reset(START)
    assert observer.update([1.0]).sample == 0


@pytest.mark.parametrize("kind", [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver])
def test_a_sample_that_fails_without_a_set_can_be_given_again(kind: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kept twice it would be a transition that never was."""
    model = UncertainModel([[1.0, 1.0], [0.0, 1.0]], None, [[1.0, 0.0]], E=np.eye(2), w=[0.01, 0.01], n=[0.05], Ts=1.0)
    start = HPolytope.box([-9.0, -9.0], [9.0, 9.0])
    observer, twin = kind(model, start), kind(model, start)
    for o in (observer, twin):
        o.lose_set()
        o.update([0.0])
    with monkeypatch.context() as patch:
        patch.setattr(Readings, "start", lambda self: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            observer.step(None, [1.0])
    for y in (1.0, 2.0, 3.0):
        steps = [o.step(None, [y]) for o in (observer, twin)]
        np.testing.assert_array_equal(steps[0].box, steps[1].box)
    assert steps[0].verdict == "consistent"


class Clumsy(Hull):
    def _step(self, u: Any, y: Any, u_next: Any, schedule: Any, end: float | None) -> Bounds:
        raise ArithmeticError


def test_a_sample_that_fails_is_not_counted() -> None:
    observer = Clumsy(TANK)
    observer.reset(START)
    observer.update([1.0])
    for _ in range(2):
        with pytest.raises(ArithmeticError):
            observer.step([0.0], [1.0])
    assert observer._number == 0
