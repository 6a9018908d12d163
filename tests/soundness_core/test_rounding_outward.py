"""Bounds that are rounded outward hold in rational arithmetic, in many sums that rounding to nearest gets wrong.

Each test fails with the constant that it is about at zero (`python -m tests.mutation`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import numpy as np

from polytopes import HPolytope
from polytopes.affine import affine_set
from polytopes.duality import multiplier_bounds
from polytopes.emptiness import strictly_inside
from polytopes.preparation import prepare
from svo.models.state_range import StateRange
from svo.observers.polytope.vertex_images import hull_of_images
from svo.observers.window.output_injection import OutputInjection

Exact = Fraction


def dot(a: Iterable[Any], b: Iterable[Any]) -> Fraction:
    """The exact product of two vectors of floats or fractions."""
    return sum((Exact(x) * Exact(y) for x, y in zip(a, b, strict=True)), Exact(0))


def exact_times(matrix: np.ndarray, v: Iterable[Any]) -> list[Fraction]:
    vector = list(v)
    return [dot(row, vector) for row in matrix.tolist()]


def test_supports_of_a_state_range() -> None:
    for seed in range(60):
        rng = np.random.default_rng([81, seed])
        n = int(rng.integers(2, 5))
        lower, upper = np.sort(rng.normal(size=(2, n)), axis=0)
        directions = rng.normal(size=(5, n))
        values = StateRange(lower, upper).support(directions)
        for row, value in zip(directions, values.tolist(), strict=True):
            assert dot(row, np.where(row > 0.0, upper, lower)) <= Exact(value), seed


def test_images_of_vertices() -> None:
    """Corners of Delta and of (x, w), each mapped exactly, are inside; w is eliminated through a rounded inverse."""
    for seed in range(12):
        rng = np.random.default_rng([82, seed])
        n = 2
        low, high = np.sort(rng.normal(size=(2, n + 1)), axis=0)
        maps = [(rng.normal(size=(n, n + 1)), rng.normal(size=n)) for _ in range(1 + seed % 2)]
        found = hull_of_images(HPolytope.box(low, high), maps, 40 if seed % 3 else None)
        for (M, t), corner in itertools.product(maps, itertools.product(*zip(low, high, strict=True))):
            point = [value + Exact(shift) for value, shift in zip(exact_times(M, corner), t.tolist(), strict=True)]
            sides = zip(exact_times(found.A, point), found.b.tolist(), strict=True)
            assert all(value <= Exact(side) for value, side in sides), seed


def test_the_remainder_of_output_injection() -> None:
    """x(k+1) less what the transformed model says of it, with y = C x + D u + c + F w exactly."""
    n, nu, nw = 2, 1, 2
    for seed in range(60):
        rng = np.random.default_rng([83, seed])
        stack = rng.normal(size=(1, n + nw, n + nu + 1 + nw))
        stack[0, n:] = rng.integers(-7, 8, (nw, n + nu + 1 + nw)) / 8.0  # short, so that y is a float
        x, u, w = (rng.integers(-7, 8, size) / 8.0 for size in (n, nu, nw))
        everything = np.concatenate([x, u, [1.0], w])
        y = stack[0, n:] @ everything
        assert exact_times(stack[0, n:], everything) == [Exact(v) for v in y.tolist()]
        box = -np.abs(w), np.abs(w)
        injection = OutputInjection(n, nu, nw)
        changed, z, half, injected = injection.transform(stack, y, box)
        if not injected:
            continue
        d, widening, _ = injection.widths(stack, y, u, np.abs(x), box, eps=0.0)
        known = np.concatenate([x, u, [1.0]])
        model = exact_times(changed[0, :, : n + nu + 1], known)
        truth = exact_times(stack[0, :n], everything)
        for i in range(n):
            assert abs(truth[i] - model[i]) <= Exact(d[i]), seed
        for i in range(nw):
            assert abs(Exact(z[i]) - model[n + i]) <= Exact(half[i]) + Exact(widening[i]), seed


def test_bounds_by_multipliers() -> None:
    for seed in range(60):
        rng = np.random.default_rng([84, seed])
        m, n = int(rng.integers(2, 7)), int(rng.integers(1, 4))
        A, b, c = rng.normal(size=(m, n)), rng.normal(size=m), rng.normal(size=n)
        y = np.abs(rng.normal(size=m))
        found = multiplier_bounds(A.T, b, c, y)
        assert dot(y, b) <= Exact(found.values[0]) - Exact(found.spare[0]), seed
        for j in range(n):
            assert abs(Exact(c[j]) - dot(y, A[:, j])) <= Exact(found.beside[0, j]), seed


def test_rows_on_an_affine_set() -> None:
    for seed in range(60):
        rng = np.random.default_rng([85, seed])
        n = int(rng.integers(2, 5))
        C, d = rng.normal(size=(1, n)), rng.normal(size=1)
        A, b = rng.normal(size=(6, n)), rng.normal(size=6)
        flat = affine_set(C, d)
        rows, rhs = flat.restrict(A, b)
        of_rows, of_rhs = flat.restriction_errors(A, b)
        for i in range(len(b)):
            pivot = A[i, flat.pivots[0]]
            solved = [Exact(int(flat.solved[0, q].p), int(flat.solved[0, q].q)) for q in range(n)]
            truth = [Exact(A[i, j]) - Exact(pivot) * s for j, s in zip(flat.free, solved[:-1], strict=True)]
            for q, value in enumerate(truth):
                assert abs(Exact(rows[i, q]) - value) <= Exact(of_rows[i, q]), seed
            assert abs(Exact(rhs[i]) - (Exact(b[i]) - Exact(pivot) * solved[-1])) <= Exact(of_rhs[i]), seed


def test_points_called_strictly_inside() -> None:
    """The right sides are the rows at the point, next to what a float sum gives: no slack that it can see."""
    for seed in range(400):
        rng = np.random.default_rng([86, seed])
        n = int(rng.integers(2, 6))
        A, x = rng.normal(size=(1, n)), rng.normal(size=n)
        b = np.nextafter(A @ x, rng.choice([-np.inf, np.inf], 1))
        program = prepare(A, b, np.empty((0, n)), np.empty(0))
        if strictly_inside(program, x / program.columns):
            assert dot(A[0], x) < Exact(b[0]), seed
        assert strictly_inside(prepare(A, b + 1e-12, np.empty((0, n)), np.empty(0)), x / program.columns), seed
