"""A model along a log: the same numbers at every sample, and the same answers of an observer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.detectors.scaled_bounds import scaled_bounds
from svo.faults import ActuatorFault, SensorFault, Step
from svo.interval.model import first_order_model
from svo.models.schedule_table import ScheduleTable

SAMPLES = 12


def scheduled_model(rng: np.random.Generator, vector: bool) -> UncertainModel:
    """Two states; every block, and every bound, a table, a function, or constant, by chance."""
    points = np.array([-1.0, 0.2, 1.0])

    def block(*shape: int, size: float = 1.0, positive: bool = False) -> Any:
        values = size * (rng.uniform(0, 1, (3, *shape)) if positive else rng.normal(size=(3, *shape)))
        table, kind = ScheduleTable(points, values), rng.integers(3)
        if kind == 0:
            return values[0]
        if kind == 1 and not vector:
            return table
        return lambda s: table(s[0] if vector else s)

    half = block(1, positive=True)
    lower = (lambda s: -half(s)) if callable(half) else -half
    return UncertainModel(
        A=block(2, 2, size=0.4),
        B=block(2, 1),
        C=block(1, 2),
        E=block(2, 1, size=0.1),
        D=block(1, 1),
        c=block(1),
        w=(lower, half),
        n=block(1, size=0.1, positive=True),
        uncertainties=[Uncertainty(A=block(2, 2, size=0.1), c=block(1), name="p")],
        schedule=np.array([0.1, 7.0]) if vector else 0.1,
    )


CHANGES: dict[str, Callable[[UncertainModel], UncertainModel]] = {
    "as it is": lambda model: model,
    "scaled bounds": lambda model: scaled_bounds(model, 1.7),
    "hard sensor": SensorFault(0, "hard", 0.3, Step()).model,
    "biased sensor": SensorFault(0, "bias", 0.3, Step()).model,
    "loss of an actuator": ActuatorFault(0, "loss", 0.5, Step()).model,
    "locked actuator": ActuatorFault(0, "locking", None, Step(), travel=(-1.0, 1.0)).model,
    "hard-over actuator": ActuatorFault(0, "hard-over", 0.5, Step()).model,
}


@given(seed=st.integers(0, 10_000), vector=st.booleans(), change=st.sampled_from(sorted(CHANGES)))
def test_every_sample_has_the_numbers_of_its_schedule(seed: int, vector: bool, change: str) -> None:
    rng = np.random.default_rng(seed)
    model = CHANGES[change](scheduled_model(rng, vector))
    schedule = rng.uniform(-1.2, 1.2, (SAMPLES, 2) if vector else SAMPLES)
    along = model.along(schedule)
    values = [row if vector else float(row) for row in schedule]
    for k, value in enumerate(values):
        np.testing.assert_array_equal(along.stack(float(k)), model.stack(value))
        for ours, given_ in zip(along.bounds(float(k)), model.bounds(value), strict=True):
            np.testing.assert_array_equal(ours, given_)
    np.testing.assert_array_equal(along.stack(along.schedule), model.stack(model.schedule))
    for ours, each in zip(model.bounds_over(schedule), zip(*map(model.bounds, values), strict=True), strict=True):
        np.testing.assert_array_equal(ours, np.array(each))


@pytest.mark.parametrize("seed", range(5))
def test_an_observer_says_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = scheduled_model(rng, vector=False)
    schedule = rng.uniform(-1.0, 1.0, SAMPLES)
    log = model.simulate([0.2, -0.1], rng.normal(size=(SAMPLES, 1)), rng, schedule=schedule)
    ours = WindowObserver(model.along(schedule), HPolytope.box([-1, -1], [1, 1]))
    plain = WindowObserver(model, HPolytope.box([-1, -1], [1, 1]))
    first = ours.update(log.y[0], log.u[0], 0.0), plain.update(log.y[0], log.u[0], schedule[0])
    steps = [first] + [
        (ours.step(u, y, v, float(k)), plain.step(u, y, v, schedule[k]))
        for k, (u, y, v) in enumerate(zip(log.u, log.y[1:], log.u[1:], strict=False), start=1)
    ]
    assert {step.verdict for pair in steps for step in pair} == {"consistent"}
    np.testing.assert_array_equal(ours.directions, plain.directions)
    np.testing.assert_array_equal(steps[-1][0].box, steps[-1][1].box)


def test_a_model_without_schedule_stays_as_it_is() -> None:
    model = UncertainModel([[0.5]], None, [[1.0]], n=[0.1])
    assert model.along(np.zeros(3)) is model
    assert model.along(None) is model


def test_mistakes_are_named() -> None:
    model = first_order_model(0.1, 0.01)
    with pytest.raises(ValueError, match=r"schedule has shape \(3,\) at a sample; expected \(4,\)"):
        model.along(np.zeros((5, 3)))
    with pytest.raises(ValueError, match="schedule is missing"):
        model.along(None)
    with pytest.raises(ValueError, match=r"expected \(K, ...\), one value a sample"):
        model.along(np.zeros((0, 4)))
    wrong = np.tile([0.5, 0.1, 1.0, 0.2], (5, 1))
    wrong[3, 3] = -0.2
    with pytest.raises(ValueError, match=r"lower bound 0.2 above its upper bound -0.2"):
        model.along(wrong)
    wrong[3, 3] = np.nan
    with pytest.raises(ValueError, match="schedule contains NaN at"):
        model.along(wrong)
