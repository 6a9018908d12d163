"""Output injection: the same sets and alarms as with w in the program, and proofs about the model as given."""

from __future__ import annotations

import io
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.observers.window import memory
from svo.observers.window.chain import prove_chain
from svo.observers.window.output_injection import can_inject
from tests.svo.observers import oracle
from tests.svo.observers.window.window_system import judge

seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=15, deadline=None, derandomize=True)


def exact_sensors(rng: np.random.Generator, n: int = 2, nw: int = 2, **changes: Any) -> UncertainModel:
    """A plant, stable or not, whose exact sensors read w, with A - E F^-1 C stable."""
    F = np.eye(nw) + 0.2 * rng.normal(size=(nw, nw))
    E, C = rng.normal(size=(n, nw)), rng.normal(size=(nw, n))
    closed = rng.normal(size=(n, n))
    closed *= 0.7 / np.abs(np.linalg.eigvals(closed)).max()
    A = closed + E @ np.linalg.solve(F, C)
    arguments: dict[str, Any] = {"D": rng.normal(size=(nw, 1)), "a": rng.normal(size=n), "c": rng.normal(size=nw)}
    w = np.sort(rng.uniform(-0.3, 0.3, (2, nw)), axis=0)
    return UncertainModel(
        A, rng.normal(size=(n, 1)), C, E=E, F=F, w=(w[0], w[1]), **(arguments | changes)
    )  # fmt: skip


def random_run(seed: int, samples: int = 12, missing: float = 0.2, **changes: Any) -> tuple[UncertainModel, Log]:
    rng = np.random.default_rng(seed)
    model = exact_sensors(rng, int(rng.integers(1, 4)), int(rng.integers(1, 3)))
    if rng.random() < 0.5:
        g, f = 0.2 * rng.normal(size=model.n_states), rng.normal(size=model.n_states)
        model = model.replace(uncertainties=[Uncertainty(A=np.outer(g, f), bounds=(-0.5, 1.0))])
    model = model.replace(**changes)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(samples, 1)), rng, corners=bool(rng.random() < 0.5))
    y = log.y.copy()
    y[rng.random(y.shape) < missing * (rng.random() < 0.5)] = np.nan
    return model, replace(log, y=y)


def observer_of(model: UncertainModel, log: Log, horizon: int | None, **options: Any) -> WindowObserver:
    assert log.x is not None
    return WindowObserver(model, HPolytope.box(log.x[0] - 0.4, log.x[0] + 0.6), horizon=horizon, **options)


def test_which_models_are_injected() -> None:
    rng = np.random.default_rng(0)
    model = exact_sensors(rng)
    assert can_inject(model)
    triangle = HPolytope(np.vstack([-np.eye(2), np.ones((1, 2))]), np.full(3, 0.1))
    for changes in (
        {"n": [0.0, 0.1]},
        {"F": np.ones((2, 2))},
        {"w": triangle},
        {"A": 3.0 * np.eye(2) + np.asarray(model.A)},
        {"uncertainties": [Uncertainty(A=np.eye(2), C=np.eye(2))]},
        {"uncertainties": [Uncertainty(E=np.eye(2))]},
        {"uncertainties": [Uncertainty(F=np.eye(2))]},
        {"F": np.eye(2)[:, :1], "E": np.eye(2)[:, :1], "w": [0.1]},
    ):
        assert not can_inject(model.replace(**changes)), changes
    assert can_inject(model.replace(n=[0.0, 0.0], uncertainties=[Uncertainty(A=np.eye(2))]))


@few
@given(seeds)
def test_all_data_give_the_exact_box(seed: int) -> None:
    """Against the full-information program of the model as given, which keeps w."""
    model, log = random_run(seed, 6, uncertainties=())
    assert can_inject(model)
    observer = observer_of(model, log, None, eps=1e-13)
    lower, upper = log.x[0] - 0.4, log.x[0] + 0.6  # type: ignore[index]
    for k, step in enumerate(drive(observer, log)):
        assert step.verdict == "consistent"
        inner = oracle.box(model, oracle.prefix(log, k + 1), lower, upper, [()], rounding=0.0)
        wider = oracle.box(model, oracle.prefix(log, k + 1), lower, upper, [()], rounding=1e-7)
        room = 1e-6 * (1.0 + np.abs(upper).max() + np.abs(step.box[0]).max())
        assert (step.box[0] <= inner.lower + 1e-8 * (1.0 + np.abs(inner.lower))).all() or inner.empty
        assert (step.box[1] >= inner.upper - 1e-8 * (1.0 + np.abs(inner.upper))).all() or inner.empty
        assert (step.box[0] >= wider.lower - room).all()
        assert (step.box[1] <= wider.upper + room).all()


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seeds)
def test_truth_stays_inside(seed: int) -> None:
    model, log = random_run(seed, 30)
    observer = observer_of(model, log, 1 + seed % 8)
    for k, step in enumerate(drive(observer, log)):
        assert step.verdict == "consistent", k
        assert log.x is not None
        room = 1e-12 * (1.0 + np.abs(log.x[k]))
        assert (step.box[0] - room <= log.x[k]).all()
        assert (log.x[k] <= step.box[1] + room).all()


