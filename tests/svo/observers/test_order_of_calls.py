"""Calls in an order that would give a wrong answer are errors that say what to call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, ConstrainedZonotopeObserver, Log, PolytopeObserver, UncertainModel, WindowObserver
from svo.interval import GainBounds, IntervalDetector, IntervalPredictor, NoiseCharacterization

START = HPolytope.box([0.9], [1.1])
KINDS = [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver]
SCHEDULED: dict[str, UncertainModel] = {
    "A": UncertainModel(lambda s: [[s]], None, [[1.0]], n=[0.01], schedule=0.5),
    "n": UncertainModel([[0.5]], None, [[1.0]], n=lambda s: [s], schedule=0.1),
    "w": UncertainModel([[0.5]], None, [[1.0]], E=[[1.0]], w=(lambda s: [-s], lambda s: [s]), schedule=0.1),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", SCHEDULED)
def test_a_scheduled_model_starts_with_update(kind: Any, name: str) -> None:
    """x(1) = A(s(0)) x(0): with s(1) in its place a healthy plant is falsified (A = 0.5, then 0.9; x(0) = 1)."""
    observer = kind(SCHEDULED[name], START)
    with pytest.raises(ValueError, match=r"step was called before update.*call update\(y0=..., schedule=...\) first"):
        observer.step(u=[], y=[0.5], schedule=0.9)
    observer.update(y0=[np.nan], schedule=0.5)  # the refused call has changed nothing
    assert observer.step(u=[], y=[0.5], schedule=0.9).verdict == "consistent"


@pytest.mark.parametrize("kind", KINDS)
def test_a_bank_starts_with_update(kind: Any) -> None:
    bank = ArchitectureI(kind(SCHEDULED["A"], START), {})
    with pytest.raises(ValueError, match="step was called before the first measurement; call update"):
        bank.step(u=[], y=[0.5], schedule=0.9)


def test_an_interval_detector_with_a_schedule_starts_with_update() -> None:
    predictor = IntervalPredictor(lambda u, y, schedule: GainBounds(schedule, 0.01), (1.0, 0.1))
    detector = IntervalDetector(predictor, NoiseCharacterization.from_records(np.sin(np.arange(50.0)), 5), 0.5)
    with pytest.raises(ValueError, match="step was called before update with a schedule"):
        detector.step(u=0.0, y=0.5, schedule=0.9)
    detector.update(y0=1.0, schedule=0.5)
    assert detector.step(u=0.0, y=0.5, schedule=0.9).interval.upper == pytest.approx(0.5 + 0.051 + 0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_a_constant_model_may_start_with_step(kind: Any) -> None:
    model = UncertainModel([[0.5]], None, [[1.0]], n=[0.01])
    first, second = kind(model, START), kind(model, START)
    second.update(y0=[np.nan])
    assert np.array_equal(first.step(u=[], y=[0.5]).box, second.step(u=[], y=[0.5]).box)


ONCE: dict[str, Callable[[Any], Any]] = {
    "update": lambda o: o.update(y0=[1.0]),
    "run": lambda o: o.run(Log(time=[0.0, 1.0], u=np.zeros((2, 0)), y=[[1.0], [0.5]])),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("call", ONCE)
@pytest.mark.parametrize("reading", [1.0, 5.0])
def test_an_observer_starts_once(kind: Any, call: str, reading: float) -> None:
    """Whether it was falsified meanwhile or not; `reset` is the way to start again."""
    observer = kind(UncertainModel([[0.5]], None, [[1.0]], n=[0.01]), START)
    verdict = observer.update(y0=[reading]).verdict
    assert verdict == ("falsified" if reading == 5.0 else "consistent")
    with pytest.raises(ValueError, match="update was called after the first sample"):
        ONCE[call](observer)
    observer.reset(START)
    ONCE[call](observer)


@pytest.mark.parametrize("kind", KINDS)
def test_what_comes_after_a_falsification_is_still_checked(kind: Any) -> None:
    observer = kind(UncertainModel([[0.5]], [[1.0]], [[1.0]], n=[0.01]), START)
    observer.update(y0=[5.0])
    for u, y in (([0.0, 1.0], [0.0]), ([0.0], [0.0, 1.0]), (None, [0.0]), ([0.0], [1j])):
        with pytest.raises((ValueError, TypeError), match="expected"):
            observer.step(u=u, y=y)
    assert observer.step(u=[0.0], y=[0.0]).verdict == "falsified"


def test_a_bank_keeps_copies_of_what_it_may_need_again() -> None:
    """A loop that fills one array again and again gets the verdicts of one with an array a sample."""
    model, runs = UncertainModel([[0.5]], None, [[1.0]], n=[0.01]), []
    for buffer in (np.empty(1), None):
        bank, found = ArchitectureI(WindowObserver(model, START), {}, recovery=3), []
        for k, value in enumerate([1.0, 0.5, 3.0, 0.12, 0.06, 0.03, 0.015]):
            y = np.empty(1) if buffer is None else buffer
            y[0] = value
            verdict = bank.update(y0=y) if k == 0 else bank.step(u=[], y=y)
            found.append((verdict.state, verdict.alive))
        runs.append(found)
    assert runs[0] == runs[1]
    assert runs[0][2][0] != "nominal"
