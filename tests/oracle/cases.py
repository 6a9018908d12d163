"""Questions to the compiled core, each made by its seed alone, with the answers as arrays by name.

A *program* question keeps a window short of its first slide, so that every program is asked about the same rows; a
*chain* goes on from what the core answered before; a *flight* is a benchmark plant's; a *polytope* question is about
one set of rows.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aircraft.eclipse.plant import eclipse
from aircraft.elevator.plant import elevator
from aircraft.missile.plant import missile
from polytopes import EmptySetError, HPolytope, UndecidedError
from svo import UncertainModel, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.plant.scheduling import schedule_of
from tests.svo.observers.random_plants import random_plant

Answers = dict[str, NDArray[Any]]
VERDICTS = ("consistent", "undecided", "falsified")
PLANTS = (lambda: eclipse().with_models("lpv"), elevator, missile)


def program(seed: int) -> Answers:
    """A dozen samples of a random plant, every one with its box and four supports."""
    rng = np.random.default_rng([1, seed])
    model = random_plant(rng, 6)
    return _followed(WindowObserver(model, _start(model), horizon=10), _log(model, rng, 12), every=1)


def chain(seed: int) -> Answers:
    """Eighty samples, in half of the cases with a sensor that is wrong from the fiftieth on."""
    rng = np.random.default_rng([2, seed])
    model = random_plant(rng)
    log = _log(model, rng, 80)
    if seed % 2:
        log.y[50:, 0] += rng.choice([0.5, 5.0]) * (1.0 + np.abs(log.y[50:, 0]))
    horizon = (2, 5, 10, None)[seed % 4]
    return _followed(WindowObserver(model, _start(model), horizon=horizon), log, every=10)


def flight(seed: int) -> Answers:
    """The window observers of a benchmark plant's bank over one of its runs, each on its own."""
    plant: Any = PLANTS[seed % len(PLANTS)]()
    noise = plant.noise_sets[seed % len(plant.noise_sets)]
    kinds = ["none", *plant.faults]
    fault = kinds[seed // len(PLANTS) % len(kinds)]
    profile = "none" if fault == "none" else plant.faults[fault][0]
    log = plant.simulate(fault, profile, noise, seed)
    found: Answers = {}
    for name, observer in plant.bank(noise).observers.items():
        if isinstance(observer, WindowObserver):
            answers = _followed(observer, log, 50, partial(schedule_of, plant.scheduler()))
            found |= {f"{name}.{key}": value for key, value in answers.items()}
    return found


def polytope(seed: int) -> Answers:
    """Random rows, bounded or not, with repeated and slack ones: emptiness, supports, facets, one axis fewer."""
    rng = np.random.default_rng([3, seed])
    n = int(rng.integers(1, 7))
    m = int(rng.integers(n, 8 * n + 2))
    A, b = rng.normal(size=(m, n)), rng.uniform(-0.05, 1.0, m)
    if seed % 3 == 0:
        A = np.round(4 * A) / 4
        A[~A.any(axis=1), 0] = 1.0
    if seed % 5 == 0:
        A, b = np.vstack([A, 2 * A[: m // 2]]), np.append(b, 2 * b[: m // 2] + 0.1)
    P = HPolytope(np.ldexp(A, rng.integers(-20, 20, n)), b)
    found: Answers = {"status": np.array([P.emptiness().status])}
    questions: dict[str, Callable[[], Any]] = {
        "supports": lambda: P.support(rng.normal(size=(4, n)) * np.abs(P.A).max(axis=0)),
        "box": lambda: np.array(P.bounding_box()),
        "facets": lambda: np.array([len(P.remove_redundancy().b)]),
        "shadow": lambda: np.array(P.project(range(n - 1)).bounding_box()) if 1 < n < 5 else np.zeros(0),
    }
    for name, ask in questions.items():
        try:
            found[name] = np.asarray(ask(), float)
        except (EmptySetError, UndecidedError, ValueError) as error:
            found[name] = np.array([type(error).__name__])
    return found


KINDS: dict[str, Callable[[int], Answers]] = {
    "program": program, "chain": chain, "flight": flight, "polytope": polytope,
}  # fmt: skip


def _start(model: UncertainModel) -> HPolytope:
    return HPolytope.box(-np.ones(model.n_states), np.ones(model.n_states))


def _log(model: UncertainModel, rng: np.random.Generator, samples: int) -> Log:
    log = model.simulate(rng.uniform(-1.0, 1.0, model.n_states), rng.normal(size=(samples, model.n_inputs)), rng)
    log.y[rng.random(log.y.shape) < 0.05] = np.nan
    return log


def _followed(observer: WindowObserver, log: Log, every: int, scheduler: Any = None) -> Answers:
    """Verdicts of all samples; box and supports of some; whether the falsification is proven."""
    verdicts, boxes, supports, proven = [], [], [], -1
    directions = np.random.default_rng(len(log)).normal(size=(4, observer.model.n_states))
    for k, step in enumerate(drive(observer, log, scheduler=scheduler)):
        verdicts.append(VERDICTS.index(step.verdict))
        if step.verdict == "falsified":
            proven = int(step.certificate is not None and step.certificate.verify())
            break
        if k % every == 0:
            boxes.append(np.array(step.box))
            if every == 1:
                supports.append(step.support(directions))
    return {
        "verdicts": np.array(verdicts, np.int8),
        "boxes": np.array(boxes).reshape(-1, 2, observer.model.n_states),
        "supports": np.array(supports).reshape(-1, 4),
        "proven": np.array([proven], np.int8),
    }
