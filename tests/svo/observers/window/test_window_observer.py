"""The window observer as its users meet it: arguments, errors, sets, deadlines, saved state."""

from __future__ import annotations

import io
import itertools
from itertools import islice
from time import process_time
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.observers import window_kernel as kernel
from tests.svo.observers.random_plants import random_plant

BOX = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def cart(**changes: Any) -> UncertainModel:
    arguments: dict[str, Any] = {"E": [[0.0], [0.1]], "w": [0.2], "n": [0.05], "Ts": 0.1}
    return UncertainModel([[1, 0.1], [0, 1]], [[0], [0.1]], [[1, 0]], **(arguments | changes))


def flown(samples: int = 40, seed: int = 0, **changes: Any) -> tuple[UncertainModel, Log]:
    model = cart(**changes)
    rng = np.random.default_rng(seed)
    return model, model.simulate([0.3, -0.2], rng.normal(size=(samples, 1)), rng)


Answer = tuple[str, np.ndarray, np.ndarray]


def run_all(observer: WindowObserver, log: Log, start: int = 0, **step: Any) -> list[Answer]:
    return [(answer.verdict, *answer.box) for answer in drive(observer, log, start=start, **step)]


# -- arguments -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"horizon": 0}, "horizon is 0"),
        ({"horizon": 2.5}, "horizon is 2.5"),
        ({"template": "octagon"}, "template is 'octagon'"),
        ({"template": [[1.0, 0.0, 0.0]]}, r"template has shape \(1, 3\)"),
        ({"eps": -1.0}, "eps is -1.0"),
        ({"initial": HPolytope.box([0.0], [1.0])}, "initial has dimension 1; expected 2"),
        ({"initial": HPolytope.whole_space(2)}, "initial is unbounded"),
        ({"initial": HPolytope.empty(2)}, "initial is empty"),
    ],
)
def test_bad_settings_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        WindowObserver(cart(), **({"initial": BOX} | arguments))


@pytest.mark.parametrize(
    ("u", "y", "message"),
    [
        ([0.0, 0.0], [0.0], r"u has shape \(2,\); expected \(1,\)"),
        (None, [0.0], "u is missing"),
        ([np.nan], [0.0], "u is .*nan.*; expected finite"),
        ([0.0], [0.0, 0.0], r"y has shape \(2,\); expected \(1,\)"),
        ([0.0], [np.inf], "y is .*inf.*; expected finite numbers, or NaN"),
    ],
)
def test_bad_data_are_refused_and_change_nothing(u: Any, y: Any, message: str) -> None:
    model, log = flown()
    observer, twin = (WindowObserver(model, BOX) for _ in range(2))
    run_all(observer, log)
    run_all(twin, log)
    with pytest.raises(ValueError, match=message):
        observer.step(u, y)
    for a, b in zip(observer.step([0.1], [0.2]).box, twin.step([0.1], [0.2]).box, strict=True):
        np.testing.assert_array_equal(a, b)


def test_missing_u_next_and_schedule_are_named() -> None:
    with pytest.raises(ValueError, match="u_next is missing"):
        WindowObserver(cart(D=[[0.5]]), BOX).step([0.0], [0.0])
    scheduled = cart(E=lambda s: [[0.0], [s]], schedule=0.1)
    with pytest.raises(ValueError, match="schedule is missing"):
        WindowObserver(scheduled, BOX).update([0.0])
    with pytest.raises(ValueError, match=r"E contains NaN at \[1, 0\]; expected numbers"):
        WindowObserver(scheduled, BOX).update([0.0], schedule=np.nan)


def test_update_is_for_the_first_sample() -> None:
    observer = WindowObserver(cart(), BOX)
    observer.update([0.0])
    with pytest.raises(ValueError, match="after the first sample"):
        observer.update([0.0])


def test_a_rank_that_rises_is_an_error() -> None:
    model = cart(schedule=0.0, uncertainties=[Uncertainty(A=lambda s: [[0.1, 0.0], [0.0, s]])])
    observer = WindowObserver(model, BOX)
    observer.update([0.0], schedule=0.0)
    observer.step([0.0], [0.0], schedule=0.5)
    with pytest.raises(ValueError, match="higher rank"):
        observer.step([0.0], [0.0], schedule=0.0)


def test_a_set_must_be_read_before_the_next_sample() -> None:
    observer = WindowObserver(cart(), BOX)
    first = observer.update([0.0])
    observer.step([0.0], [0.0])
    with pytest.raises(ValueError, match="set of sample 0 was not read before sample 1"):
        _ = first.box


# -- sets ----------------------------------------------------------------------------------------------------


