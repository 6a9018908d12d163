"""Long gaps in the measurements, and numbers that overflow: an observer that has lost its set says so, and finds it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver, prove_chain
from svo.logs.log import Log
from tests.svo.observers.gap_plants import after_a_gap, answers, blind, rotation, start, unstable

HORIZONS = (1, 3, 10, None)


def lost(model: UncertainModel, horizon: int | None, **options: Any) -> WindowObserver:
    """An observer whose set is gone: by an input that no float can follow, then by nothing read."""
    observer = WindowObserver(model, start(model), horizon=horizon, **options)
    observer.update(np.full(model.n_outputs, np.nan))
    observer._known.lose()
    return observer


@pytest.mark.parametrize(("model", "samples"), [(rotation(), 2600), (unstable(), 15_000)])
def test_a_set_that_outgrows_all_bounds_is_undecided_until_the_readings_bound_the_state(
    model: UncertainModel, samples: int
) -> None:
    """Blind for ever by sample 2450 and 14 550 before; y = 1e6 was "consistent"."""
    observer = WindowObserver(model, start(model))
    observer.update([np.nan])
    step = blind(observer, samples)
    assert (step.verdict, step.reason) == ("undecided", "outgrown")
    assert np.array_equal(step.box, [np.full(model.n_states, -np.inf), np.full(model.n_states, np.inf)])
    assert step.set.contains(np.full(model.n_states, 1e250))
    assert np.isposinf(step.support(np.eye(model.n_states))).all()
    x, y = after_a_gap(model, np.random.default_rng(0), 10)
    for k, outputs in enumerate(y):
        step = observer.step(None, outputs)
        lower, upper = step.box
        assert (lower <= x[k]).all()
        assert (x[k] <= upper).all()
        assert (step.verdict, step.reason) == (
            ("consistent", None) if k + 1 >= model.n_states else ("undecided", "outgrown")
        )
    assert step.sample == samples + 10
    assert observer.step(None, [1e6]).verdict == "falsified"


@pytest.mark.parametrize("horizon", HORIZONS)
def test_readings_that_contradict_each_other_after_a_gap_are_an_alarm_without_any_set(horizon: int | None) -> None:
    observer = lost(rotation(), horizon)
    steps = list(answers_after(observer, [[1e6], [0.0], [0.0], [0.0]]))
    assert steps[0].reason == "outgrown"
    last = steps[-1]
    assert last.verdict == "falsified"
    assert last.certificate.verify()
    assert last.certificate.arrival.is_unknown == (horizon != 1)  # a window of one step has left the first readings


def answers_after(observer: WindowObserver, outputs: Any) -> Any:
    for y in outputs:
        step = observer.step(None, y)
        yield step
        if step.verdict == "falsified":
            return


def test_a_certificate_by_readings_alone_needs_its_readings() -> None:
    from dataclasses import replace

    certificate = list(answers_after(lost(rotation(), 5), [[1e6], [0.0], [0.0], [0.0]]))[-1].certificate
    first = certificate.samples[0]
    unread = replace(first, y=np.full(1, np.nan), on_output=np.zeros(1))
    assert not replace(certificate, samples=(unread, *certificate.samples[1:])).verify()
    healthy = replace(first, y=np.zeros(1))
    assert not replace(certificate, samples=(healthy, *certificate.samples[1:])).verify()


@pytest.mark.parametrize("horizon", HORIZONS)
def test_an_input_that_overflows_is_no_silent_blindness(horizon: int | None) -> None:
    model = UncertainModel([[0.9, 0.1], [0.0, 0.8]], [[0.0], [1.0]], [[1.0, 0.0]], E=np.eye(2), w=[0.1, 0.1], n=0.05)
    u = np.zeros((30, 1))
    u[12] = 1.7e308
    observer = WindowObserver(model, start(model), horizon=horizon)
    steps = []
    for step in answers(observer, np.zeros((30, 1)), u):
        steps.append((step.verdict, step.reason))
        assert not np.isnan(step.box).any()
    assert steps[13] == ("undecided", "outgrown")
    assert set(steps[:13] + steps[14:]) == {("consistent", None)}
    assert np.subtract(*step.box[::-1]).max() < 3.0
    assert observer.step([0.0], [1e6]).verdict == "falsified"


@pytest.mark.parametrize("size", [1e6, 1e30, 1e154, 1e308, -1.7e308])
@pytest.mark.parametrize("horizon", HORIZONS)
def test_an_enormous_reading_is_falsified_by_a_set_and_ignored_without_one(horizon: int | None, size: float) -> None:
    observer = WindowObserver(rotation(), start(rotation()), horizon=horizon)
    observer.update([0.0])
    step = observer.step(None, [size])
    assert step.verdict == "falsified"
    assert step.certificate.verify()
    blank = lost(rotation(), horizon)
    first = blank.step(None, [size])
    assert first.verdict == "undecided"
    for step in answers_after(blank, [[0.0]] * 4):
        assert step.verdict == "falsified" or not np.isnan(step.box).any()
    assert (step.verdict == "falsified") == (abs(size) < 1e29)  # beyond 2^100 a reading is of no use


def test_a_feedthrough_that_overflows_the_reading_is_undecided() -> None:
    model = UncertainModel([[0.9]], [[0.0]], [[1.0]], D=[[4.0]], n=0.1)
    observer = WindowObserver(model, start(model))
    observer.update([0.0], [0.0])
    step = observer.step([0.0], [0.0], [1e308])
    assert (step.verdict, step.reason) == ("undecided", "outgrown")
    assert observer.step([1e308], [0.0], [0.0]).verdict == "consistent"


@pytest.mark.parametrize("horizon", HORIZONS)
def test_a_state_saved_in_a_gap_goes_on_bit_for_bit(horizon: int | None) -> None:
    model = rotation()
    _, y = after_a_gap(model, np.random.default_rng(1), 20)
    y[[3, 4, 9]] = np.nan
    once = lost(model, horizon)
    whole = [observer_bits(once.step(None, outputs)) for outputs in y]
    again = lost(model, horizon)
    for k, outputs in enumerate(y):
        again = WindowObserver.from_state_dict(model, again.state_dict())
        assert observer_bits(again.step(None, outputs)) == whole[k]


def observer_bits(step: Any) -> tuple[Any, ...]:
    return step.sample, step.verdict, step.reason, np.array(step.box).tobytes()


def test_a_late_measurement_counts_where_the_set_is_lost() -> None:
    model, rng = rotation(), np.random.default_rng(2)
    x, y = after_a_gap(model, rng, 6)
    observer = lost(model, 5)
    observer.step(None, [np.nan])
    observer.step(None, y[1])
    assert observer.window == (1, 2)
    step = observer.late_update(y[0], 1)
    assert step.verdict == "consistent"
    assert (step.box[0] <= x[1]).all()
    assert (x[1] <= step.box[1]).all()
    with pytest.raises(ValueError, match="already read"):
        observer.late_update(y[0], 1)


def test_a_bad_sample_leaves_a_lost_observer_unchanged() -> None:
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=0.1)
    observer = WindowObserver(model, start(model))
    observer.update([0.0])
    observer._known.lose()
    before = {name: value.tobytes() for name, value in observer.state_dict().items()}
    for u, y in (([np.nan], [0.0]), ([0.0], [np.inf]), ([0.0, 1.0], [0.0])):
        with pytest.raises(ValueError, match="expected"):
            observer.step(u, y)
    assert before == {name: value.tobytes() for name, value in observer.state_dict().items()}


def test_a_deadline_in_a_gap() -> None:
    observer = WindowObserver(rotation(), start(rotation()))
    observer.update([np.nan])
    for _ in range(1500):
        step = observer.step(None, [np.nan], deadline=1e-6)
    assert step.reason == "outgrown"
    observer.step(None, [0.0], deadline=1e-6)
    assert observer.step(None, [0.0], deadline=1.0).verdict == "consistent"


# -- the largest set and the physical range --------------------------------------------------------------------------


def run(model: UncertainModel, y: Any, horizon: int | None = 10) -> tuple[Log, WindowObserver, list[Any]]:
    observer = WindowObserver(model, start(model), horizon=horizon)
    log = Log(np.arange(float(len(y))), np.zeros((len(y), 0)), np.array(y, dtype=float))
    steps = []
    for step in answers(observer, log.y):
        steps.append(step)
        if step.verdict == "falsified":
            break
    return log, WindowObserver(model, start(model), horizon=horizon), steps


def test_the_largest_set_is_where_a_set_starts_again_and_a_premise_of_the_alarm() -> None:
    model = unstable(2.0, largest=(-5.0, 5.0))
    y = [[np.nan]] * 103 + [[1e4]]
    log, observer, steps = run(model, y)
    assert {step.verdict for step in steps[:-1]} == {"consistent"}
    last = steps[-1]
    assert last.verdict == "falsified"
    at = last.certificate.largest_at
    assert at is not None
    assert 95 < at <= 102
    chain = prove_chain(observer, log)
    assert chain.proven
    assert chain.given == (f"the largest set at sample {at}, where the set started again",)


def test_a_state_outside_the_largest_set_may_be_a_false_alarm_and_the_premise_is_stated() -> None:
    """The promise is broken: the unstable plant has left the largest set in the gap."""
    model = unstable(2.0, largest=(-5.0, 5.0))
    observer = WindowObserver(model, start(model))
    truth = np.array([0.5])
    observer.update(truth)
    for _ in range(102):
        truth = 2.0 * truth + 0.1
        observer.step(None, [np.nan])
    assert observer.largest_at is not None
    step = observer.step(None, 2.0 * truth)
    assert step.verdict == "falsified"
    assert step.certificate.largest_at == observer.largest_at
    assert step.certificate.verify()


def test_readings_that_bound_the_state_make_the_premise_unnecessary() -> None:
    model = unstable(largest=(-5.0, 5.0))
    observer = WindowObserver(model, start(model))
    observer.update([np.nan])
    blind(observer, 2000)
    _, y = after_a_gap(model, np.random.default_rng(0), 5)
    for outputs in y:
        step = observer.step(None, outputs)
    assert observer.largest_at is None
    assert np.subtract(*step.box[::-1]).max() < 0.11


@pytest.mark.parametrize("horizon", HORIZONS[:-1])
def test_the_physical_range_cuts_every_set(horizon: int) -> None:
    model = rotation(physical=(-3.0, [np.inf, 4.0]))
    observer = WindowObserver(model, HPolytope.box([-9.0, -1.0], [9.0, 9.0]), horizon=horizon)
    for step in answers(observer, [[np.nan]] * 300):
        lower, upper = step.box
        assert (lower >= -3.0).all()
        assert upper[1] <= 4.0
        assert np.isfinite(upper).all()
        assert (step.support(-np.eye(2)) <= 3.0).all()
        assert not step.set.contains(np.array([0.0, 4.1]))
    assert step.verdict == "consistent"
    assert observer.step(None, [1e6]).verdict == "falsified"


def test_the_physical_range_is_a_premise_of_the_chain() -> None:
    model = rotation(physical=(-20.0, 20.0))
    log, observer, steps = run(model, [[np.nan]] * 60 + [[1e6]])
    assert steps[-1].verdict == "falsified"
    chain = prove_chain(observer, log)
    assert chain.proven
    assert chain.given == ("the physical range",)


def test_data_outside_the_physical_range_are_no_alarm_without_a_proof() -> None:
    """x+ = x + w reads more and more: healthy by the model, outside the range, and no window proves it."""
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[1.0]], w=[0.2], n=0.1, physical=(-2.0, 0.5))
    observer = WindowObserver(model, start(model), horizon=3)
    steps = list(answers(observer, [[0.2 * k] for k in range(12)]))
    assert any(step.reason == "outside the physical range" for step in steps)
    assert all(step.verdict != "falsified" or step.certificate.verify() for step in steps)


def test_first_states_outside_the_physical_range_are_refused() -> None:
    with pytest.raises(ValueError, match="physical range"):
        WindowObserver(rotation(physical=(2.0, 3.0)), start(rotation()))


@pytest.mark.parametrize("uncertain", [False, True])
def test_with_and_without_a_gap_the_sets_are_alike_soon_after(uncertain: bool) -> None:
    """Ten samples and the states after the return: at most 1 % wider, the state inside at every sample."""
    rng, done = np.random.default_rng(5), 0
    while done < 6:
        n = int(rng.integers(1, 4))
        A = rng.normal(size=(n, n))
        A *= rng.uniform(0.6, 1.05) / np.abs(np.linalg.eigvals(A)).max()
        C = rng.normal(size=(int(rng.integers(1, n + 1)), n))
        observability = np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(n)])
        if np.linalg.cond(observability) > 1e4:
            continue
        done += 1
        Delta = [Uncertainty(A=0.01 * np.outer(rng.normal(size=n), rng.normal(size=n)))] if uncertain else []
        model = UncertainModel(A, None, C, E=np.eye(n), w=np.full(n, 0.1), n=0.05, uncertainties=Delta)
        x, y = after_a_gap(model, rng, 40 + 10 + n, corners=False)
        without, gone = WindowObserver(model, start(model)), WindowObserver(model, start(model))
        without.update(y[0])
        gone.update(y[0])
        for k in range(1, len(y)):
            if k == 40:
                gone._known.lose()
            a, b = without.step(None, y[k]), gone.step(None, y[k])
            assert (b.box[0] <= x[k]).all()
            assert (x[k] <= b.box[1]).all()
        width, reference = np.subtract(*b.box[::-1]), np.subtract(*a.box[::-1])
        assert (width <= 1.01 * reference).all(), (n, width / reference)
