"""Tasks that two versions of the project do in turns; run by the interpreter of either: ``python -P _timed_tasks.py``.

A line with the name of a task on standard input is answered by the CPU time of one turn, in microseconds for each unit
of work. Only names are used that both versions have.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np

from aircraft.eclipse.plant import INITIAL_LOWER, INITIAL_UPPER, eclipse
from polytopes import HPolytope, convex_hull, warm_up
from svo import WindowObserver

SETTLE, SAMPLES, SEED = 60, 240, 20_130_613
Turn = Callable[[], float]


def random_polytope(n: int, m: int, seed: int = 0) -> HPolytope:
    """Unit normals at random, right-hand sides in [1/2, 3/2]."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((m, n))
    return HPolytope(A / np.linalg.norm(A, axis=1)[:, None], rng.uniform(0.5, 1.5, m))


def sparse_polytope(n: int, m: int, nonzeros: int) -> HPolytope:
    """Rows with few nonzero entries in the box of half-width 2."""
    rng = np.random.default_rng(0)
    A = np.zeros((m - 2 * n, n))
    for row in A:
        row[rng.choice(n, nonzeros, replace=False)] = rng.standard_normal(nonzeros)
    A /= np.linalg.norm(A, axis=1)[:, None]
    axes = np.eye(n)
    return HPolytope(np.vstack([A, axes, -axes]), np.append(rng.uniform(0.5, 1.5, len(A)), np.full(2 * n, 2.0)))


def repeated(task: Callable[[], object], units: int = 1) -> Turn:
    """The task as often as fits into some milliseconds."""
    task()
    begun = process_time()
    task()
    times = max(1, int(0.01 / max(process_time() - begun, 1e-6)))

    def turn() -> float:
        begun = process_time()
        for _ in range(times):
            task()
        return 1e6 * (process_time() - begun) / (times * units)

    return turn


def flight(models: list[str], horizon: int, every_sample: bool = False) -> Turn:
    """Observers of the Eclipse over a healthy flight, sample by sample; the first samples do not count."""
    plant = eclipse().with_models("lpv")
    log = plant.simulate("none", "none", "quiet", SEED)
    bank, schedule = plant.bank("quiet"), list(map(plant.scheduler(), log.y))
    start = HPolytope.box(INITIAL_LOWER, INITIAL_UPPER)
    observers = [WindowObserver(bank.observers[name].model, start, horizon=horizon) for name in models]
    for observer in observers if every_sample else ():
        observer._settings.__dict__["block"] = 1

    def turn() -> float:
        for observer in observers:
            observer.reset(start)
        for k in range(SAMPLES):
            if k == SETTLE:
                begun = process_time()
            for observer in observers:
                if k == 0:
                    observer.update(log.y[0], log.u[0], schedule[0])
                else:
                    observer.step(log.u[k - 1], log.y[k], log.u[k], schedule[k])
        return 1e6 * (process_time() - begun) / (SAMPLES - SETTLE)

    return turn


def whole_log() -> Turn:
    """The Eclipse's bank over a whole log."""
    plant: Any = eclipse().with_models("lpv")
    log = plant.simulate("none", "none", "quiet", SEED)
    log = replace(log, schedule=np.array(list(map(plant.scheduler(), log.y))))

    def turn() -> float:
        bank = plant.bank("quiet")
        begun = process_time()
        bank.run(log)
        return 1e6 * (process_time() - begun) / len(log)

    return turn


