"""States whose slope is too steep for any substep: roots near zero."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from polytopes import HPolytope
from svo import WindowObserver
from svo.checks import Array
from svo.functions import sqrt, sroot
from svo.models.nonlinear import NonlinearModel, Transition, Undecided
from tests.svo.functions.oracle.transition import of_model

SEED = 20_261_129
K = 0.4  # of dh/dt = -K sqrt(h) + Q


def tank(unit: float = 1.0) -> NonlinearModel:
    """A level in any unit."""
    return NonlinearModel(
        lambda h, u, w: [u[0] / unit + w[0] / unit - K * unit**-0.5 * sqrt(h[0])], lambda h: h, states=["h"],
        inputs=["Q"], disturbances=["d"], w=[0.0], n=[0.05 / unit], Ts=1.0, physical=([0.0], [40.0 / unit]),
    )  # fmt: skip


def is_in(found: Transition, x: Array, w: Array, end: Array) -> bool:
    room = 1e-12 * np.abs(end) + 1e-300
    rest = end - found.A @ x - found.a - found.E @ w
    inside = (end >= found.box.lower - room) & (end <= found.box.upper + room)
    return bool((np.abs(rest) <= found.R + room).all() and inside.all())


@pytest.mark.parametrize("unit", [1.0, 2.0**-30, 2.0**40])
@pytest.mark.parametrize("top", [0.0, 1e-14, 1e-10, 1e-6, 1e-3, 0.03, 0.05])
def test_a_tank_that_stands_empty_has_a_transition(top: float, unit: float) -> None:
    """Of dh/dt = -K sqrt(h) the root falls by K t / 2, and stays at zero."""
    found = tank(unit).transition([0.0], [top / unit], [0.0])
    for h in top * np.linspace(0.0, 1.0, 11):
        end = max(0.0, np.sqrt(h) - 0.5 * K) ** 2
        assert is_in(found, np.array([h / unit]), np.zeros(1), np.array([end / unit]))
    assert found.box.upper[0] * unit <= (1e-3 if top < 0.01 else 0.1) * top + 1e-150
    assert found.substeps <= 256


def test_a_tank_that_runs_empty_and_is_filled_again_is_never_undecided() -> None:
    model, rng = replace(tank(), w=[0.02]), np.random.default_rng(SEED)
    h, u, level = 0.5, np.where(np.arange(60) % 30 < 8, 0.4, 0.0)[:, None], []
    for (Q,), d in zip(u, rng.choice([-0.02, 0.02], 60), strict=True):
        level.append(h)  # from an empty tank the disturbance takes nothing: it keeps to what is physical
        way = solve_ivp(
            lambda t, x, q: q - K * np.sqrt(np.maximum(x, 0.0)), (0, 1), [h], args=(Q + d,), rtol=1e-11, atol=1e-13,
            max_step=0.02, method="LSODA",
        )  # fmt: skip
        h = max(0.0, way.y[0, -1])
    truth = np.array(level)
    y = truth[:, None] + 0.05 * rng.choice([-1.0, 1.0], (60, 1)) * (1.0 - 1e-9)
    y[20:28] = np.nan
    observer = WindowObserver(model, HPolytope.box([0.3], [0.7]))
    for k in range(60):
        step = observer.update(y[0]) if k == 0 else observer.step(u[k - 1], y[k])
        assert step.verdict == "consistent", (k, step.reason)
        assert step.box[0][0] - 1e-9 <= truth[k] <= step.box[1][0] + 1e-9, k


def steep(rng: np.random.Generator) -> NonlinearModel:
    """Two levels with a pipe between."""
    a, b, c = 10.0 ** rng.uniform(-1, 3, 3)
    return NonlinearModel(
        lambda x, w: [w[0] - a * sroot(x[0] - x[1]), b * sroot(x[0] - x[1]) - c * x[1]], lambda x: x,
        states=["x", "z"], disturbances=["d"], w=[0.1], Ts=1.0, largest=([-1e3, -1e3], [1e3, 1e3]),
    )  # fmt: skip


def test_random_steep_plants_are_contained() -> None:
    rng, found = np.random.default_rng(SEED), 0
    for _ in range(10):
        model = steep(rng)
        lower = rng.normal(size=2) * 10.0 ** rng.uniform(-8, 0)
        upper = lower + 10.0 ** rng.uniform(-9, -1, 2)
        try:
            move = model.transition(lower, upper)
        except Undecided:
            continue
        found += bool((move.A == 0.0).all(axis=1).any())
        for _ in range(2):
            x, w = lower + rng.integers(0, 2, 2) * (upper - lower), np.array([rng.choice([-0.1, 0.1])])
            value = model.flow.tape.values
            way = solve_ivp(
                lambda t, z, d, f: f(np.concatenate([z, d])), (0, 1), x, args=(w, value), rtol=1e-6, atol=1e-9,
                method="LSODA",
            )  # fmt: skip
            end, room = way.y[:, -1], 1e-4 * np.abs(way.y).max(axis=1) + 1e-7
            rest = np.abs(end - move.A @ x - move.a - move.E @ w)
            assert (rest <= move.R + room).all()
            assert ((end >= move.box.lower - room) & (end <= move.box.upper + room)).all()
    assert found >= 2  # whose slope was too steep for a line


def test_the_core_does_what_the_rules_in_balls_say() -> None:
    rng = np.random.default_rng(SEED)
    cases = [(tank(), [0.0], [top], [0.0]) for top in (1e-9, 1e-6)]
    cases += [(steep(rng), [0.0, 0.0], [1e-9, 1e-9], [])]
    for model, low, high, u in cases:
        there = of_model(model, np.array(low), np.array(high), np.array(u), 1.0)
        here = model.transition(low, high, u)
        assert here.substeps == there.substeps
        assert ((here.A == 0.0).all(axis=1) == (there.A == 0.0).all(axis=1)).all()
        assert pytest.approx(there.R, rel=1e-6, abs=1e-14) == here.R
        assert pytest.approx(there.box.lower, rel=1e-6, abs=1e-14) == here.box.lower
        assert pytest.approx(there.box.upper, rel=1e-6, abs=1e-14) == here.box.upper
