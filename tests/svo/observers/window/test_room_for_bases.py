"""Bases grow with what their programs need: no program stops at a limit that the user did not set."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.observers.window import memory
from tests.svo.observers.random_plants import random_plant


def dense_plant(n: int) -> tuple[UncertainModel, Log, HPolytope]:
    rng = np.random.default_rng(3)
    A = rng.normal(size=(n, n))
    A *= 0.9 / np.abs(np.linalg.eigvals(A)).max()
    C, E = (rng.normal(size=shape) / np.sqrt(n) for shape in ((n // 2, n), (n, n)))
    model = UncertainModel(A, None, C, E=E, w=np.full(n, 0.05), n=np.full(n // 2, 0.1))
    x0 = rng.uniform(-0.5, 0.5, n)
    return model, model.simulate(x0, np.zeros((45, 0)), rng), HPolytope.box(-np.ones(n), np.ones(n))


@pytest.mark.parametrize("seed", range(12))
def test_the_room_at_first_changes_no_answer(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rooms of 3 rows run out at every stage of a sample: its channels, its arrival programs, its box."""
    rng = np.random.default_rng([91, seed])
    model = random_plant(rng)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(25, model.n_inputs)), rng)
    start = HPolytope.box(np.minimum(x0, -1.0), np.maximum(x0, 1.0))
    horizon = [2, 5, 8, None][seed % 4]
    wide = WindowObserver(model, start, horizon=horizon)
    monkeypatch.setattr(memory, "_FIRST_BASIS", 3)
    narrow = WindowObserver(model, start, horizon=horizon)
    for one, other in zip(drive(wide, log), drive(narrow, log), strict=True):
        assert one.verdict == other.verdict
        (low, high), found = one.box, other.box
        assert np.abs(np.array(found) - (low, high)).max() <= 1e-6 * np.abs(high - low).max() + 1e-9
    assert narrow._window.memory.size.K > 3
    assert narrow.stopped == wide.stopped == 0


def test_a_long_window_of_a_dense_plant_solves_every_program_and_is_saved_with_its_room() -> None:
    model, log, start = dense_plant(8)
    observer, short = WindowObserver(model, start, horizon=30), WindowObserver(model, start, horizon=6)
    for step, other in zip(drive(observer, log), drive(short, log), strict=True):
        assert step.verdict == other.verdict == "consistent"
    (low, high), (lower, upper) = step.box, other.box
    assert (high - low <= (upper - lower) * (1.0 + 1e-6)).all()
    assert observer._window.memory.size.K > 32
    assert observer.stopped == short.stopped == 0
    file = io.BytesIO()
    np.savez(file, **observer.state_dict())
    file.seek(0)
    with np.load(file, allow_pickle=False) as state:
        again = WindowObserver.from_state_dict(model, dict(state))
    assert np.array_equal(again.step(None, log.y[-1]).box, observer.step(None, log.y[-1]).box)


@pytest.mark.slow
def test_a_longer_window_of_twenty_states_is_not_wider() -> None:
    """With at most 128 rows in a basis it was: 1982 programs stopped at n = 50, N = 10."""
    model, log, start = dense_plant(20)
    log = replace(log, time=log.time[:25], u=log.u[:25], y=log.y[:25], x=None)
    short, long = (WindowObserver(model, start, horizon=horizon).run(log) for horizon in (5, 10))
    assert short.stopped == long.stopped == 0
    widths, wider = ((r.upper - r.lower)[-1] for r in (long, short))
    assert (widths <= wider * (1.0 + 1e-6)).all()


def test_a_deadline_stops_programs_and_each_counts_once() -> None:
    model, log, start = dense_plant(4)
    observer = WindowObserver(model, start, horizon=5)
    stopped = [step.stopped for step in drive(observer, log, deadline=0.0)]
    assert stopped[0] == 0  # the first measurement has no deadline
    assert max(stopped) == 4  # of the 8 programs of an arrival set, which two samples share
    assert observer.stopped == sum(stopped)
    record = WindowObserver(model, start, horizon=5).run(log)
    assert record.stopped == 0


def test_where_the_machine_has_no_room_programs_stop_are_counted_and_their_bounds_hold(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model, log, start = dense_plant(8)
    monkeypatch.setattr(memory, "_FIRST_BASIS", 8)
    whole, stopped = WindowObserver(model, start, horizon=12), WindowObserver(model, start, horizon=12)

    def no_room(size: object) -> None:
        raise MemoryError

    boxes = [step.box for step in drive(whole, log)]
    monkeypatch.setattr("svo.observers.window_kernel.allocate", no_room)
    for step, (low, high) in zip(drive(stopped, log), boxes, strict=True):
        lower, upper = step.box
        assert (lower <= low + 1e-9).all()
        assert (upper >= high - 1e-9).all()
    assert stopped.stopped > 0 == whole.stopped


def test_a_sample_that_was_interrupted_half_way_mixes_with_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    model, log, start = dense_plant(8)
    observer = WindowObserver(model, start, horizon=30)

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(memory.Memory, "enlarge", interrupted)
    with pytest.raises(KeyboardInterrupt):
        list(drive(observer, log))
    monkeypatch.undo()
    k = observer._number + 1
    with pytest.raises(RuntimeError, match="last sample was interrupted"):
        observer.step(None, log.y[k])
    observer.reset(start)
    assert observer.update(log.y[0]).verdict == "consistent"
