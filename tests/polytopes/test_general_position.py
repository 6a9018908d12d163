"""Vertices and facets by the compiled core, in general position and nearly not, against exact integers."""

import itertools
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest

from polytopes import HPolytope, kernel
from polytopes.checks import Floats
from polytopes.exact_generators import integer_form
from polytopes.general_position import listed_vertices, simplicial_facets
from polytopes.minkowski_weyl import ExactGenerators, generators_of


def exactly(P: HPolytope) -> ExactGenerators:
    return generators_of(integer_form(P.A, P.b, P.C, P.d))


def random_set(rng: np.random.Generator, n: int, m: int) -> HPolytope:
    """Rows around the origin, in units of their own."""
    units = 2.0 ** rng.integers(-30, 31, n)
    return HPolytope(rng.standard_normal((m, n)) * units, rng.uniform(0.5, 1.5, m))


def listed(P: HPolytope) -> Floats | None:
    return None if P.prepared is None else listed_vertices(P.prepared)


def incidences(P: HPolytope, V: list[list[Fraction]]) -> list[int]:
    """How many rows each vertex lies on, exactly."""
    rows = [[Fraction(v) for v in row] for row in P.A.tolist()]
    sides = [Fraction(v) for v in P.b.tolist()]
    return [
        sum(sum(a * x for a, x in zip(row, point, strict=True)) == side for row, side in zip(rows, sides, strict=True))
        for point in V
    ]


def test_vertices_of_random_sets_are_all_of_them() -> None:
    rng, proven = np.random.default_rng(0), 0
    for _ in range(60):
        n = int(rng.integers(2, 6))
        P = random_set(rng, n, int(rng.integers(n + 1, 14)))
        V, exact = listed(P), exactly(P)
        if V is None:
            assert len(exact.rays) or P.program.interior.radius == np.inf or P.prepared is None
            continue
        proven += 1
        assert not len(exact.rays)
        points = exact.points[np.lexsort(exact.points.T[::-1])]
        np.testing.assert_allclose(V, points, rtol=1e-13, atol=1e-15 * np.abs(points).max())
    assert proven > 30


