"""Two faults at once: the pair's model explains what neither fault explains alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo.faults import ActuatorFault, FaultPair, PlantFault, SensorFault, Step, pairs
from svo.logs.log import Log
from svo.models.model import UncertainModel, Uncertainty
from svo.observers.window.observer import WindowObserver

START, TS, SAMPLES = 0.5, 0.1, 20


def nominal_plant() -> UncertainModel:
    A, B = [[0.8, 0.3], [-0.2, 0.7]], [[1.0], [0.5]]
    return UncertainModel(A, B, np.eye(2), E=np.eye(2), w=np.full(2, 0.01), n=np.full(2, 0.01), Ts=TS)


def sensor(kind: Any, size: float) -> SensorFault:
    return SensorFault(0, kind, size, Step(START))


def actuator(kind: Any, size: float | None, **options: Any) -> ActuatorFault:
    return ActuatorFault(0, kind, size, Step(START), **options)


def faults() -> dict[str, Any]:
    direction = Uncertainty(A=[[0.1, 0.0], [0.2, 0.0]], B=[[0.3], [0.0]], C=[[0.5, 0.0], [0.0, 0.0]], E=0.5 * np.eye(2))
    return {
        "bias": sensor("bias", 1.0),
        "scaling": sensor("scaling", 0.5),
        "hard": sensor("hard", 2.0),
        "loss": actuator("loss", 0.6),
        "hard-over": actuator("hard-over", 3.0),
        "locking": actuator("locking", None, travel=(-4.0, 4.0)),
        "oscillation": actuator("oscillatory-liquid", 1.5, frequency_hz=1.3),
        "plant": PlantFault(direction, 1.0, Step(START)),
    }


def fly(plant: UncertainModel, both: FaultPair, rng: np.random.Generator) -> Log:
    """A run with two faults, the first acting first, with corners of noise and disturbance."""
    time, x, readings = np.arange(SAMPLES) * TS, np.zeros(2), []
    u = 1.0 + rng.normal(size=(SAMPLES, 1))
    achieved = u
    for fault in (both.first, both.second):
        if isinstance(fault, ActuatorFault):
            achieved = fault.corrupt(time, achieved)
    for k in range(SAMPLES):
        w = rng.choice([-0.01, 0.01], 2)
        change, error = np.zeros(2), np.zeros(2)
        for fault in (both.first, both.second):
            if isinstance(fault, PlantFault):
                change, error = fault.perturbation(plant, time[k], x, achieved[k], w)
        y = x + error + rng.choice([-0.01, 0.01], 2)
        for fault in (both.first, both.second):
            if isinstance(fault, SensorFault):
                y = fault.corrupt(time[k], y)
        readings.append(y)
        x = plant.block("A") @ x + plant.block("B") @ achieved[k] + w + change
    return Log(time=time, u=u, y=np.array(readings))


def verdict(model: UncertainModel, log: Log) -> str:
    """The last verdict of a window observer."""
    return WindowObserver(model, HPolytope.box([-0.1] * 2, [0.1] * 2), horizon=5).run(log).verdicts[-1]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("name", list(pairs(faults())))
def test_a_run_with_both_faults_is_explained_by_their_pair(name: str, turned: bool) -> None:
    pair = pairs(faults())[name]
    pair = FaultPair(pair.second, pair.first) if turned else pair
    for seed in range(2):
        log = fly(nominal_plant(), pair, np.random.default_rng(seed))
        assert verdict(pair.model(nominal_plant()), log) == "consistent"


def test_only_the_pair_explains_both_faults() -> None:
    chosen = {name: fault for name, fault in faults().items() if name in ("bias", "loss", "plant")}
    found = pairs(chosen)
    assert list(found) == ["bias + loss", "bias + plant", "loss + plant"]
    plant = nominal_plant()
    direction = Uncertainty(A=[[0.0, 0.0], [0.3, 0.0]])
    chosen["plant"] = PlantFault(direction, 1.0, Step(START))
    found = pairs(chosen)
    log = fly(plant, found["bias + loss"], np.random.default_rng(0))
    verdicts = {name: verdict(fault.model(plant), log) for name, fault in {**chosen, **found}.items()}
    assert verdict(plant, log) == "falsified"
    assert {name for name, answer in verdicts.items() if answer != "falsified"} == {"bias + loss"}


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_pair_contains_its_faults_and_the_healthy_plant(seed: int) -> None:
    rng = np.random.default_rng(seed)
    name = str(rng.choice(list(pairs(faults()))))
    pair, plant = pairs(faults())[name], nominal_plant()
    for alone in (pair.first, pair.second):
        log = alone.model(plant).simulate([0.0, 0.0], rng.normal(size=(12, 1)), rng, corners=True)
        assert verdict(pair.model(plant), log) == "consistent", name


REACH = {
    "hard-over": actuator("hard-over", 1.5),
    "loss": actuator("loss", 1.0),
    "floating": actuator("floating", None),
    "solid": actuator("oscillatory-solid", 2.5, frequency_hz=1.3),
    "liquid": actuator("oscillatory-liquid", 1.5, frequency_hz=1.3),
    "noise": actuator("noise", 0.7, seed=1),
    "locking": actuator("locking", None, travel=(-2.0, 0.5)),
    "runaway": actuator("runaway", 3.0, travel=(0.5, 4.0)),
}


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("travel", [(-1.0, 1.0), (0.6, 1.0), (-0.5, -0.4)])
@pytest.mark.parametrize("name", REACH)
def test_a_pair_with_a_narrow_travel_contains_what_the_other_fault_does_alone(
    name: str, travel: tuple[float, float], turned: bool
) -> None:
    """Hard-over at 1.5 beside locking within 1: the travel alone, in one order, never let 1.5 through."""
    other, locked = REACH[name], actuator("locking", None, travel=travel)
    pair, plant = FaultPair(*((other, locked) if turned else (locked, other))), nominal_plant()
    low, high = travel
    if other.travel is not None:  # commands that a healthy actuator of both kinds follows
        low, high = max(low, other.travel[0]), min(high, other.travel[1])
    for seed in range(2):
        rng = np.random.default_rng(seed)
        u = np.linspace(low, high, 12)[:, None] if low <= high else np.full((12, 1), low)
        for alone in (pair.first, pair.second):
            log = alone.model(plant).simulate([0.0, 0.0], u, rng, corners=True)
            assert verdict(pair.model(plant), log) == "consistent"
        achieved = other.corrupt(np.arange(12) * TS, u)
        log = plant.simulate([0.0, 0.0], achieved, rng, corners=True)
        assert verdict(pair.model(plant), Log(time=log.time, u=u, y=log.y)) == "consistent"


def test_bad_arguments_are_refused_by_name() -> None:
    one = sensor("bias", 1.0)
    with pytest.raises(ValueError, match="faults has 1 entries; expected at least two"):
        pairs({"a": one})
    with pytest.raises(ValueError, match=r"two pairs of the name 'a \+ b \+ c'"):
        pairs(dict.fromkeys(("a", "b + c", "a + b", "c"), one))
    with pytest.raises(TypeError, match="second is a str"):
        FaultPair(one, "b")  # type: ignore[arg-type]
