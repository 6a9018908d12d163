"""Measurements that reach a bank after their sample: the bank that had them in time is never contradicted."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from small_plant import START, TS, faults_of, fly, plant

from polytopes import HPolytope
from svo import ArchitectureI, ArchitectureII, ConstrainedZonotopeObserver, WindowObserver
from svo.faults import Ramp, Step
from svo.isolation.bank import Bank
from svo.isolation.record import Verdict
from svo.logs.drive import advance
from svo.logs.log import Log
from svo.models.model import UncertainModel

few = settings(max_examples=10, deadline=None)
DELAY = 2


def bank_one(nominal: UncertainModel, faults: dict[str, Any], horizon: int | None = 4, **options: Any) -> ArchitectureI:
    first = HPolytope.box(np.full(2, -0.5), np.full(2, 0.5))
    observers = {name: WindowObserver(fault.model(nominal), first, horizon=horizon) for name, fault in faults.items()}
    return ArchitectureI(WindowObserver(nominal, first, horizon=horizon), observers, **options)


def bank_two(nominal: UncertainModel, faults: dict[str, Any], **options: Any) -> ArchitectureII:
    first = HPolytope.box(np.full(2, -0.5), np.full(2, 0.5))
    observers = {name: WindowObserver(fault.model(nominal), first, horizon=4) for name, fault in faults.items()}
    wide = nominal.replace(w=np.full(2, 20.0), n=np.full(2, 3.0))  # contains every fault of these tests
    return ArchitectureII(
        WindowObserver(nominal, first, horizon=4), observers, WindowObserver(wide, first, horizon=4), **options
    )


def take(bank: Bank, log: Log, k: int, late: bool) -> Verdict:
    """Sample k; with ``late``, its second sensor comes after DELAY more samples."""
    y = np.where([False, late], np.nan, log.y[k])
    verdict = advance(bank, log.u[k - 1] if k else None, y, log.u[k], None)
    taken = k - DELAY
    if late and taken >= 0:
        verdict = bank.late_update([np.nan, log.y[taken, 1]], taken)
    return verdict


@few
@given(seed=st.integers(0, 2**32 - 1), horizon=st.sampled_from([4, None]), ramp=st.booleans())
@example(seed=2010, horizon=4, ramp=False)
def test_a_bank_with_late_data_says_what_one_with_data_in_time_says(seed: int, horizon: int | None, ramp: bool) -> None:
    rng = np.random.default_rng(seed)
    nominal = plant(rng)
    faults = faults_of(rng, 2, Ramp(START, 1.0) if ramp else Step(START))
    log = fly(nominal, faults["bias"], np.zeros(2), rng, samples=24)
    in_time, delayed = bank_one(nominal, faults, horizon), bank_one(nominal, faults, horizon)
    for k in range(len(log)):
        early, late = take(in_time, log, k, late=False), take(delayed, log, k, late=True)
        assert set(early.alive) <= set(late.alive)
        assert "bias" in late.alive
        for name in early.steps.keys() & late.steps.keys():
            if early.steps[name].verdict == "consistent":
                (lower, upper), (low, high) = early.steps[name].box, late.steps[name].box
                assert (low <= lower + 1e-6).all()  # the slack of rows grows with what is known of the state
                assert (high >= upper - 1e-6).all()
    for k in range(len(log) - DELAY, len(log)):
        late = delayed.late_update([np.nan, log.y[k, 1]], k)
    if horizon is None:  # nothing was lost to an arrival set
        assert late.alive == early.alive


@few
@given(seed=st.integers(0, 2**32 - 1), debounce=st.sampled_from([1, 2]))
def test_the_true_fault_of_a_bank_with_a_global_observer_is_never_ruled_out(seed: int, debounce: int) -> None:
    rng = np.random.default_rng(seed)
    nominal, faults = plant(rng), faults_of(rng, 2, Step(START))
    for true in ("bias", "hard-over"):
        log = fly(nominal, faults[true], np.zeros(2), rng, samples=24)
        bank = bank_two(nominal, faults, debounce=debounce, recovery=30)
        for k in range(len(log)):
            verdict = take(bank, log, k, late=True)
            assert true in verdict.alive
            assert verdict.state != "unexplained"
            assert verdict.detected_at is None or verdict.detected_at >= round(START / TS)
            lower, upper = bank._global_set.bounding_box()  # type: ignore[union-attr]
            assert log.x is not None
            assert (lower - 1e-9 <= log.x[k]).all()
            assert (log.x[k] <= upper + 1e-9).all()


def test_late_data_alone_detect_and_isolate_at_the_newest_sample() -> None:
    rng = np.random.default_rng(1)
    nominal, faults = plant(rng), faults_of(rng, 2, Step(START))
    chosen = {"bias": faults["bias"], "hard": faults["hard"]}
    log = fly(nominal, faults["hard"], np.zeros(2), rng, samples=16)
    bank = bank_one(nominal, chosen)
    for k in range(len(log)):
        y = np.where([False, k >= 10], np.nan, log.y[k])
        verdict = advance(bank, log.u[k - 1] if k else None, y, log.u[k], None)
    assert verdict.state == "nominal"
    for k in range(12, 16):
        verdict = bank.late_update([np.nan, log.y[k, 1]], k)
    assert (verdict.state, verdict.fault, verdict.sample) == ("isolated", "hard", 15)
    assert verdict.detected_at == verdict.isolated_at == 15
    assert verdict.steps["hard"].verdict == "consistent"


@pytest.mark.parametrize("make", [bank_one, bank_two])
def test_a_late_outlier_is_debounced_and_counts_no_sample_twice(make: Any) -> None:
    rng = np.random.default_rng(2)
    nominal, faults = plant(rng), faults_of(rng, 2, Step(START))
    log = fly(nominal, None, np.zeros(2), rng, samples=20)
    bank = make(nominal, {"loss": faults["loss"]}, debounce=2, recovery=5)
    for k in range(8):
        verdict = take(bank, log, k, late=False)
    late = bank.step(log.u[7], [log.y[8, 0], np.nan], u_next=log.u[8])
    late = bank.late_update([np.nan, log.y[8, 1] + 1.5], 8)  # beyond the noise of the models, not of the global one
    assert late.steps["nominal"].verdict == "falsified"
    assert late.state == "nominal"
    assert bank._state.tallies[0].falsified == 1
    assert bank._state.tallies[0].consistent == 0
    for k in range(9, 13):
        verdict = take(bank, log, k, late=False)
        lower, upper = verdict.steps["nominal"].box
        assert log.x is not None
        assert (lower <= log.x[k] + 1e-9).all()
        assert (log.x[k] <= upper + 1e-9).all()
    again = bank.late_update([np.nan, np.nan], 12)  # nothing new
    assert again.state == verdict.state == "nominal"
    assert bank._state.tallies[0].consistent == 4
    take(bank, log, 13, late=False)
    assert bank._state.tallies[0].falsified == 0


def test_a_saved_bank_goes_on_bit_for_bit_with_late_data() -> None:
    rng = np.random.default_rng(3)
    nominal, faults = plant(rng), faults_of(rng, 2, Step(START))
    log = fly(nominal, faults["bias"], np.zeros(2), rng, samples=24)
    first, second = bank_two(nominal, faults, recovery=8), bank_two(nominal, faults, recovery=8)
    for k in range(13):
        take(first, log, k, late=True)
    second.load_state_dict(first.state_dict())
    for k in range(13, 24):
        one, two = take(first, log, k, late=True), take(second, log, k, late=True)
        assert (one.state, one.alive, one.detected_at) == (two.state, two.alive, two.detected_at)
        for name, step in one.steps.items():
            np.testing.assert_array_equal(step.box, two.steps[name].box)


def test_what_does_not_fit_is_named_and_changes_nothing() -> None:
    rng = np.random.default_rng(4)
    nominal, faults = plant(rng), faults_of(rng, 2, Step(START))
    log = fly(nominal, None, np.zeros(2), rng, samples=20)
    bank = bank_one(nominal, {"loss": faults["loss"]})
    with pytest.raises(ValueError, match="late_update was called before the first measurement"):
        bank.late_update(log.y[0], 0)
    for k in range(12):
        take(bank, log, k, late=False)
    before = bank.state_dict()
    for y, sample, message in (
        (log.y[2], 2, "in the window of a running observer"),
        (log.y[11], 12, "in the window of a running observer"),
        (log.y[11], 11.0, "expected the number of a sample"),
        (log.y[11], 11, "observer 'nominal': y has a value of sensor 0, which was already read at 11"),
        ([np.nan], 11, "observer 'nominal': y has shape"),
        ([np.nan, np.inf], 11, "observer 'nominal': y is"),
    ):
        with pytest.raises(ValueError, match=message):
            bank.late_update(y, sample)  # type: ignore[arg-type]
    after = bank.state_dict()
    assert all(np.array_equal(before[key], after[key], equal_nan=before[key].dtype.kind == "f") for key in before)
    assert take(bank, log, 12, late=False).state == "nominal"

    box = HPolytope.box(np.full(2, -0.5), np.full(2, 0.5))
    mixed = ArchitectureI(WindowObserver(nominal, box), {"loss": ConstrainedZonotopeObserver(nominal, box)})
    mixed.update(log.y[0], u=log.u[0])
    with pytest.raises(TypeError, match="observer 'loss' \\(ConstrainedZonotopeObserver\\) takes no measurements that"):
        mixed.late_update([np.nan, np.nan], 0)


def test_a_measurement_that_comes_twice_is_refused_before_any_observer_changes() -> None:
    """An observer that started again at this very sample has not read it, the others have."""
    rng = np.random.default_rng(2)
    nominal = plant(rng)
    log = fly(nominal, None, np.zeros(2), rng, samples=12)
    first = HPolytope.box(np.full(2, -0.5), np.full(2, 0.5))
    wide = WindowObserver(nominal.replace(w=np.full(2, 20.0), n=np.full(2, 3.0)), first, horizon=4)
    bank = ArchitectureI(WindowObserver(nominal, first, horizon=4), {"wide": wide}, debounce=2, recovery=5)
    log.y[8, 1] += 1.5
    for k in range(9):
        verdict = take(bank, log, k, late=False)
    assert verdict.steps["nominal"].verdict == "falsified"
    with pytest.raises(ValueError, match="observer 'wide': y has a value of sensor 1, which was already read at 8"):
        bank.late_update([np.nan, log.y[8, 1]], 8)
    assert take(bank, log, 9, late=False).steps["wide"].verdict == "consistent"
