"""Architecture I with window observers and fault objects: what must hold on every plant that keeps its bounds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_plant import SAMPLES, START, TS, faults_of, fly, plant

from polytopes import HPolytope
from svo.faults import Intermittent, Ramp, Step
from svo.isolation.architectures import ArchitectureI
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.model import UncertainModel
from svo.observers.window.observer import WindowObserver

few = settings(max_examples=15, deadline=None)


def bank(nominal: UncertainModel, faults: dict[str, Any], x0: np.ndarray, **options: Any) -> ArchitectureI:
    first = HPolytope.box(x0 - 0.1, x0 + 0.1)
    observers = {name: WindowObserver(fault.model(nominal), first, horizon=4) for name, fault in faults.items()}
    return ArchitectureI(WindowObserver(nominal, first, horizon=4), observers, **options)


@few
@given(seed=st.integers(0, 2**32 - 1), ramp=st.booleans())
def test_the_true_fault_is_never_ruled_out(seed: int, ramp: bool) -> None:
    rng = np.random.default_rng(seed)
    nominal = plant(rng, n := int(rng.integers(1, 4)))
    faults = faults_of(rng, n, Ramp(START, 1.0) if ramp else Step(START))
    x0 = rng.uniform(-1, 1, n)
    for true in (None, *faults):
        log = fly(nominal, faults.get(true), x0, rng)
        record = bank(nominal, faults, x0).run(log)
        if true is None:
            assert record.states == ("nominal",) * SAMPLES
            assert record.alive.all()
            continue
        assert record.died_at[true] is None
        assert record.fault in (None, true)
        assert "unexplained" not in record.states
        if record.detected_at is not None:
            assert record.detected_at >= round(START / TS)
            assert record.certificates["nominal"].verify()


def test_a_large_bias_is_isolated_at_its_first_sample_and_the_dead_rest() -> None:
    rng = np.random.default_rng(1)
    nominal, x0 = plant(rng), np.zeros(2)
    faults = faults_of(rng, 2, Step(START))
    record = bank(nominal, {k: faults[k] for k in ("bias", "loss")}, x0).run(fly(nominal, faults["bias"], x0, rng))
    assert (record.detected_at, record.isolated_at, record.fault) == (10, 10, "bias")
    assert np.isnan(record.seconds[11:, [0, 2]]).all()
    assert np.isfinite(record.seconds[:, 1]).all()


def outlier_case() -> tuple[UncertainModel, dict[str, Any], Log]:
    """A healthy run in which one sample of both sensors is far outside the noise, so that no model explains it."""
    rng = np.random.default_rng(2)
    nominal = plant(rng)
    faults = {k: v for k, v in faults_of(rng, 2, Step(START)).items() if k in ("bias", "loss")}
    log = fly(nominal, None, np.zeros(2), rng)
    y = log.y.copy()
    y[15] += [5.0, -5.0]
    return nominal, faults, replace(log, y=y)


def test_one_outlier_is_an_alarm_without_debounce() -> None:
    nominal, faults, log = outlier_case()
    record = bank(nominal, faults, np.zeros(2)).run(log)
    assert record.states[14:16] == ("nominal", "unexplained")
    assert record.states[-1] == "unexplained"


@pytest.mark.parametrize("options", [{"debounce": 2}, {"debounce": 2, "recovery": 5}])
def test_one_outlier_is_forgiven_with_debounce(options: dict[str, int]) -> None:
    nominal, faults, log = outlier_case()
    b = bank(nominal, faults, np.zeros(2), **options)
    for k, verdict in enumerate(drive(b, log)):
        assert verdict.state == "nominal"
        falsified = {name for name, step in verdict.steps.items() if step.verdict == "falsified"}
        assert falsified == (set(b.names) if k == 15 else set())
        if k != 15:
            for step in verdict.steps.values():
                lower, upper = step.box
                assert (lower - 1e-9 <= log.x[k]).all()
                assert (upper + 1e-9 >= log.x[k]).all()


def test_one_outlier_is_over_after_the_recovery() -> None:
    nominal, faults, log = outlier_case()
    record = bank(nominal, faults, np.zeros(2), recovery=5).run(log)
    assert record.states == ("nominal",) * 15 + ("unexplained",) * 5 + ("nominal",) * 20
    assert record.alive[-1].all()


def test_debounce_still_finds_a_fault() -> None:
    nominal, faults, _ = outlier_case()
    rng = np.random.default_rng(3)
    log = fly(nominal, faults["bias"], np.zeros(2), rng)
    record = bank(nominal, faults, np.zeros(2), debounce=3, recovery=10).run(log)
    assert record.fault == "bias"
    assert record.died_at["bias"] is None
    assert record.detected_at is not None
    assert record.detected_at >= 12


def test_an_intermittent_fault_comes_and_goes() -> None:
    nominal, faults, _ = outlier_case()
    rng = np.random.default_rng(4)
    on_off = replace(faults["bias"], profile=Intermittent(START, 2.0, duty=0.5))
    log = fly(nominal, on_off, np.zeros(2), rng, samples=60)
    record = bank(nominal, faults, np.zeros(2), recovery=4).run(log)
    assert record.died_at["bias"] is None
    for k, state in enumerate(record.states):
        phase = (k - 10) % 20
        if k < 10 or phase >= 14:
            assert state == "nominal"
        elif phase < 10:
            assert state == "isolated"
    assert record.alive[-1].sum() == (3 if record.states[-1] == "nominal" else 1)