def tasks() -> Iterator[tuple[str, Callable[[], Turn]]]:
    """Every task by its name, with what prepares it."""
    four = list(eclipse().with_models("lpv").bank("quiet").observers)
    for name in four:
        yield f"window step, {name}, N = 10", lambda name=name: flight([name], 10)  # type: ignore[misc]
    yield "window step, nominal, N = 10, every sample", lambda: flight(["nominal"], 10, every_sample=True)
    for N in (1, 5, 20, 50):
        yield f"window step, nominal, N = {N}", lambda N=N: flight(["nominal"], N)  # type: ignore[misc]
        yield f"window step, dynamics, N = {N}", lambda N=N: flight(["dynamics"], N)  # type: ignore[misc]
    for N in (1, 5, 10, 20, 50):
        yield f"bank of four, N = {N}", lambda N=N: flight(four, N)  # type: ignore[misc]
    yield "bank of four, whole log", whole_log
    for n, m in ((4, 20), (4, 60), (4, 200), (6, 100), (8, 50), (8, 200), (12, 100), (12, 400)):
        yield f"100 supports ({n}, {m}), each", lambda n=n, m=m: supports(n, m, 100)  # type: ignore[misc]
        yield f"one support ({n}, {m})", lambda n=n, m=m: supports(n, m, 1)  # type: ignore[misc]
        yield f"emptiness ({n}, {m})", lambda n=n, m=m: emptiness(n, m)  # type: ignore[misc]
    for question in ("emptiness", "support", "bounding_box", "is_bounded"):
        yield f"a new box in R^4, {question}", lambda question=question: asked(question)  # type: ignore[misc]
    for n, m in ((2, 500), (2, 5000), (3, 500), (3, 4000), (4, 200), (4, 2000), (5, 800), (6, 200), (8, 200)):
        yield f"redundancy ({n}, {m})", lambda n=n, m=m: redundancy(random_polytope(n, m))  # type: ignore[misc]
        if m <= 2000:
            yield f"redundancy, tangent ({n}, {m})", lambda n=n, m=m: redundancy(tangent(n, m))  # type: ignore[misc]
    for n, k, m, few in ((8, 4, 50, 2), (8, 3, 40, 3), (5, 3, 40, 3), (5, 3, 40, 5), (6, 2, 40, 6), (6, 3, 60, 6),
                         (6, 4, 40, 6), (6, 4, 60, 6), (7, 3, 40, 7), (7, 4, 30, 7), (8, 4, 30, 8)):  # fmt: skip
        yield f"projection R^{n} -> R^{k}, {m} rows, {few} nonzeros", lambda n=n, k=k, m=m, few=few: projection(n, k, m, few)  # type: ignore[misc]  # noqa: E501
    yield "sum with a box (4, 50)", sum_with_box
    yield "hull of 4 sets (4, 50)", hull


def supports(n: int, m: int, count: int) -> Turn:
    P, directions = random_polytope(n, m), np.random.default_rng(1).standard_normal((count, n))
    P.emptiness()
    return repeated(lambda: P.support(directions), count)


def asked(question: str) -> Turn:
    """A question to boxes that have not been asked before; their construction does not count."""
    corner = np.ones(4)
    arguments = (corner,) if question == "support" else ()

    def turn() -> float:
        boxes = [HPolytope.box(-corner, corner) for _ in range(100)]
        begun = process_time()
        for box in boxes:
            getattr(box, question)(*arguments)
        return 1e6 * (process_time() - begun) / len(boxes)

    return turn


def emptiness(n: int, m: int) -> Turn:
    P = random_polytope(n, m)
    return repeated(lambda: HPolytope(P.A, P.b).emptiness())


def tangent(n: int, m: int) -> HPolytope:
    return HPolytope(random_polytope(n, m).A, np.ones(m))


def redundancy(P: HPolytope) -> Turn:
    return repeated(lambda: HPolytope(P.A, P.b).remove_redundancy())


def projection(n: int, kept: int, m: int, nonzeros: int) -> Turn:
    P = sparse_polytope(n, m, nonzeros)
    return repeated(lambda: HPolytope(P.A, P.b).project(range(kept)))


def sum_with_box() -> Turn:
    P, Q = random_polytope(4, 50), HPolytope.box(np.full(4, -0.1), np.full(4, 0.2))
    return repeated(lambda: HPolytope(P.A, P.b).minkowski_sum(Q))


def hull() -> Turn:
    sets = [random_polytope(4, 50, seed).affine_map(np.eye(4), [0.5 * seed, 0, 0, 0]) for seed in range(4)]
    return repeated(lambda: convex_hull(sets))


def main() -> None:
    """Answer until there are no more questions; what a library prints is no answer."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    warm_up()
    known, ready = dict(tasks()), {}
    print("\n".join(known), end="\n\n", file=answers, flush=True)
    for line in sys.stdin:
        name = line.rstrip("\n")
        if name not in ready:
            ready[name] = known[name]()
            ready[name]()
        print(ready[name](), file=answers, flush=True)


main()