def test_a_healthy_unstable_plant_is_never_falsified() -> None:
    """x+ = 1.5 x + w, y = x + w: injected, x+ = 0.5 x + y, which soon contradicts itself without bounds of rounding."""
    model = UncertainModel([[1.5]], None, [[1.0]], E=[[1.0]], F=[[1.0]], w=[0.1])
    assert can_inject(model)
    log = model.simulate([0.03], np.zeros((60, 0)), np.random.default_rng(1), corners=True)
    assert np.abs(log.y).max() > 1e5
    observer = WindowObserver(model, HPolytope.box([-1.0], [1.0]), horizon=5)
    assert set(observer.run(log).verdicts) == {"consistent"}


def faulty(log: Log, at: int, size: float = 3.0) -> Log:
    y = log.y.copy()
    y[at:] += size * (-1.0) ** np.arange(len(y) - at)[:, None]
    return Log(log.time, log.u, y)


@few
@given(seeds)
def test_alarms_are_proven_about_the_model_as_given(seed: int) -> None:
    model, log = random_run(seed, 14)
    bad = faulty(log, 6)
    observer = observer_of(model, log, 1 + seed % 5)
    record = observer.run(bad)
    assert "undecided" not in record.verdicts
    certificate = record.certificate
    if certificate is None:
        return
    assert certificate.verify()
    assert judge(certificate) == "empty"
    for k, sample in zip(range(certificate.first, certificate.last + 1), certificate.samples, strict=True):
        np.testing.assert_array_equal(sample.stack, model.stack())
        np.testing.assert_array_equal(sample.y, bad.y[k])
        np.testing.assert_array_equal(sample.noise, 0.0)
    chain = prove_chain(observer, bad)
    assert chain.unproven == ()
    assert chain.falsified_at == record.verdicts.index("falsified")


@pytest.mark.slow
def test_the_alarm_comes_with_the_sample_of_a_program_that_keeps_w(monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for inject in (True, False):
        if not inject:
            monkeypatch.setattr(memory, "can_inject", lambda model: False)
        alarms = []
        for seed in range(12):
            model, log = random_run(seed, 14)
            alarms.append(observer_of(model, log, 4).run(faulty(log, 6)).verdicts)
        found.append(alarms)
    assert found[0] == found[1]
    assert any("falsified" in verdicts for verdicts in found[0])


def test_a_saved_state_continues_bit_for_bit() -> None:
    model, log = random_run(3, 24)
    whole, half = observer_of(model, log, 3), observer_of(model, log, 3)
    for observer, stop in ((whole, 24), (half, 12)):
        for k, step in enumerate(islice(drive(observer, log), stop)):
            if k < 12:
                _ = step.box
    file = io.BytesIO()
    np.savez(file, **half.state_dict())
    file.seek(0)
    again = WindowObserver.from_state_dict(model, np.load(file))
    for k in range(12, 24):
        step = again.step(log.u[k - 1], log.y[k], log.u[k])
    for name, value in whole.state_dict().items():
        np.testing.assert_array_equal(value, again.state_dict()[name], err_msg=name)


def test_what_was_missing_may_still_come() -> None:
    model, log = random_run(5, 10, missing=0.0)
    observer = observer_of(model, log, 4)
    hole = np.full(model.n_outputs, np.nan)
    observer.update(log.y[0], log.u[0])
    for k in range(1, 6):
        observer.step(log.u[k - 1], hole if k == 4 else log.y[k], log.u[k])
    before = np.ptp(observer.bounds_at(5), axis=0)
    step = observer.late_update(log.y[4], 4)
    assert step.verdict == "consistent"
    assert (np.ptp(step.box, axis=0) <= before * (1 + 1e-6)).all()
    wrong = observer.step(log.u[5], log.y[6] + 50.0, log.u[6])
    assert wrong.verdict == "falsified"
    assert wrong.certificate is not None
    assert judge(wrong.certificate) == "empty"