def degenerate(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    """Rows of a set whose vertices lie on many of them."""
    kind = int(rng.integers(3))
    if kind == 0:
        A = np.array(list(itertools.product([-1.0, 1.0], repeat=n)))
        return A, np.ones(len(A))
    box = np.vstack([np.eye(n), -np.eye(n)])
    if kind == 1:
        return np.vstack([box, np.ones((1, n))]), np.append(np.ones(2 * n), float(n))
    return np.vstack([box, box[:1] + box[1:2]]), np.append(np.ones(2 * n), 2.0)


def around_a_point(rng: np.random.Generator, exponent: int) -> HPolytope:
    """Rows of integers through one point, each moved by some units of 2^exponent of its right-hand side."""
    n = int(rng.integers(2, 5))
    A, x = rng.integers(-9, 10, (2 * n + 3, n)).astype(float), rng.integers(1, 4, n)
    keep = (A @ x > 0) & A.any(axis=1)
    b = np.concatenate([(A @ x)[keep], np.full(2 * n, 20.0)])
    return HPolytope(
        np.vstack([A[keep], np.eye(n), -np.eye(n)]), b * (1.0 + np.ldexp(rng.integers(-3, 4, b.shape), exponent))
    )


def nearly_degenerate(rng: np.random.Generator, exponent: int) -> HPolytope:
    """A degenerate set whose numbers are moved by some units of 2^exponent."""
    A, b = degenerate(rng, int(rng.integers(2, 5)))
    return HPolytope(
        A + np.ldexp(rng.integers(-8, 9, A.shape), exponent), b + np.ldexp(rng.integers(-8, 9, b.shape), exponent)
    )


@pytest.mark.parametrize(
    ("kind", "exponent", "count"),
    [(nearly_degenerate, e, 12) for e in (-52, -45, -38, -30, -20, -8)]
    + [(around_a_point, e, 150) for e in (-53, -52)],
)
def test_sets_that_are_nearly_degenerate_are_told_rightly_or_not_at_all(
    kind: Callable[..., HPolytope], exponent: int, count: int
) -> None:
    rng = np.random.default_rng(-exponent)
    for _ in range(count):
        P = kind(rng, exponent)
        n, exact = P.dim, exactly(P)
        GT = np.vstack([P.A.T, -P.b])
        GT = np.ldexp(GT, -np.frexp(np.linalg.norm(GT, axis=0))[1])
        found = kernel.cone_rays(np.hstack([GT, -np.eye(n + 1)[:, -1:]]), np.eye(n + 1)[-1], True, 10_000)
        if found is None:
            continue
        points = [[Fraction(int(v), int(row[-1])) for v in row[:-1]] for row in exact.vertices.tolist()]
        assert incidences(P, points) == [n] * len(points)
        assert len(found[0]) == len(points)
        distances = np.abs(found[0][:, None, :-1] - exact.points[None]).max(axis=2)
        assert distances.min(axis=0).max() < 1e-12 * np.abs(exact.points).max()


@pytest.mark.parametrize("exponent", [-60, -54, -50, -45, -40, -36, -33, -30, -25, -8])
def test_vertices_of_degenerate_sets_are_those_that_rounding_can_tell_apart(exponent: int) -> None:
    rng, answered = np.random.default_rng([7, -exponent]), 0
    for _ in range(20):
        P = nearly_degenerate(rng, exponent)
        units = 2.0 ** rng.integers(-20, 21, P.dim)
        turn = np.linalg.qr(rng.standard_normal((P.dim, P.dim)))[0] if rng.integers(2) else np.eye(P.dim)
        P = HPolytope(P.A @ turn * units, P.b)
        V = listed(P)
        if V is None:
            continue
        answered += 1
        points, directions = exactly(P).points, rng.standard_normal((60, P.dim)) * units
        assert len(V) <= len(points)
        assert (V @ P.A.T - P.b).max() < 1e-10
        np.testing.assert_allclose((directions @ V.T).max(axis=1), (directions @ points.T).max(axis=1), atol=1e-9)
    assert answered > 10 or -42 < exponent < -25


def test_unbounded_and_empty_sets_are_left_to_others() -> None:
    assert listed(HPolytope([[1.0, 0.5], [-1.0, 0.5]], [1.0, 1.0])) is None
    assert listed(HPolytope([[1.0, 0.0]], [1.0])) is None
    assert listed(HPolytope(np.zeros((0, 2)), np.zeros(0))) is None
    assert listed(HPolytope([[1.0, 0.1], [-1.0, -0.1]], [-1.0, 0.5])) is None
    strip = HPolytope([[1.0, 0.3], [-1.0, -0.3], [0.1, 1.0]], [1.0, 1.0, 1.0])
    assert listed(strip) is None


def test_facets_of_random_points_are_all_of_them() -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        n = int(rng.integers(2, 6))
        points = rng.uniform(-1.0, 1.0, (int(rng.integers(n + 1, 15)), n))
        found = simplicial_facets(points)
        assert found is not None
        rows, simplices = found
        above = points @ rows[:, :-1].T + rows[:, -1]
        assert above.max() < 1e-12
        assert (np.abs(np.take_along_axis(above, simplices.T, axis=0)) < 1e-12).all()
        exact = HPolytope.from_vertices(np.round(points * 2.0**20))
        assert len(rows) == len(exact.b)


def test_facets_that_are_no_simplices_or_nearly_not_are_left_to_others() -> None:
    cube = np.array(list(itertools.product([-0.5, 0.5], repeat=3)))
    rng = np.random.default_rng(3)
    assert simplicial_facets(cube) is None
    assert simplicial_facets(cube + 1e-12 * rng.standard_normal(cube.shape)) is None
    assert simplicial_facets(np.vstack([cube[[0, 1, 2, 4]], cube[:1]])) is None
    assert simplicial_facets(cube[:4]) is None


def test_room_for_many_rays() -> None:
    rng = np.random.default_rng(4)
    A = rng.standard_normal((30, 7))
    P = HPolytope(A / np.linalg.norm(A, axis=1)[:, None], rng.uniform(0.9, 1.1, 30))
    V = listed(P)
    assert V is not None
    assert len(V) > 500
    GT = np.vstack([np.eye(3), -np.ones((1, 3))])
    GT = np.hstack([GT, np.vstack([-np.eye(3), -np.ones((1, 3))]), -np.eye(4)[:, -1:]])
    assert kernel.cone_rays(GT, np.eye(4)[-1], True, 7) is None
    found = kernel.cone_rays(GT, np.eye(4)[-1], True, 8)
    assert found is not None
    assert {tuple(row) for row in found[0]} == set(itertools.product([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [1.0]))