def test_steps_without_a_first_measurement_start_from_the_initial_set() -> None:
    model, log = flown()
    with_nan, without = (WindowObserver(model, BOX) for _ in range(2))
    with_nan.update([np.nan])
    a, b = with_nan.step(log.u[0], log.y[1]).box, without.step(log.u[0], log.y[1]).box
    np.testing.assert_array_equal(a, b)


def test_more_steps_and_more_directions_never_widen_the_box() -> None:
    model, log = flown(60)
    widths = [np.ptp(run_all(WindowObserver(model, BOX, horizon=h), log)[-1][1:], axis=0) for h in (1, 4, 12, None)]
    for wider, tighter in itertools.pairwise(widths):
        assert (tighter <= wider * (1 + 1e-6)).all()  # the slack depends on the window
    slanted = np.ptp(
        run_all(WindowObserver(model, BOX, horizon=1, template=[[1.0, 0.1], [1.0, -0.5]]), log)[-1][1:], axis=0
    )
    assert (slanted <= widths[0] * (1 + 1e-6)).all()
    assert slanted[1] < 0.9 * widths[0][1]


def test_set_and_support_agree_with_the_box() -> None:
    model, log = flown()
    observer = WindowObserver(model, BOX, template=[[1.0, -1.0]])
    step = observer.update(log.y[0])
    for k in range(1, len(log)):
        step = observer.step(log.u[k - 1], log.y[k])
    lower, upper = step.box
    np.testing.assert_allclose(step.support(np.vstack([np.eye(2), -np.eye(2)])), [*upper, *-lower], rtol=1e-9)
    np.testing.assert_allclose(step.set.bounding_box(), (lower, upper), atol=1e-9)
    diagonal = step.support([[1.0, -1.0]])[0]
    assert diagonal == pytest.approx(step.set.support([1.0, -1.0]), abs=1e-9)
    assert diagonal < upper[0] - lower[1] - 0.01
    with pytest.raises(ValueError, match=r"directions has shape \(2,\)"):
        step.support([1.0, 0.0])


def test_after_a_falsification_the_set_is_empty_until_a_reset() -> None:
    model, log = flown()
    observer = WindowObserver(model, BOX)
    observer.update(log.y[0])
    step = observer.step(log.u[0], [50.0])
    assert step.verdict == "falsified"
    assert step.certificate.verify()
    assert step.set.emptiness().status == "empty"
    assert np.isnan(step.box).all()
    assert step.support([[1.0, 0.0]])[0] == -np.inf
    assert observer.step(log.u[1], log.y[2]).verdict == "falsified"
    observer.reset(BOX)
    assert observer.update(log.y[0]).verdict == "consistent"


def test_eps_is_the_relative_widening_of_the_data() -> None:
    model = UncertainModel([[1.0]], None, [[1.0]])
    initial = HPolytope.box([1.0], [1.0])
    verdicts = [WindowObserver(model, initial, eps=eps).update([1.0 + 1e-5]).verdict for eps in (0.0, 1e-9, 1e-4)]
    assert verdicts == ["falsified", "falsified", "consistent"]


# -- deadlines, saved state ----------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_missed_deadline_widens_the_set_but_keeps_the_truth(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=3)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(15, model.n_inputs)), rng)
    observer = WindowObserver(model, HPolytope.box(x0 - 0.5, x0 + 0.5), horizon=4)
    observer.update(log.y[0], log.u[0])
    for k in range(1, len(log)):
        step = observer.step(log.u[k - 1], log.y[k], log.u[k], deadline=0.0 if k % 2 else 0.02)
        assert step.verdict in ("consistent", "undecided")
        assert log.x is not None
        lower, upper = step.box
        room = 1e-12 * (1.0 + np.abs(log.x[k]))
        assert (lower - room <= log.x[k]).all()
        assert (log.x[k] <= upper + room).all()


def test_a_deadline_holds_where_programs_run_into_their_limit_of_pivots() -> None:
    """A plant whose programs cycle: without a deadline a sample takes many times as long (in CPU time)."""
    rng = np.random.default_rng(51539)
    horizon = int(rng.choice([1, 3, 5, 8, 10]))
    model = random_plant(rng)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(14, model.n_inputs)), rng)
    assert log.x is not None
    longest = []
    for deadline in (None, 1e-3):
        observer = WindowObserver(model, HPolytope.box(x0 - 1.0, x0 + 1.0), horizon=horizon)
        observer.warm_up()
        times = []
        observer.update(log.y[0], log.u[0])
        for k in range(1, len(log)):
            begun = process_time()
            step = observer.step(log.u[k - 1], log.y[k], log.u[k], deadline=deadline)
            times.append(process_time() - begun)
            assert step.verdict in ("consistent", "undecided")
            lower, upper = step.box
            room = 1e-9 * (1.0 + np.abs(log.x[k]))
            assert (lower - room <= log.x[k]).all()
            assert (log.x[k] <= upper + room).all()
        longest.append(max(times))
    assert longest[1] < 1e-3 + 5e-3
    assert longest[0] > 2 * longest[1]


