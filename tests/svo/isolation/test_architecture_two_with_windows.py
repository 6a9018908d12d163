"""Architecture II with window observers: a global model that has all faults' uncertainties."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_plant import SAMPLES, START, faults_of, fly, plant

from polytopes import HPolytope
from svo.faults import ActuatorFault, Intermittent, SensorFault, Step
from svo.isolation.architectures import ArchitectureI, ArchitectureII
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.model import UncertainModel
from svo.observers.window.observer import WindowObserver

HARD_OVER = 2.0
AT_DETECTION = round(START / 0.1)
X0 = np.zeros(2)


def class_two_models(nominal: UncertainModel) -> dict[str, UncertainModel]:
    """An actuator that is hard over and a sensor that is dead: no command, no state gets through."""
    B, C = nominal.block("B"), nominal.block("C").copy()
    C[0] = 0.0
    return {"hard-over": nominal.replace(B=0 * B, a=HARD_OVER * B[:, 0]), "dead": nominal.replace(C=C)}


def faults(profile: Any) -> dict[str, Any]:
    return {
        "bias": SensorFault(1, "bias", 0.8, profile),
        "hard-over": ActuatorFault(0, "hard-over", HARD_OVER, profile),
        "dead": SensorFault(0, "hard", 0.0, profile),
    }


def global_model(nominal: UncertainModel) -> UncertainModel:
    """Every fault of any size, at once."""
    model = nominal
    for name in ("hard-over", "bias", "dead"):
        model = faults(Step(START))[name].model(model)
    return model


def bank(nominal: UncertainModel, x0: np.ndarray = X0, constant: bool = False, **options: Any) -> ArchitectureII:
    first = HPolytope.box(x0 - 0.1, x0 + 0.1)
    models = {"bias": faults(Step(START))["bias"].model(nominal), **class_two_models(nominal)}
    observers = {name: WindowObserver(model, first, horizon=4) for name, model in models.items()}
    far = HPolytope.box([-50.0, -50.0], [50.0, 50.0])
    watch = far if constant else WindowObserver(global_model(nominal), first, horizon=4)
    return ArchitectureII(
        WindowObserver(nominal, first, horizon=4), observers, global_=watch, class_one=("bias",), **options
    )


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), constant=st.booleans())
def test_the_true_fault_is_never_ruled_out(seed: int, constant: bool) -> None:
    rng = np.random.default_rng(seed)
    nominal, x0 = plant(rng), rng.uniform(-1, 1, 2)
    for true in (None, *faults(Step(START))):
        log = fly(nominal, faults(Step(START)).get(true), x0, rng)
        record = bank(nominal, x0, constant).run(log)
        if true is None:
            assert record.states == ("nominal",) * SAMPLES
            assert np.isnan(record.seconds[:, 2:]).all()
            continue
        assert record.died_at[true] is None
        assert record.died_at.get("global") is None
        assert record.fault in (None, true)
        assert "unexplained" not in record.states
        if record.detected_at is not None:
            assert record.detected_at >= AT_DETECTION
            assert all(certificate is None or certificate.verify() for certificate in record.certificates.values())


@pytest.mark.parametrize("true", ["bias", "hard-over", "dead"])
def test_each_fault_is_isolated(true: str) -> None:
    rng = np.random.default_rng(1)
    nominal = plant(rng)
    record = bank(nominal).run(fly(nominal, faults(Step(START))[true], X0, rng))
    assert (record.fault, record.states[-1]) == (true, "isolated")


def test_the_global_set_contains_the_state_whatever_the_fault() -> None:
    rng = np.random.default_rng(2)
    nominal = plant(rng)
    log = fly(nominal, faults(Step(START))["hard-over"], X0, rng)
    b = bank(nominal)
    for k, verdict in enumerate(drive(b, log)):
        for name in {"global", "hard-over"} & set(verdict.steps):
            lower, upper = verdict.steps[name].box
            assert (lower - 1e-9 <= log.x[k]).all()
            assert (upper + 1e-9 >= log.x[k]).all()
        assert ("hard-over" in verdict.steps) == (verdict.state != "nominal")


def with_outlier(nominal: UncertainModel, size: float, seed: int = 3) -> Log:
    """A healthy run with exactly one sample of the second sensor that is wrong."""
    log = fly(nominal, None, X0, np.random.default_rng(seed))
    y = log.y.copy()
    y[15, 1] += size
    return replace(log, y=y)


@pytest.mark.parametrize(("size", "without"), [(0.7, "isolated"), (5.0, "unexplained")])
def test_exactly_one_outlier_is_debounced(size: float, without: str) -> None:
    nominal = plant(np.random.default_rng(3))
    log = with_outlier(nominal, size)
    assert bank(nominal).run(log).states[15] == without
    b = bank(nominal, debounce=2)
    for k, verdict in enumerate(drive(b, log)):
        assert (verdict.state, verdict.alive) == ("nominal", b.names)
        assert (verdict.steps["nominal"].verdict == "falsified") == (k == 15)
        if k != 15:
            lower, upper = verdict.steps["nominal"].box
            assert (lower - 1e-9 <= log.x[k]).all()
            assert (upper + 1e-9 >= log.x[k]).all()


def test_debounce_still_finds_a_fault() -> None:
    rng = np.random.default_rng(4)
    nominal = plant(rng)
    record = bank(nominal, debounce=3).run(fly(nominal, faults(Step(START))["hard-over"], X0, rng, samples=80))
    assert record.fault == "hard-over"
    assert record.died_at["hard-over"] is None
    assert record.detected_at is not None
    assert record.detected_at >= AT_DETECTION + 2


def test_data_that_no_model_explains_come_with_the_global_certificate() -> None:
    nominal = plant(np.random.default_rng(3))
    record = bank(nominal).run(with_outlier(nominal, 5.0))
    assert record.states[14:] == ("nominal",) + ("unexplained",) * (SAMPLES - 15)
    assert record.died_at["global"] == 15
    assert record.certificates["global"].verify()


def test_one_outlier_is_over_after_the_recovery() -> None:
    nominal = plant(np.random.default_rng(3))
    record = bank(nominal, recovery=5).run(with_outlier(nominal, 5.0))
    assert record.states == ("nominal",) * 15 + ("unexplained",) * 5 + ("nominal",) * 20
    assert record.alive[-1].all()


def test_an_intermittent_fault_is_recognised_as_over_each_time() -> None:
    rng = np.random.default_rng(5)
    nominal = plant(rng)
    log = fly(nominal, faults(Intermittent(START, 2.0, duty=0.5))["bias"], X0, rng, samples=70)
    record = bank(nominal, recovery=4).run(log)
    assert record.died_at["bias"] is None
    for k, state in enumerate(record.states):
        phase = (k - AT_DETECTION) % 20
        if k < AT_DETECTION or phase >= 15:
            assert state == "nominal"
        elif 1 <= phase < 10:
            assert state in ("detected", "isolated")


def test_a_class_two_fault_that_goes_away_is_recognised() -> None:
    rng = np.random.default_rng(6)
    nominal = plant(rng)
    log = fly(nominal, faults(Intermittent(START, 4.0, duty=0.5))["hard-over"], X0, rng, samples=45)
    record = bank(nominal, recovery=6).run(log)
    assert record.fault == "hard-over"
    assert record.states[AT_DETECTION + 19] == "isolated"
    assert record.states[-1] == "nominal"


def test_both_architectures_agree_where_every_model_is_of_class_one() -> None:
    rng = np.random.default_rng(7)
    nominal = plant(rng)
    chosen = faults_of(rng, 2, Step(START))
    log = fly(nominal, chosen["bias"], X0, rng)
    first = HPolytope.box(X0 - 0.1, X0 + 0.1)
    everything = nominal
    for name in ("plant", "hard-over", "loss", "bias", "hard"):
        everything = chosen[name].model(everything)

    def observers() -> dict[str, WindowObserver]:
        return {name: WindowObserver(fault.model(nominal), first, horizon=4) for name, fault in chosen.items()}

    one = ArchitectureI(WindowObserver(nominal, first, horizon=4), observers()).run(log)
    watch = WindowObserver(everything, first, horizon=4)
    two = ArchitectureII(WindowObserver(nominal, first, horizon=4), observers(), watch, class_one=tuple(chosen)).run(
        log
    )
    assert (one.states, one.died_at) == (two.states, two.died_at)
    np.testing.assert_array_equal(one.alive, two.alive)
