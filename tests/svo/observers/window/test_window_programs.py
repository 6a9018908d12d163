"""The dual simplex against HiGHS, on the very rows of random windows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from polytopes import HPolytope
from svo import WindowObserver
from svo.observers import window_kernel as kernel
from tests.svo.observers.random_plants import random_plant


def flown(rng: np.random.Generator, samples: int, **settings: object) -> WindowObserver:
    model = random_plant(rng)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(samples, model.n_inputs)), rng)
    observer = WindowObserver(model, HPolytope.box(x0 - 1.0, x0 + 1.0), **settings)  # type: ignore[arg-type]
    observer.run(log)
    return observer


def highs(observer: WindowObserver, cost: np.ndarray) -> float:
    w = observer._window.memory.arrays
    # Kept rows are up to 1e6 long: HiGHS, whose tolerances are absolute, misses their optimum by 3e-6, and once
    # they are shortened its presolve calls thin sets empty.
    lengths = np.maximum(np.abs(w["G"]).sum(axis=1), 1.0)
    G, upper, lower = w["G"] / lengths[:, None], w["upper"] / lengths, w["lower"] / lengths
    rows, bounds = np.vstack([G, -G]), np.concatenate([upper, -lower])
    result = linprog(-cost, A_ub=rows, b_ub=bounds, bounds=(-1.0, 1.0), options={"presolve": False})
    assert result.status == 0
    return -result.fun


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
@example(140133)
def test_supports_of_the_newest_state_are_optimal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    observer = flown(rng, 14, horizon=int(rng.choice([1, 3, 5, 8, 10])))
    w, n = observer._window.memory.arrays, observer.model.n_states
    at = int(w["clock"][kernel.TIME]) % (observer._window.memory.size.N + 1)
    for direction in rng.normal(size=(3, n)):
        w["query"][:] = direction
        stops = int(w["clock"][kernel.STOPS])
        observer._window.solve(kernel.QUERY)
        w = observer._window.memory.arrays  # in another block, if a basis had to grow
        if w["clock"][kernel.STOPS] > stops:
            continue  # at the limit of pivots: an outer bound, not the optimum
        cost = direction @ w["psi"]
        expected = float(direction @ w["phi"][at]) + highs(observer, cost)
        size = np.abs(cost).sum() + np.abs(direction) @ w["mag"][at]
        rounding = np.abs(direction) @ w["err"][at]  # of the state, bounded by powers of |A|
        assert expected - 1e-8 * size <= w["answer"][0] <= expected + rounding + 1e-7 * size


@pytest.mark.parametrize("limit", [0, 1, 5])
def test_a_program_that_is_stopped_early_is_wider_and_never_narrower(limit: int) -> None:
    rng = np.random.default_rng(7)
    observer = flown(rng, 14, horizon=5)
    memory = observer._window.memory
    w = memory.arrays
    for direction in rng.normal(size=(5, observer.model.n_states)):
        w["query"][:] = direction
        answers = []
        for pivots in (limit, kernel.UNLIMITED):
            kernel.solve(memory.address, kernel.QUERY, 0, 1, pivots)
            answers.append(float(w["answer"][0]))
        assert answers[1] <= answers[0] + 1e-12 * abs(answers[0])
