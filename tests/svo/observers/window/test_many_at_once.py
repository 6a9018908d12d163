"""Samples of a log that the core takes in one call, against one step after the other."""

from __future__ import annotations

import _thread
import signal
import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from aircraft.eclipse.plant import eclipse
from polytopes import HPolytope
from svo import ArchitectureI, UncertainModel, Uncertainty, WindowObserver
from svo.isolation.record import BankRecord, Replay
from svo.isolation.recorder import Recorder
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models import Labels
from tests.svo.observers.random_plants import random_plant


def start(model: UncertainModel) -> HPolytope:
    return HPolytope.box(-np.ones(model.n_states), np.ones(model.n_states))


def random_case(seed: int) -> tuple[UncertainModel, Log]:
    """A random plant and sixty samples, some of them without a sensor, some beyond what the model allows."""
    rng = np.random.default_rng(seed)
    model = random_plant(rng)
    log = model.simulate(rng.uniform(-1.0, 1.0, model.n_states), rng.normal(size=(60, model.n_inputs)), rng)
    if seed % 3 == 1:
        log.y[rng.random(log.y.shape) < 0.1] = np.nan
    if seed % 3 == 2:
        log.y[40:, 0] += 3.0 + np.abs(log.y[40:, 0])
    return model, log


def stepped(observer: WindowObserver, log: Log) -> tuple[list[str], list[Any], Any]:
    """Verdicts, boxes and certificate, sample by sample."""
    verdicts, boxes, step = [], [], None
    for step in drive(observer, log):
        verdicts.append(step.verdict)
        boxes.append(np.array(step.box))
    assert step is not None
    return verdicts, boxes, step.certificate


@pytest.mark.parametrize("horizon", [1, 5, 10, None])
@pytest.mark.parametrize("seed", range(12))
def test_a_run_says_what_steps_say(seed: int, horizon: int | None) -> None:
    model, log = random_case(seed)
    if horizon is None:  # programs grow with the samples
        log = replace(log, time=log.time[:25], u=log.u[:25], y=log.y[:25], x=None)
    record = WindowObserver(model, start(model), horizon=horizon).run(log)
    verdicts, boxes, certificate = stepped(WindowObserver(model, start(model), horizon=horizon), log)
    assert list(record.verdicts) == verdicts
    lower, upper = np.array(boxes).transpose(1, 0, 2)
    # Where a basis needs more room in a box, programs before it are solved once more, so the last bits may differ.
    size = 1e-12 * (np.abs(lower) + np.abs(upper)) + 1e-9 * (upper - lower)
    assert ((np.abs(record.lower - lower) <= size) | np.isnan(lower)).all()
    assert ((np.abs(record.upper - upper) <= size) | np.isnan(upper)).all()
    assert (record.certificate is None) == (certificate is None)
    assert certificate is None or certificate.verify()


@pytest.mark.parametrize("seed", range(6))
def test_a_run_leaves_the_observer_as_steps_do(seed: int) -> None:
    model, log = random_case(seed)
    begun = replace(log, time=log.time[:30], u=log.u[:30], y=log.y[:30], x=None)
    ran, walked = WindowObserver(model, start(model)), WindowObserver(model, start(model))
    ran.run(begun), stepped(walked, begun)
    for k in range(30, 60):
        u_next = log.u[k] if ran.needs_next_input else None
        steps = [observer.step(log.u[k - 1], log.y[k], u_next) for observer in (ran, walked)]
        assert steps[0].verdict == steps[1].verdict
        assert np.allclose(*(step.box for step in steps), rtol=1e-9, atol=1e-12, equal_nan=True)


def by_steps(bank: Any, log: Log) -> BankRecord:
    recorder = Recorder(bank.names, log, Labels.of(bank.observers["nominal"].model), Replay(dict))
    for verdict in drive(bank, log):
        recorder.add(verdict)
    return recorder.record()


@pytest.mark.parametrize("fault", ["none", "elevator"])
def test_the_bank_of_the_eclipse_says_what_its_steps_say(fault: str) -> None:
    plant = eclipse().with_models("lpv")
    log = plant.simulate(fault, "none" if fault == "none" else plant.faults[fault][0], "quiet", 3)
    log = replace(log, schedule=np.array(list(map(plant.scheduler(), log.y))))
    run, steps = plant.bank("quiet").run(log), by_steps(plant.bank("quiet"), log)
    assert run.states == steps.states
    assert np.array_equal(run.alive, steps.alive)
    assert np.array_equal(run.undecided, steps.undecided)
    assert run.died_at == steps.died_at
    assert np.array_equal(np.isnan(run.seconds), np.isnan(steps.seconds))
    assert all(c is None or c.verify() for c in run.certificates.values())


def test_progress_reaches_the_end_of_the_log() -> None:
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=[0.1], uncertainties=[Uncertainty(A=[[0.05]])])
    log = model.simulate([0.0], np.zeros((300, 1)), np.random.default_rng(0))
    seen: list[tuple[int, int]] = []
    more = WindowObserver(model.replace(n=[0.2]), start(model))
    bank = ArchitectureI(WindowObserver(model, start(model)), {"more": more})
    bank.run(log, progress=lambda done, of: seen.append((done, of)))
    assert seen[-1] == (300, 300)
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})


def test_what_a_step_refuses_a_run_refuses() -> None:
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=[0.1])
    log = model.simulate([0.0], np.zeros((20, 1)), np.random.default_rng(0))
    with pytest.raises(ValueError, match="y has shape"):
        WindowObserver(model, start(model)).run(replace(log, y=np.zeros((20, 2)), x=None))
    observer = WindowObserver(model, start(model))
    observer.update([0.0])
    with pytest.raises(ValueError, match="update was called after the first sample"):
        observer.run(log)


def test_an_interruption_ends_a_run_in_its_middle() -> None:
    """Calls of the core are brief, so Ctrl-C is heard between them."""
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=[0.1])
    samples = 1_000_000
    log = Log(time=np.arange(float(samples)), u=np.zeros((samples, 1)), y=np.zeros((samples, 1)))
    observer = WindowObserver(model, start(model))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
    threading.Timer(0.5, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        observer.run(log)
    signal.signal(signal.SIGINT, before)
    assert 0 < observer._number < samples - 1
