"""Rows 1e-8 to 1e-17 apart, nearly parallel, nearly through a vertex, turned cubes: exact answers against rationals."""

import itertools
from fractions import Fraction
from math import lcm

import numpy as np
import ppl
import pytest
from exact_sets import polyhedron

from polytopes import HPolytope

FOUND = (92, 276, 333, 492, 575, 900, 1034)
"""Cases with tiny entries: axes came into uneven units, and vertices, supports and points of distances off by 1e-8."""
CASES = [*FOUND, *range(12), *(pytest.param(k, marks=pytest.mark.slow) for k in range(12, 400))]


def tiny(rng: np.random.Generator) -> float:
    return float(rng.choice([-1, 1])) * 10.0 ** -rng.uniform(8, 16.5)


def nearly_degenerate(rng: np.random.Generator) -> HPolytope:
    n, kind = int(rng.integers(2, 5)), int(rng.integers(0, 6))
    cube, axes = HPolytope.box([-1] * n, [1] * n), np.vstack([np.eye(n), -np.eye(n)])
    if kind == 0:  # rows that nearly repeat
        A, b = rng.standard_normal((int(rng.integers(n + 1, 7)), n)), None
        b, i = np.ones(len(A)), rng.integers(0, len(A), 3)
        A = np.vstack([A, A[i] * (1 + np.array([tiny(rng) for _ in i])[:, None]), axes])
        b = np.concatenate([b, b[i] * (1 + np.array([tiny(rng) for _ in i])), np.full(2 * n, 3.0)])
    elif kind == 1:  # nearly parallel to those of a cube
        more = int(rng.integers(1, 4))
        i = rng.integers(0, 2 * n, more)
        A = np.vstack([axes, axes[i] + rng.standard_normal((more, n)) * 10.0 ** -rng.uniform(8, 16, (more, 1))])
        b = np.append(np.ones(2 * n), 1 + np.array([tiny(rng) for _ in range(more)]))
    elif kind == 2:  # nearly through its vertices
        A = np.vstack([axes, rng.choice([-1.0, 1.0], (2, n))])
        b = np.append(np.ones(2 * n), [n + tiny(rng), n * (1 + tiny(rng))])
    elif kind < 5:
        turned = cube if kind == 3 else HPolytope.cross_polytope(n)
        A, b = turned.A @ np.linalg.qr(rng.standard_normal((n, n)))[0], turned.b
    else:  # a slab
        normal, width = rng.standard_normal(n), 10.0 ** -rng.uniform(8, 17)
        A, b = np.vstack([normal, -normal, axes]), np.concatenate([[0.3 + width, -0.3], np.ones(2 * n)])
        b[0] = 0.3 - width if rng.random() < 0.3 else b[0]
    return HPolytope(A, b * (10.0 ** rng.integers(-3, 4) if rng.random() < 0.3 else 1.0))


def beside(rng: np.random.Generator, P: HPolytope) -> HPolytope:
    """A set that differs from P by one number, or another of the kind."""
    if rng.random() < 0.6:
        i, b = rng.integers(0, P.b.size), P.b.copy()
        b[i] = np.nextafter(b[i], rng.choice([-9, 9]) * 1e9) if rng.random() < 0.5 else b[i] * (1 + tiny(rng))
        return HPolytope(np.vstack([P.A[::-1], P.A[:1] * 3]), np.append(b[::-1], P.b[0] * 3.5))
    return next(Q for Q in (nearly_degenerate(rng) for _ in itertools.count()) if Q.dim == P.dim)


def exact_support(exact: ppl.C_Polyhedron, row: np.ndarray) -> Fraction:
    ratios = [Fraction(v) for v in row.tolist()]
    common = lcm(*(v.denominator for v in ratios))
    form = sum((int(v * common) * ppl.Variable(j) for j, v in enumerate(ratios)), 0 * ppl.Variable(len(row) - 1))
    answer = exact.maximize(form)
    return Fraction(int(answer["sup_n"]), int(answer["sup_d"]) * common)


def exact_vertices(exact: ppl.C_Polyhedron) -> list[tuple[Fraction, ...]]:
    n = exact.space_dimension()
    points = [g for g in exact.minimized_generators() if g.is_point()]
    return sorted(
        tuple(Fraction(int(v), int(g.divisor())) for v in ([*g.coefficients()] + [0] * n)[:n]) for g in points
    )


def keeps(P: HPolytope, x: list[float]) -> bool:
    rows = zip(P.A.tolist(), P.b.tolist(), strict=True)
    return all(sum(Fraction(u) * Fraction(v) for u, v in zip(row, x, strict=True)) <= Fraction(b) for row, b in rows)


@pytest.mark.parametrize("case", CASES)
def test_answers_are_those_of_rationals(case: int) -> None:
    rng = np.random.default_rng([case, 41])
    P = nearly_degenerate(rng)
    Q = beside(rng, P)
    first, second = polyhedron(P), polyhedron(Q)
    assert P.is_empty() == first.is_empty()
    assert (P <= Q, Q <= P, P == Q) == (second.contains(first), first.contains(second), first == second)
    both = ppl.C_Polyhedron(first)
    both.intersection_assign(second)
    meet = P.intersects(Q)
    assert bool(meet) == (not both.is_empty())
    assert meet or meet.verify(P, Q)
    if first.is_empty() or second.is_empty():
        return
    assert P.vertices(exact=True) == exact_vertices(first)
    assert P.affine_dim() == first.affine_dimension()
    size = float(max(abs(v) for x in exact_vertices(first) for v in x))
    excess = max(
        float(exact_support(second, a) - Fraction(b)) / np.linalg.norm(a)
        for a, b in zip(P.A, P.b.tolist(), strict=True)
    )
    assert P.contains(Q) == (excess <= 1e-9) or abs(excess - 1e-9) < 1e-11 * (1 + abs(P.b).max())
    for row in (P.A[0], rng.standard_normal(P.dim)):
        exact, found = exact_support(first, row), P.support(row)
        assert P.support(row, exact=True) == exact
        assert exact <= Fraction(found) <= exact + Fraction(2e-11 * size * np.abs(row).sum())
    minimal = P.remove_redundancy()
    assert minimal.contains(P)
    assert minimal.equals(P)
    assert polyhedron(minimal).contains(first)
    corners = P.vertices()
    assert P.contains(corners, tol=1e-10 * size).all()
    whole = HPolytope.from_vertices(corners)
    assert whole.contains(np.array(P.vertices(exact=True), dtype=float), tol=1e-9 * size).all()
    x = corners[rng.integers(len(corners))]
    assert (x in P) == keeps(P, x.tolist())
    y = x + rng.standard_normal(P.dim) * 10.0 ** rng.uniform(-12, 1)
    for norm in (1, 2, np.inf):
        distance = P.distance(y, norm=norm)
        assert distance.lower <= distance <= distance.upper
        assert abs(np.linalg.norm(distance.point - y, norm) - distance) <= 1e-15 * P.dim * (size + distance)
        assert P.contains(distance.point, tol=1e-14 * size)
    assert abs(Fraction(P.volume()) - P.volume(exact=True)) <= P.volume(exact=True) * Fraction(1, 10**9)