def test_a_state_that_is_hardly_known_is_found_by_the_data() -> None:
    """For an unbounded initial set, which is refused: a box as large as a state can be."""
    model, log = flown(30)
    boxes = [run_all(WindowObserver(model, HPolytope.box([-r, -r], [r, r])), log)[-1] for r in (1.0, 1e6)]
    assert boxes[1][0] == "consistent"
    np.testing.assert_allclose(boxes[0][1:], boxes[1][1:], atol=1e-4)


def test_an_ample_deadline_changes_nothing() -> None:
    model, log = flown()
    plain = run_all(WindowObserver(model, BOX), log)
    timed = run_all(WindowObserver(model, BOX), log, deadline=10.0)
    for a, b in zip(plain, timed, strict=True):
        np.testing.assert_allclose(a[1:], b[1:], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("horizon", [3, None])
def test_a_saved_state_continues_bit_for_bit(horizon: int | None) -> None:
    model, log = flown(60)
    whole = run_all(WindowObserver(model, BOX, horizon=horizon), log)
    observer = WindowObserver(model, BOX, horizon=horizon)
    for step in islice(drive(observer, log), 25):
        _ = step.box
    file = io.BytesIO()
    np.savez(file, **observer.state_dict())
    file.seek(0)
    again = WindowObserver.from_state_dict(model, np.load(file))
    for expected, found in zip(whole[25:], run_all(again, log, start=25), strict=True):
        np.testing.assert_array_equal(expected[1:], found[1:])


def test_a_saved_falsification_keeps_its_proof() -> None:
    observer = WindowObserver(cart(), BOX)
    observer.update([0.0])
    observer.step([0.0], [50.0])
    again = WindowObserver.from_state_dict(cart(), observer.state_dict())
    step = again.step([0.0], [0.0])
    assert step.verdict == "falsified"
    assert step.certificate.verify()


def test_a_state_of_another_model_is_refused() -> None:
    state = WindowObserver(cart(), BOX).state_dict()
    with pytest.raises(ValueError, match="does not belong"):
        WindowObserver.from_state_dict(UncertainModel([[1.0]], None, [[1.0]]), state)


@pytest.mark.parametrize("horizon", [1, 2, 10, None])
def test_warm_up_leaves_the_observer_alone(horizon: int | None) -> None:
    model, log = flown()
    observer, twin = (WindowObserver(model, BOX, horizon=horizon) for _ in range(2))
    run_all(observer, log)
    run_all(twin, log)
    observer.warm_up()
    np.testing.assert_array_equal(observer.step([0.1], [0.2]).box, twin.step([0.1], [0.2]).box)


def test_the_fallback_decides_what_the_simplex_leaves_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a single pivot, HiGHS decides and its rays are proven."""
    model, log = flown(30)
    monkeypatch.setattr(kernel, "UNLIMITED", 0)
    observer = WindowObserver(model, BOX)
    assert {verdict for verdict, *_ in run_all(observer, log)} == {"consistent"}
    step = observer.step(log.u[-1], [50.0])
    assert step.verdict == "falsified"
    assert step.certificate.verify()


def test_a_plant_that_is_sampled_fast_needs_a_longer_window() -> None:
    """As docs/observers.md says: N = 10 is 1.4 times as wide as full information, N = 20 1.1 times."""
    model = UncertainModel.from_continuous(
        [[0.0, 1.0], [-1.0, -0.4]], [[0.0], [1.0]], [[1.0, 0.0]], E=[[0.0], [1.0]], w=[0.2], n=[0.05], Ts=0.02
    )
    log = model.simulate([0.0, 0.0], np.ones((150, 1)), np.random.default_rng(0))
    widths = []
    for horizon in (10, 20, None):
        record = WindowObserver(model, HPolytope.box([-1.0, -1.0], [1.0, 1.0]), horizon=horizon).run(log)
        widths.append((record.upper - record.lower)[50:].mean(axis=0))
    assert 1.2 < (widths[0] / widths[2]).max() < 1.6
    assert 1.02 < (widths[1] / widths[2]).max() < 1.2
