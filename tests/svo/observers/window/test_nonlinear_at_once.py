"""Samples of nonlinear plants that the core takes in one call: to the bit what one step after the other says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.nonlinear import NonlinearModel
from tests.svo.models.nonlinear_plants import CASES, Case, crane, oscillator, pendulum, tank
from tests.svo.models.plants_of_the_field import AIRCRAFT
from tests.svo.models.random_nonlinear import random_plant
from tests.svo.models.units import in_other_units
from tests.svo.observers.nonlinear_events import nonlinear_case

SEED = 20_261_129
SAMPLES = 28

Said = list[tuple[Any, ...]]


def first(case: Case) -> HPolytope:
    return HPolytope.box(case.x0 - case.spread, case.x0 + case.spread)


def healthy(case: Case, rng: np.random.Generator, samples: int = SAMPLES) -> Log:
    return case.model.simulate(case.x0, case.inputs(samples), rng, corners=True, substeps=4)


def by_steps(observer: WindowObserver, log: Log, with_boxes: bool) -> Said:
    return [
        (step.verdict, step.reason, *((end.tobytes() for end in step.box) if with_boxes else ()))
        for step in drive(observer, log)
    ]


def at_once(observer: WindowObserver, log: Log, with_boxes: bool) -> tuple[Said, int]:
    """The same from `follow`, and the most samples that it gave at once."""
    boxes = np.full((len(log), 2, observer.model.n_states), np.nan) if with_boxes else None
    said: Said = []
    most = 0
    for samples, step in observer.follow(log, boxes):
        most = max(most, samples)
        said += [(step.verdict, step.reason)] * samples
    if boxes is None:
        return said, most
    return [(*one, *(end.tobytes() for end in box)) for one, box in zip(said, boxes, strict=True)], most


def linearised(observer: WindowObserver) -> list[bytes]:
    return [part.tobytes() for at in observer.linearised if at is not None for part in (at.rows, at.n)]


def apart(model: NonlinearModel, initial: HPolytope, horizon: int | None) -> WindowObserver:
    """An observer that takes each sample in many calls: told to split cells by signs, of which its plant has none."""
    return WindowObserver(model, initial, horizon=horizon, sign_split=1)


def compare(
    model: NonlinearModel, initial: HPolytope, log: Log, horizon: int | None = 4, with_boxes: bool = False
) -> Said:
    """What all say, having compared it and all that the observers are left with."""
    slow, walked, ran = apart(model, initial, horizon), *(WindowObserver(model, initial, horizon) for _ in range(2))
    pieces, steps, (run, most) = (
        by_steps(slow, log, with_boxes),
        by_steps(walked, log, with_boxes),
        at_once(ran, log, with_boxes),
    )
    assert run == steps == pieces
    assert most > 1
    assert linearised(ran) == linearised(walked) == linearised(slow)
    left = [state_of(observer) for observer in (ran, walked, slow)]
    assert left[0] == left[1] == left[2]
    return steps


def state_of(observer: WindowObserver) -> dict[str, bytes]:
    """All arrays of a saved state but the options and the seals."""
    return {
        name: array.tobytes()
        for name, array in observer.state_dict().items()
        if name != "settings" and not name.startswith("seal")
    }


@pytest.mark.parametrize("with_boxes", [False, True])
@pytest.mark.parametrize("name", CASES)
def test_a_run_says_what_steps_say(name: str, with_boxes: bool) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    log = healthy(case, rng)
    log.y[rng.random(log.y.shape) < 0.1] = np.nan
    compare(case.model, first(case), log, with_boxes=with_boxes)


@pytest.mark.parametrize("horizon", [1, 10, None])
def test_windows_of_any_length(horizon: int | None) -> None:
    case, rng = tank(), np.random.default_rng(SEED)
    compare(case.model, first(case), healthy(case, rng), horizon, with_boxes=True)


@pytest.mark.parametrize("seed", range(6))
def test_random_plants_in_random_units(seed: int) -> None:
    rng, case = np.random.default_rng(seed), random_plant(seed, continuous=seed % 3 != 2)
    if seed % 2:
        case = in_other_units(case, rng)
    compare(case.model, first(case), healthy(case, rng), with_boxes=seed % 2 == 0)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_the_missile_and_the_eclipse(name: str) -> None:
    case = AIRCRAFT[name]()
    compare(case.model, first(case), healthy(case, np.random.default_rng(SEED)))


def test_a_bank_says_what_its_steps_say() -> None:
    case = crane()
    models = {"nominal": case.model, "drag": case.model.replace(parameters={"gravity": (9.7, 9.9), "drag": (0.1, 3.0)})}
    models |= {"load cell": case.model.replace(n=[0.5, 0.05])}

    def bank() -> ArchitectureI:
        nominal, *others = (WindowObserver(model, first(case), horizon=3) for model in models.values())
        return ArchitectureI(nominal, dict(zip(("drag", "load cell"), others, strict=True)))

    log = healthy(case, np.random.default_rng(SEED))
    log.y[15:, 0] += 0.3
    run, verdicts = bank().run(log), list(drive(bank(), log))
    assert list(run.states) == [verdict.state for verdict in verdicts]
    assert [tuple(np.array(run.names)[alive]) for alive in run.alive] == [verdict.alive for verdict in verdicts]
    assert run.states[-1] != "nominal"


def test_a_falsified_window_and_its_proof() -> None:
    case = tank()
    log = healthy(case, np.random.default_rng(SEED))
    log.y[20:, 0] += 2.0
    assert compare(case.model, first(case), log)[-1][0] == "falsified"
    record = WindowObserver(case.model, first(case), horizon=4).run(log)
    assert record.certificate is not None
    assert record.certificate.verify()


def test_where_the_equations_do_not_hold_it_starts_again() -> None:
    case = pendulum(valid=([-1.2, -9.0], [1.2, 9.0]))
    log = pendulum().model.simulate(case.x0, np.tile([[8.5]], (60, 1)), np.random.default_rng(SEED))
    said = compare(case.model, first(case), log, with_boxes=True)
    assert {verdict for verdict, *_ in said} == {"consistent", "undecided"}


def test_readings_outside_what_is_physical() -> None:
    case = tank()
    log = case.model.simulate(case.x0, np.tile([[3.6, 2.0]], (30, 1)), np.random.default_rng(SEED))
    compare(case.model.replace(physical=([0] * 4, [12.8, 13.5, 25, 25])), first(case), log, with_boxes=True)


def test_an_output_that_is_not_enclosed_is_no_reading() -> None:
    case = pendulum()
    model = case.model.replace(h=lambda x: [1.0 / (x[0] - 1.2)], n=0.2)
    log = model.simulate(case.x0, np.tile([[8.5]], (40, 1)), np.random.default_rng(SEED))
    log.y[8:35] = np.nan
    said = compare(model, first(case), log)
    assert any(reason is not None and "output" in reason for _, reason, *_ in said)


@pytest.mark.parametrize("jitter", [0.0, 0.05])
@pytest.mark.parametrize("name", ["tank", "pendulum"])
def test_samples_at_times_of_their_own(name: str, jitter: float) -> None:
    case = nonlinear_case(name, np.random.default_rng(SEED), 18, jitter)
    log = replace(case.log, x=None)
    if jitter:  # each of its samples needs more than one call
        walked, ran = (WindowObserver(case.model, case.first, horizon=4) for _ in range(2))
        assert at_once(ran, log, True)[0] == by_steps(walked, log, True)
    else:
        compare(case.model, case.first, log, with_boxes=True)


def test_more_room_for_bases_in_the_middle_of_a_log() -> None:
    case = tank()
    log = healthy(case, np.random.default_rng(SEED), 60)
    walked, ran = (WindowObserver(case.model, first(case), horizon=25) for _ in range(2))
    rooms = {observer._window.memory.size.K for observer in (walked, ran)}
    assert at_once(ran, log, False)[0] == by_steps(walked, log, False)
    assert ran.state_dict()["inverse"].tobytes() == walked.state_dict()["inverse"].tobytes()
    assert {ran._window.memory.size.K} != rooms


def test_a_portion_of_a_log_goes_on_where_the_one_before_ended() -> None:
    case, rng = tank(), np.random.default_rng(SEED)
    log = healthy(case, rng)
    whole, parts = (WindowObserver(case.model, first(case), horizon=4) for _ in range(2))
    said, _ = at_once(whole, log, False)
    begun = replace(log, time=log.time[:11], u=log.u[:11], y=log.y[:11], x=None)
    rest = replace(log, time=log.time[10:], u=log.u[10:], y=log.y[10:], x=None)
    again = [(step.verdict, step.reason) for samples, step in parts.follow(begun) for _ in range(samples)]
    again += [(step.verdict, step.reason) for samples, step in parts.follow(rest, start=1) for _ in range(samples)]
    assert again == said
    assert linearised(parts) == linearised(whole)


def test_what_a_step_refuses_a_run_refuses() -> None:
    case = tank()
    log = healthy(case, np.random.default_rng(SEED))
    with pytest.raises(ValueError, match="schedule is given"):
        WindowObserver(case.model, first(case)).run(replace(log, schedule=np.zeros(len(log))))
    log.y[15, 0] = np.inf
    with pytest.raises(ValueError, match="expected finite numbers, or NaN for a missing sensor"):
        WindowObserver(case.model, first(case)).run(log)
    discrete = oscillator()[1].replace(continuous=False)
    events = discrete.simulate([1.0, 0.0], np.ones((9, 1)), np.random.default_rng(SEED))
    times = events.time * np.linspace(1.0, 2.0, 9)
    with pytest.raises(ValueError, match="its equations are in discrete time"):
        WindowObserver(discrete, HPolytope.box([0.5, -1.0], [1.5, 1.0])).run(Log(times, events.u, events.y))
