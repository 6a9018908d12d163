"""What a linearisation of a nonlinear plant takes in the core and by the same rules in Python; an observer's sample.

Run with ``python -m benchmarks.linearisations``. The sets are those that a window observer (horizon 10) has along a run
of the plant, once they have settled; times are CPU microseconds, the best of a few turns over the same sets.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from typing import NamedTuple

import numpy as np

from aircraft.eclipse.plant import INITIAL_LOWER, INITIAL_UPPER
from aircraft.eclipse.scenarios import HEALTHY
from benchmarks._observers import table
from benchmarks.nonlinear import run
from polytopes import HPolytope
from svo import WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.nonlinear import NonlinearModel
from tests.aircraft.eclipse.test_equations import SCENARIOS, models
from tests.svo.functions.oracle.transition import of_model
from tests.svo.models.nonlinear_plants import CASES

SAMPLES = 100
SETTLED = 30  # samples after which sets count
TURNS = 7
IN_PYTHON = 5  # sets, where one takes milliseconds


class Task(NamedTuple):
    """A plant, a first set, and a run."""

    model: NonlinearModel
    initial: HPolytope
    log: Log


def tasks() -> dict[str, Task]:
    """Every plant of the tests, and the Eclipse under each of its hypotheses."""
    found, rng = {}, np.random.default_rng(0)
    for name, make in CASES.items():
        case = make()
        initial = HPolytope.box(case.x0 - case.spread, case.x0 + case.spread)
        found[name] = Task(case.model, initial, run(case, rng, "inside"))
    box, flown = HPolytope.box(INITIAL_LOWER, INITIAL_UPPER), SCENARIOS.run(HEALTHY, HEALTHY, "quiet", 5)
    log = Log(flown.time[:SAMPLES], flown.flight.u[:SAMPLES], flown.flight.y[:SAMPLES])
    for name, model in models().items():
        found[f"Eclipse, {name}"] = Task(model, box, log)
    return found


def best(turn: Callable[[], object], count: int, turns: int = TURNS) -> float:
    """CPU microseconds for each of so many units in the fastest turn."""
    times = []
    for _ in range(turns):
        begun = process_time()
        turn()
        times.append(process_time() - begun)
    return 1e6 * min(times) / count


def examine(task: Task) -> list[str]:
    """Slots, and what transitions, outputs and samples take."""
    model, log = task.model, task.log
    sets = [(*step.box, u) for step, u in zip(drive(start(task), log), log.u, strict=True)][SETTLED:]
    transition = best(lambda: [model.kernel.transition(*at, model.Ts) for at in sets], len(sets))
    output = best(lambda: [model.kernel.output(*at) for at in sets], len(sets))
    python = best(lambda: [of_model(model, *at, model.Ts) for at in sets[:IN_PYTHON]], IN_PYTHON, 1)
    sample = min(settled(task) for _ in range(3))
    slots = len(model.flow.tape.op), len(model.reading.op)
    times = (f"{transition:.1f}", f"{output:.1f}", f"{python / 1e3:.1f}", f"{python / transition:.0f}", f"{sample:.0f}")
    return [f"{slots[0]} + {slots[1]}", *times]


def settled(task: Task) -> float:
    """CPU microseconds of an observer's sample, of those after the first ones."""
    steps = drive(start(task), task.log)
    for _ in range(SETTLED):
        next(steps)
    return best(lambda: sum(1 for _ in steps), SAMPLES - SETTLED, 1)


def start(task: Task) -> WindowObserver:
    """An observer before its first sample."""
    return WindowObserver(task.model, task.initial, horizon=10)


def main() -> None:
    """Print the table."""
    columns = ["plant", "slots", "transition", "output", "in Python [ms]", "ratio", "an observer's sample"]
    table("Linearisations, CPU us", columns, [[name, *examine(task)] for name, task in tasks().items()])


if __name__ == "__main__":
    main()
