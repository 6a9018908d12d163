"""A state is bounded by programs for its linearisation where that counts: what it saves, and that sets stay as wide."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import Log, NonlinearModel, WindowObserver
from svo.checks import Array
from svo.logs.drive import drive
from svo.models.nonlinear import Span
from svo.observers.window.relinearised import Relinearised
from svo.observers.window.window import Window
from svo.observers.window_kernel import PROGRAMS
from tests.svo.models.nonlinear_plants import CASES, Case
from tests.svo.models.plants_of_the_field import AIRCRAFT
from tests.svo.models.short_transition import moved

SEED = 20_261_130
SAMPLES, SETTLED, HORIZON = 60, 20, 6
WIDER = 1.01  # of mean widths
PLANTS = CASES | AIRCRAFT


def run_of(name: str, samples: int = SAMPLES, seed: int = SEED) -> tuple[Case, Log]:
    case = PLANTS[name]()
    return case, case.model.simulate(case.x0, case.inputs(samples), np.random.default_rng(seed), substeps=4)


def observer(case: Case, **options: Any) -> WindowObserver:
    return WindowObserver(case.model, HPolytope.box(case.x0 - case.spread, case.x0 + case.spread), HORIZON, **options)


def bounded_at_each(window: Window, plant: Relinearised, u: Array, dt: float | None) -> None:
    """Every transition from what the programs leave of its state."""
    assert dt is None
    n, model = plant.model.n_states, plant.model
    lower, upper = (ends[:n] * plant._units[:n] for ends in window.newest_bounds())
    if model.physical_range is not None:
        lower, upper, _ = model.physical_range.cut(lower, upper)
    found, box = moved(model, Span(lower, upper), plant.box, u)
    plant.start_from(box)
    window.move_by(window._model.stack(found)[:, :n])


def widths(watcher: WindowObserver, log: Log) -> Array:
    boxes = np.array([step.box for step in drive(watcher, log)])[SETTLED:]
    return np.asarray((boxes[:, 1] - boxes[:, 0]).mean(axis=0))


@pytest.mark.parametrize("name", ["cstr", "tank", "friction", "eclipse"])
def test_sets_are_hardly_wider(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction jumps where the velocity changes its sign: sharp before and after, it leaves much out on the way."""
    case, log = run_of(name)
    found = widths(observer(case), log)
    monkeypatch.setattr(Window, "move_relinearised", bounded_at_each)
    assert (found <= WIDER * widths(observer(case, sign_split=1), log)).all()


def programs(case: Case, log: Log) -> float:
    """Of a sample, after the first ones."""
    watcher, counts = observer(case), []
    for _ in drive(watcher, log):
        counts.append(int(watcher._window.memory.arrays["clock"][PROGRAMS]))
    return (counts[-1] - counts[SETTLED]) / (len(counts) - 1 - SETTLED)


@pytest.mark.parametrize(("name", "least", "most"), [("eclipse", 1.0, 5.0), ("tank", 1.0, 5.0), ("lorenz", 8.5, 9.5)])
def test_programs_are_solved_where_they_count(name: str, least: float, most: float) -> None:
    """Two to four a sample for the arrival set, and those of all ends of the box where a transition is not sharp."""
    assert least <= programs(*run_of(name)) <= most


def test_a_box_that_leaves_the_valid_range_is_bounded_first() -> None:
    """Nothing reads the velocity at once, so its box grows while no program bounds it, which no remainder tells."""
    model = NonlinearModel(
        lambda x, w: [x[1], w[0]], lambda x: [x[0]], states=["s", "v"], disturbances=["a"], Ts=0.1, n=0.01, w=[1.0],
        valid=([-9.0, -1.5], [9.0, 1.5]), largest=([-5, -1.4], [5, 1.4]),
    )  # fmt: skip
    log = model.simulate([0.0, 0.3], np.zeros((SAMPLES, 0)), np.random.default_rng(SEED))
    start = HPolytope.box([-0.1, 0.0], [0.1, 0.6])
    steps = [step.verdict for step in drive(WindowObserver(model, start, HORIZON), log)]
    assert steps == ["consistent"] * SAMPLES


def test_boxes_that_are_asked_for_leave_no_trace() -> None:
    """In 1 of 3000 samples, here, digits differed while programs went on from the bases of those boxes."""
    case, log = run_of("friction", 150, 2)
    asked, silent = observer(case), observer(case)
    for step, other in zip(drive(asked, log), drive(silent, log), strict=True):
        assert np.isfinite(step.box).all()
        assert step.verdict == other.verdict
        pairs = zip(asked.linearised, silent.linearised, strict=True)
        assert all(a is b is None or a.rows.tobytes() == b.rows.tobytes() for a, b in pairs)  # type: ignore[union-attr]
