"""The guarantees in short: no set loses the state, no healthy plant is falsified, sets are outer. Below 30 CPU seconds.

Everything is run in units that are no powers of two and far from one, with the corners of every bound, and compared
with what does not share the code: the simulated state, and rational arithmetic.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope, UndecidedError, convex_hull
from svo import ArchitectureI, ConstrainedZonotopeObserver, PolytopeObserver, WindowObserver
from tests.svo.observers.random_plants import random_plant

ROOM = 1e-12  # the simulation itself rounds


def in_units(rng: np.random.Generator, P: HPolytope, factors: np.ndarray) -> HPolytope:
    return HPolytope(P.A / factors, P.b)


OBSERVERS: dict[str, tuple[Any, int, int]] = {
    "window": (lambda m, P: WindowObserver(m, P, horizon=4), 25, 16),
    "window, one step": (lambda m, P: WindowObserver(m, P, horizon=1), 10, 16),
    "split by signs": (lambda m, P: WindowObserver(m, P, horizon=3, sign_split=4), 4, 8),
    "zonotope": (ConstrainedZonotopeObserver, 12, 10),
    "small zonotope": (
        lambda m, P: ConstrainedZonotopeObserver(m, P, max_generators=2 * m.n_states, max_constraints=1),
        8,
        10,
    ),
    "polytope": (lambda m, P: PolytopeObserver(m, P, max_facets=40), 4, 6),
}


@pytest.mark.parametrize("name", OBSERVERS)
def test_no_state_is_lost_and_no_healthy_plant_is_falsified(name: str) -> None:
    make, plants, samples = OBSERVERS[name]
    for seed in range(plants):
        rng = np.random.default_rng([77, seed])
        model = random_plant(rng, largest=2 if name == "polytope" else 4)
        x0 = rng.uniform(-1.0, 1.0, model.n_states)
        log = model.simulate(x0, rng.normal(size=(samples, model.n_inputs)), rng, corners=bool(seed % 2))
        y = log.y.copy()
        y[rng.random(y.shape) < 0.2] = np.nan
        observer = make(model, HPolytope.box(np.minimum(x0, -1.0), np.maximum(x0, 1.0)))
        for k in range(samples):
            try:
                step = observer.update(y[0], log.u[0]) if k == 0 else observer.step(log.u[k - 1], y[k], log.u[k])
            except UndecidedError:
                break
            assert step.verdict != "falsified", (seed, k)
            low, high = step.box
            room = ROOM * (1.0 + np.abs(log.x[k]).max())
            assert (low <= log.x[k] + room).all(), (seed, k)
            assert (log.x[k] - room <= high).all(), (seed, k)


def test_a_bank_keeps_the_true_model() -> None:
    for seed in range(6):
        rng = np.random.default_rng([78, seed])
        model = random_plant(rng, largest=3)
        x0 = rng.uniform(-1.0, 1.0, model.n_states)
        log = model.simulate(x0, rng.normal(size=(12, model.n_inputs)), rng, corners=True)
        start = HPolytope.box(np.full(x0.size, -1.0), np.full(x0.size, 1.0))
        healthy = WindowObserver(model, start, horizon=3)
        noisy = WindowObserver(model.replace(n=4.0 * model.bounds()[2]), start, horizon=3)
        assert ArchitectureI(healthy, {"noise": noisy}).run(log).died_at["nominal"] is None


def exact(value: float) -> Fraction:
    return Fraction(value)


def test_sums_hulls_and_images_contain_every_exact_point() -> None:
    for seed in range(30):
        rng = np.random.default_rng([79, seed])
        n = int(rng.integers(1, 4))
        scale = 10.0 ** rng.uniform(-6.0, 6.0, n)
        V, W = (rng.normal(size=(n + 3, n)) * scale for _ in range(2))
        if seed % 3 == 0:
            V = V[:1] + rng.normal(size=(n + 2, 1)) * (V[1] - V[0])  # in a line
        P, Q = HPolytope.from_vertices(V), HPolytope.from_vertices(W)
        M = rng.normal(size=(n, n)) / scale
        hull = [exact_row(v) for v in np.vstack([V, W])]
        sums = [[a + b for a, b in zip(exact_row(v), exact_row(w), strict=True)] for v in V for w in W]
        images = [
            [sum((exact(m) * x for m, x in zip(row, v, strict=True)), Fraction(0)) for row in M]
            for v in map(exact_row, V)
        ]
        for set_, points in ((convex_hull([P, Q]), hull), (P.minkowski_sum(Q), sums), (P.affine_map(M), images)):
            assert all(holds(set_, point) for point in points), seed


def exact_row(v: np.ndarray) -> list[Fraction]:
    return [exact(x) for x in v.tolist()]


def holds(P: HPolytope, point: list[Fraction]) -> bool:
    """Whether a rational point satisfies every row."""

    def at(row: np.ndarray) -> Fraction:
        return sum((exact(a) * x for a, x in zip(row.tolist(), point, strict=True)), Fraction(0))

    return all(at(a) <= exact(b) for a, b in zip(P.A, P.b.tolist(), strict=True)) and all(
        at(c) == exact(d) for c, d in zip(P.C, P.d.tolist(), strict=True)
    )


def test_no_set_with_a_point_is_called_empty_and_supports_are_outer() -> None:
    for seed in range(60):
        rng = np.random.default_rng([80, seed])
        n = int(rng.integers(1, 5))
        A = rng.normal(size=(3 * n, n)) * 10.0 ** rng.uniform(-8.0, 8.0, n)
        x = rng.normal(size=n) / 10.0 ** rng.uniform(-8.0, 8.0, n)
        tight = [sum((exact(a) * exact(v) for a, v in zip(row, x, strict=True)), Fraction(0)) for row in A.tolist()]
        b = np.array([upward(value) for value in tight])
        P = HPolytope(A, b)
        assert P.emptiness().status != "empty", seed
        try:
            low, high = P.bounding_box()
        except UndecidedError:
            continue
        assert (low <= x).all(), seed
        assert (x <= high).all(), seed


def upward(value: Fraction) -> float:
    guess = float(value)
    return guess if exact(guess) >= value else float(np.nextafter(guess, np.inf))
