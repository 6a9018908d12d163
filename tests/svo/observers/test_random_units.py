"""Healthy plants in any units are never falsified, and what a factorisation leaves out of them is bounded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import ArchitectureI, UncertainModel, Uncertainty, WindowObserver, calibrate, distinguishability
from svo.logs.drive import drive
from svo.observers.window.left_out import channels_of, factors_of
from svo.observers.window_kernel import channel_count, channel_factors
from svo.observers.zonotope.observer import ConstrainedZonotopeObserver
from tests.svo.observers.other_units import Units
from tests.svo.observers.random_plants import random_plant
from tests.svo.observers.test_normal_form import hydraulics, same

seeds = st.integers(0, 2**32 - 1)


def plant_in_units(seed: int, samples: int, most: int = 40) -> tuple[UncertainModel, HPolytope, Any]:
    """A random plant in random units, a box of first states, and a run at the corners of every bound."""
    rng = np.random.default_rng(seed)
    model = random_plant(rng)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(samples, model.n_inputs)), rng, corners=True)
    units = Units.random(rng, model, most)
    start = HPolytope.box(x0 - rng.uniform(0.1, 1.0), x0 + rng.uniform(0.1, 1.0))
    return units.model(model), units.set("x", start), units.log(log)


def check_healthy(make: Callable[..., Any], first: int, count: int, samples: int) -> None:
    for seed in range(first, first + count):
        model, start, log = plant_in_units(seed, samples)
        run = make(model, start).run(log)
        assert "falsified" not in run.verdicts, seed
        size = np.maximum(np.abs(run.lower), np.abs(run.upper)).max(axis=0)
        room = 1e-11 * size  # the simulation rounds
        assert (run.lower - room <= log.x).all(), seed
        assert (log.x <= run.upper + room).all(), seed


@pytest.mark.parametrize("make", [WindowObserver, ConstrainedZonotopeObserver])
def test_healthy_plants_in_random_units(make: Any) -> None:
    check_healthy(make, 0, 10 if make is WindowObserver else 4, 12)


@pytest.mark.slow
@pytest.mark.parametrize("make", [WindowObserver, ConstrainedZonotopeObserver])
def test_300_healthy_plants_in_random_units(make: Any) -> None:
    check_healthy(make, 1000, 300, 30 if make is WindowObserver else 12)


def test_hydraulics_in_metres_and_pascals_need_no_wider_bounds_and_do_not_separate_from_themselves() -> None:
    model, start, log = hydraulics(0)
    assert calibrate(model, log, start).widenings == ()
    assert distinguishability(model, model, 4, initial=start).horizon is None


@pytest.mark.parametrize("make", [WindowObserver, ConstrainedZonotopeObserver])
def test_a_log_that_is_cut_anywhere_goes_on_bit_for_bit(make: Any) -> None:
    model, start, log = plant_in_units(3, 10)
    whole = make(model, start).run(log)
    for cut in (1, 5, 8):
        observer = make(model, start)
        for step in islice(drive(observer, log), cut):
            _ = step.box  # reading it leaves a basis behind
        again = make.from_state_dict(model, observer.state_dict())
        for k, step in enumerate(drive(again, log, start=cut), cut):
            lower, upper = step.box
            assert same(lower, whole.lower[k])
            assert same(upper, whole.upper[k])


def test_units_change_nothing_of_a_bank() -> None:
    model, start, log = hydraulics(1)
    units = Units(np.array([30, -25]), np.zeros(0, dtype=int), np.array([-40, 17]), np.array([5, -60]))
    y = log.y.copy()
    y[12:, 0] += 2e-3
    logs = replace(log, y=y), units.log(replace(log, y=y))
    answers = []
    for m, P, data in ((model, start, logs[0]), (units.model(model), units.set("x", start), logs[1])):
        faulty = m.replace(n=m.bounds()[2] * np.array([400.0, 1.0]))
        bank = ArchitectureI(nominal=WindowObserver(m, P), faults={"gauge": WindowObserver(faulty, P)})
        verdicts = drive(bank, data)
        answers.append([(v.state, v.fault, v.alive, v.detected_at, v.isolated_at) for v in verdicts])
    assert answers[0] == answers[1]
    assert answers[0][-1][0] == "isolated"


@pytest.mark.parametrize("seed", range(20))
def test_products_of_integers_leave_nothing_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    item = np.outer(rng.integers(-(2**20), 2**20, 5), rng.integers(-(2**20), 2**20, 7)) * 2.0 ** rng.integers(-9, 9)
    assert channel_count(item) == 1
    *_, left, complete = channel_factors(np.stack([item, item]), np.array([1]), np.array([[-1.0, 1.0]]))
    assert complete
    assert not left.any()


@pytest.mark.parametrize("seed", range(10))
def test_what_channels_leave_out_is_bounded_from_above_and_closely(seed: int) -> None:
    rng = np.random.default_rng(seed)
    item = rng.normal(size=(5, 2)) @ rng.normal(size=(2, 6))
    owner = np.ones(channel_count(item), dtype=np.int64)
    delta = np.tile([[-0.5, 2.0]], (len(owner), 1))
    stack = np.stack([item, item])
    *_, left, complete = channel_factors(stack, owner, delta)
    channels = channels_of(stack, owner, delta, None)
    assert channels is not None
    found = factors_of(stack, owner, delta, channels)
    assert complete
    assert found is not None
    exact = np.zeros(item.shape)
    for i, j, value in found.rest:
        exact[i, j] = float(int(value.p) / int(value.q))
    assert (exact <= left).all()
    assert (left <= 1.001 * exact + 1e-30).all()
    assert left.max() < 1e-14


def run_at(observer: Any, schedule: float) -> None:
    for _ in range(2):  # the matrices of a sample drive the next one
        observer.step(None, [0.0, 0.0], schedule=schedule)


def test_an_uncertainty_that_gains_a_rank_at_a_sample_is_refused_or_covered() -> None:
    """The second direction grows with the schedule: small enough it is a disturbance, larger it is an error."""

    def A1(s: float) -> np.ndarray:
        return np.array([[0.2, 0.0], [0.0, s]])

    model = UncertainModel(
        0.5 * np.eye(2), None, np.eye(2), E=np.eye(2), w=[0.1, 0.1], n=[0.1, 0.1], schedule=0.0,
        uncertainties=[Uncertainty(A=A1)],
    )  # fmt: skip
    for make in (WindowObserver, ConstrainedZonotopeObserver):
        observer = make(model, HPolytope.box([-1, -1], [1, 1]))
        observer.update([0.0, 0.0], schedule=1e-14)
        assert observer.step(None, [0.0, 0.0], schedule=1e-14).verdict == "consistent"
        with pytest.raises(ValueError, match="higher rank"):
            run_at(observer, 0.1)
