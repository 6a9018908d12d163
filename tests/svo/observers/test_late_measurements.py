"""Measurements that arrive late, and sensors of different rates: what they may change and what they must not."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.logs.log import Log
from svo.observers.window.chain import LateMeasurement, prove_chain
from tests.svo.observers.random_plants import random_plant
from tests.svo.observers.window.window_system import judge

BOX = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def two_rates(**changes: Any) -> UncertainModel:
    arguments: dict[str, Any] = {"E": [[0.0], [0.1]], "w": [0.2], "n": [0.3, 0.02], "Ts": 0.1}
    return UncertainModel([[1, 0.1], [0, 1]], [[0], [0.1]], [[1, 0], [1, 0]], **(arguments | changes))


def flown(samples: int, model: UncertainModel | None = None) -> tuple[UncertainModel, Log]:
    model, rng = model or two_rates(), np.random.default_rng(3)
    return model, model.simulate([0.3, -0.2], rng.normal(size=(samples, 1)), rng)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_full_information_is_the_same_whenever_the_measurements_come(seed: int) -> None:
    """Rows of late data stand where they would have stood: the sets agree with those of data in time."""
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=3).replace(uncertainties=())
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(9, model.n_inputs)), rng)
    late = rng.random(log.y.shape) < 0.4
    in_time, delayed = (WindowObserver(model, HPolytope.box(x0 - 0.5, x0 + 0.5), horizon=None) for _ in range(2))
    arriving = np.where(late, np.nan, log.y)
    for k in range(len(log)):
        for observer, y in ((in_time, log.y), (delayed, arriving)):
            if k == 0:
                observer.update(y[0], log.u[0])
            else:
                observer.step(log.u[k - 1], y[k], log.u[k])
    for k in rng.permutation(len(log)):
        answer = delayed.late_update(np.where(late[k], log.y[k], np.nan), int(k))
        assert answer.verdict == "consistent"
    for a, b in zip(in_time.step(log.u[-1], np.full(model.n_outputs, np.nan), log.u[-1]).box,
                    delayed.step(log.u[-1], np.full(model.n_outputs, np.nan), log.u[-1]).box, strict=True):  # fmt: skip
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-6)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_truth_stays_inside_and_late_data_never_widen(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(30, model.n_inputs)), rng, corners=bool(rng.random() < 0.5))
    observer = WindowObserver(model, HPolytope.box(x0 - 0.7, x0 + 0.7), horizon=int(rng.integers(2, 8)))
    late = rng.random(log.y.shape) < 0.3
    for k in range(len(log)):
        y = np.where(late[k], np.nan, log.y[k])
        step = observer.update(y, log.u[0]) if k == 0 else observer.step(log.u[k - 1], y, log.u[k])
        before = step.box
        taken = int(rng.integers(max(observer.window[0], k - 3), k + 1))
        after = observer.late_update(np.where(late[taken], log.y[taken], np.nan), taken)
        late[taken] = False
        assert after.verdict == "consistent"
        assert log.x is not None
        lower, upper = after.box
        room = 1e-12 * (1.0 + np.abs(log.x[k]))
        assert (lower - room <= log.x[k]).all()
        assert (log.x[k] <= upper + room).all()
        wide = 1e-7 * (1.0 + np.abs(before[0]) + np.abs(before[1]))
        assert (lower >= before[0] - wide).all()
        assert (upper <= before[1] + wide).all()


def run_late(model: UncertainModel, log: Log, delay: int, stop: int) -> tuple[WindowObserver, list[LateMeasurement]]:
    """Sensor 1 reads at every third sample, and its readings come ``delay`` samples late."""
    observer, sent = WindowObserver(model, BOX, horizon=6), []
    for k in range(stop):
        y = np.array([log.y[k, 0], np.nan])
        step = observer.update(y) if k == 0 else observer.step(log.u[k - 1], y)
        taken = k - delay
        if taken >= 0 and taken % 3 == 0 and step.verdict != "falsified":
            sent.append(LateMeasurement(k, taken, np.array([np.nan, log.y[taken, 1]])))
            observer.late_update(sent[-1].y, taken)
    return observer, sent


def test_a_late_precise_sensor_is_worth_its_data() -> None:
    model, log = flown(40)
    widths = []
    for delay in (0, 2, 100):
        observer, _ = run_late(model, log, delay, 40)
        widths.append(np.ptp(observer.step(log.u[39], [np.nan, np.nan]).box, axis=0)[0])
    assert widths[0] <= widths[1] + 1e-9
    assert widths[1] < 0.7 * widths[2]


@pytest.mark.parametrize("uncertain", [False, True])
def test_an_alarm_by_late_data_is_proven_from_the_first_sample(uncertain: bool) -> None:
    items = [Uncertainty(A=[[0.0, 0.0], [0.05, 0.0]], C=[[0.05, 0.0], [0.0, 0.0]])] if uncertain else []
    model, log = flown(40, two_rates(uncertainties=items))
    y = log.y.copy()
    y[20:, 1] += 5.0
    bad = Log(log.time, log.u, y)
    observer, sent = run_late(model, bad, 2, 40)
    step = observer.step(log.u[39], y[39])
    assert step.verdict == "falsified"
    assert step.certificate.verify()
    assert judge(step.certificate) == "empty"
    assert step.certificate.last == 23  # taken at 21, known two samples later
    seen = Log(log.time, log.u, np.column_stack([y[:, 0], np.full(40, np.nan)]))
    chain = prove_chain(observer, seen, late=sent)
    assert chain.unproven == ()
    assert chain.proven
    assert chain.falsified_at == 23
    assert not prove_chain(observer, seen).proven


def test_a_saved_state_with_late_data_continues_bit_for_bit() -> None:
    model, log = flown(40)
    observer, _ = run_late(model, log, 2, 25)
    file = io.BytesIO()
    np.savez(file, **observer.state_dict())
    file.seek(0)
    again = WindowObserver.from_state_dict(model, np.load(file))
    for k in range(25, 40):
        pair = []
        for o in (observer, again):
            o.step(log.u[k - 1], [log.y[k, 0], np.nan])
            pair.append(o.late_update([np.nan, log.y[k - 2, 1]], k - 2).box if k % 3 == 2 else o.bounds_at(k))
        np.testing.assert_array_equal(*pair)


@pytest.mark.parametrize(
    ("y", "sample", "message"),
    [
        ([np.nan, 0.1], 1, "sample is 1; expected one in the window, which holds"),
        ([np.nan, 0.1], 40, "sample is 40"),
        ([np.nan, 0.1], 11.5, "sample is 11.5"),
        ([0.1, np.nan], 19, "sensor 0, which was already read at 19"),
        ([np.nan, np.inf], 19, "y is .*inf"),
        ([0.1], 19, r"y has shape \(1,\)"),
    ],
)
def test_late_data_that_make_no_sense_are_refused(y: Any, sample: Any, message: str) -> None:
    model, log = flown(20)
    observer, _ = run_late(model, log, 30, 20)
    before = observer.state_dict()
    with pytest.raises(ValueError, match=message):
        observer.late_update(y, sample)
    for name, value in observer.state_dict().items():
        np.testing.assert_array_equal(value, before[name])


def test_late_data_need_a_first_sample() -> None:
    with pytest.raises(ValueError, match="there is no sample yet"):
        WindowObserver(two_rates(), BOX).late_update([np.nan, 0.0], 0)
