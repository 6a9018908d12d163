"""Sums, differences, images, hulls, reductions: on every kind of set, against the exact oracle, and by their laws."""

import itertools

import numpy as np
import ppl
import pytest
from exact_sets import polyhedron, supports
from hypothesis import given, settings
from hypothesis import strategies as st
from sets import CATALOGUE, DIMENSION, EMPTY, UNBOUNDED

from polytopes import EmptySetError, HPolytope, UnboundedError, convex_hull

PLANE = {name: P for name, P in CATALOGUE.items() if P.dim == 2}
EVERY = pytest.mark.parametrize("name", PLANE)
MAPS = {
    "turn": [[1.0, -1.0], [1.0, 1.0]],
    "singular": [[1.0, 2.0], [2.0, 4.0]],
    "zero": [[0.0, 0.0], [0.0, 0.0]],
    "to a line": [[1.0, -1.0]],
    "into space": [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]],
}


def directions(n: int) -> np.ndarray:
    grid = np.random.default_rng(1).integers(-4, 5, (25, n))
    return np.vstack([grid, np.eye(n, dtype=int), -np.eye(n, dtype=int)])


def total(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Sum of supports, where the empty set wins over an unbounded one."""
    empty = np.isneginf(first) | np.isneginf(second)
    return np.where(empty, -np.inf, np.where(empty, 0.0, first) + np.where(empty, 0.0, second))


@EVERY
@pytest.mark.parametrize("other", ["triangle", "empty", "whole space", "wedge", "segment by an equality", "point"])
def test_support_of_a_sum_is_the_sum_of_supports(name: str, other: str) -> None:
    P, Q, c = PLANE[name], PLANE[other], directions(2)
    assert_same_support(P.minkowski_sum(Q).support(c), total(P.support(c), Q.support(c)))


@EVERY
@pytest.mark.parametrize("kind", MAPS)
def test_support_of_an_image_is_the_support_along_the_transposed_map(name: str, kind: str) -> None:
    P, M = PLANE[name], np.array(MAPS[kind])
    shift = np.arange(1.0, len(M) + 1)
    c = directions(len(M))
    image = P.affine_map(M, shift)
    expected = np.where(np.isneginf(P.support(c @ M)), -np.inf, P.support(c @ M) + c @ shift)
    assert_same_support(image.support(c), expected)
    if name not in EMPTY:
        assert image.preimage(M, shift).contains(P)


def assert_same_support(values: np.ndarray, expected: np.ndarray) -> None:
    """Equal to 1e-11, infinities included."""
    np.testing.assert_allclose(values, expected, atol=1e-11, rtol=1e-11)


@EVERY
@pytest.mark.parametrize("other", ["triangle", "empty", "half-plane", "ray", "segment by two rows", "point", "thin"])
def test_support_of_a_hull_is_the_larger_support(name: str, other: str) -> None:
    P, Q, c = PLANE[name], PLANE[other], directions(2)
    hull = convex_hull([P, Q])
    assert hull.contains(P)
    assert hull.contains(Q)
    assert_same_support(hull.support(c), np.maximum(P.support(c), Q.support(c)))


@EVERY
def test_difference_is_the_largest_set_that_fits(name: str) -> None:
    P = PLANE[name]
    Q = HPolytope.box([-0.25, 0.0], [0.25, 0.5])
    rest = P.pontryagin_difference(Q)
    if rest.emptiness().status == "nonempty":
        assert P.contains(rest.minkowski_sum(Q), tol=1e-9)
    points = np.random.default_rng(2).uniform(-2.0, 2.0, (200, 2))
    fits = np.all([P.contains(points + v, tol=0.0) for v in Q.vertices()], axis=0)
    np.testing.assert_array_equal(rest.contains(points, tol=0.0), fits)
    assert P.pontryagin_difference(HPolytope.empty(2)).equals(HPolytope.whole_space(2))
    assert P.pontryagin_difference(PLANE["point"]).equals(P.affine_map(np.eye(2), [-0.25, 0.75]), tol=1e-12)
    if name not in ("whole space", "half-plane", "wedge", "cone"):  # which contain the wedge, but for a shift
        assert P.pontryagin_difference(PLANE["wedge"]).emptiness().status == "empty"


@EVERY
def test_outer_reduction(name: str) -> None:
    P = PLANE[name]
    Q = P.outer_reduce(4)
    assert Q.contains(P)
    assert Q.b.size <= 4
    assert Q.is_bounded() == P.is_bounded()
    with pytest.raises(ValueError, match="max_facets is 3"):
        P.outer_reduce(3)


def test_outer_reduction_of_a_many_sided_polygon() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    P = HPolytope(np.column_stack([np.cos(angles), np.sin(angles)]), np.ones(40))
    sizes = [P.outer_reduce(k).volume() for k in (4, 8, 16, 40)]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[-1] == pytest.approx(P.volume())
    assert P.outer_reduce(8).contains(P)
    assert sizes[1] < 1.1 * P.volume()


@EVERY
def test_volume(name: str) -> None:
    P = PLANE[name]
    if DIMENSION.get(name, 2) < 2:
        assert P.volume() == 0.0
    elif name in UNBOUNDED:
        assert P.volume() == np.inf
    else:
        expected = {"triangle": 0.5, "thin": 2.0**-30, "thin and skew": 2.0**-30}.get(name, 4.0)
        assert P.volume() == pytest.approx(expected, rel=1e-12)


def test_volumes_of_known_bodies() -> None:
    assert HPolytope.simplex(4).volume() == pytest.approx(1.0 / 24.0)
    assert HPolytope.cross_polytope(4).volume() == pytest.approx(2.0**4 / 24.0)
    assert HPolytope.box([0.0], [3.0]).volume() == pytest.approx(3.0)
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    assert HPolytope.box([0.0] * 3, [1.0, 2.0, 1e-8]).preimage(turn).volume() == pytest.approx(2e-8, rel=1e-6)


@EVERY
def test_random_points_lie_in_the_set(name: str) -> None:
    P, rng = PLANE[name], np.random.default_rng(0)
    if name in EMPTY:
        with pytest.raises(EmptySetError):
            P.random_points(3, rng)
    elif name in UNBOUNDED:
        with pytest.raises(UnboundedError):
            P.random_points(3, rng)
    else:
        assert P.contains(P.random_points(20, rng), tol=1e-12).all()


def test_random_points_are_spread_evenly() -> None:
    P = HPolytope.box([0.0, 0.0, 0.0], [1.0, 1e-3, 1.0])
    points = P.random_points(1500, np.random.default_rng(1)) * [1.0, 1e3, 1.0]
    np.testing.assert_allclose(points.mean(axis=0), 0.5, atol=0.04)
    np.testing.assert_allclose(points.var(axis=0), 1.0 / 12.0, atol=0.01)
    np.testing.assert_array_equal(
        P.random_points(5, np.random.default_rng(2)), P.random_points(5, np.random.default_rng(2))
    )


entries = st.integers(-3, 3)


@st.composite
def integer_sets(draw: st.DrawFn, n: int = 2) -> HPolytope:
    m = draw(st.integers(1, 5))
    A = draw(st.lists(st.lists(entries, min_size=n, max_size=n), min_size=m, max_size=m))
    b = draw(st.lists(st.integers(-1, 4), min_size=m, max_size=m))
    P = HPolytope(A, b)
    return P.intersection(HPolytope.box([-3.0] * n, [3.0] * n)) if draw(st.booleans()) else P


@settings(max_examples=80, deadline=None)
@given(integer_sets(), integer_sets())
def test_hulls_match_the_exact_oracle(P: HPolytope, Q: HPolytope) -> None:
    exact = polyhedron(P)
    exact.poly_hull_assign(polyhedron(Q))
    c = directions(2)
    np.testing.assert_allclose(convex_hull([P, Q]).support(c), supports(exact, c), atol=1e-9)


@settings(max_examples=80, deadline=None)
@given(integer_sets(), integer_sets())
def test_sums_match_the_exact_oracle(P: HPolytope, Q: HPolytope) -> None:
    lifted = polyhedron(P.product(Q))
    x = [ppl.Variable(j) for j in range(4)]
    for j in range(2):
        lifted.affine_image(x[j], x[j] + x[j + 2])
    lifted.remove_higher_space_dimensions(2)
    c = directions(2)
    np.testing.assert_allclose(P.minkowski_sum(Q).support(c), supports(lifted, c), atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(integer_sets(), integer_sets())
def test_difference_then_sum_stays_inside(P: HPolytope, Q: HPolytope) -> None:
    rest = P.pontryagin_difference(Q)
    if Q.emptiness().status == "nonempty" and rest.emptiness().status == "nonempty":
        assert P.contains(rest.minkowski_sum(Q), tol=1e-9)


@settings(max_examples=60, deadline=None)
@given(integer_sets(3), integer_sets(3))
def test_sum_then_difference_contains_the_set(P: HPolytope, Q: HPolytope) -> None:
    if Q.emptiness().status == "nonempty" and Q.is_bounded():
        assert P.minkowski_sum(Q).pontryagin_difference(Q).contains(P, tol=1e-9)


@settings(max_examples=60, deadline=None)
@given(integer_sets(), st.lists(entries, min_size=4, max_size=4))
def test_preimage_of_the_image_contains_the_set(P: HPolytope, flat: list[int]) -> None:
    M = np.reshape(flat, (2, 2)).astype(float)
    assert P.affine_map(M).preimage(M).contains(P, tol=1e-9)


def test_sums_in_four_dimensions() -> None:
    rng = np.random.default_rng(3)
    A = rng.standard_normal((20, 4))
    P = HPolytope(A / np.linalg.norm(A, axis=1)[:, None], rng.uniform(0.5, 1.5, 20))
    P = P.intersection(HPolytope.box([-2.0] * 4, [2.0] * 4))
    Q = HPolytope.box([-0.1, -0.2, -0.3, -0.4], [0.4, 0.3, 0.2, 0.1])
    c = rng.standard_normal((200, 4))
    np.testing.assert_allclose(P.minkowski_sum(Q).support(c), P.support(c) + Q.support(c), atol=1e-10)


def test_ill_conditioned_maps_are_not_inverted() -> None:
    P, M = PLANE["square"], np.array([[1.0, 1.0], [1.0, 1.0 + 2.0**-40]])
    c = directions(2)
    np.testing.assert_allclose(P.affine_map(M).support(c), P.support(c @ M), atol=1e-11)


def test_hull_needs_sets_of_one_dimension() -> None:
    with pytest.raises(ValueError, match="sets is empty"):
        convex_hull([])
    with pytest.raises(ValueError, match="Q has dimension 3"):
        convex_hull([HPolytope.empty(2), HPolytope.empty(3)])


def test_hulls_have_one_row_per_facet_with_and_without_doubt() -> None:
    """Points in general position, many on a facet, the same with noise below rounding, and slivers beside a facet."""
    rng = np.random.default_rng(4)
    sphere = rng.standard_normal((60, 4))
    grid = np.array(list(itertools.product([0.0, 1.0, 2.0], repeat=4)))
    bump = np.vstack([np.array(list(itertools.product([0.0, 1.0], repeat=3))), [[0.5, 0.5, 1.0 + 1e-9]]])
    skew = grid @ rng.standard_normal((4, 4))
    solid = np.array(list(itertools.product([0.0, 1.0, 2.0], repeat=3)))
    noisy = solid + 1e-14 * rng.standard_normal(solid.shape)
    for points, facets in ((sphere, None), (grid, 8), (skew, 8), (noisy, 6), (bump, 9)):
        hull = HPolytope.from_vertices(points)
        assert hull.contains(points, tol=1e-13).all()
        assert hull.b.size == hull.remove_redundancy().b.size
        assert facets is None or hull.b.size == facets
        # vertices are right to 1e-13, which the sharpest corner of the first points multiplies by a thousand
        assert hull.equals(HPolytope.from_vertices(hull.vertices()), tol=1e-10)


def test_inner_box_of_known_sets() -> None:
    for n in (1, 2, 5):
        np.testing.assert_allclose(HPolytope.cross_polytope(n).inner_box(), [np.full(n, -1 / n), np.full(n, 1 / n)])
        np.testing.assert_allclose(HPolytope.simplex(n).inner_box(), [np.zeros(n), np.full(n, 1 / n)], atol=1e-15)
    prism = HPolytope(np.empty((0, 3)), [], [[1.0, 1.0, 0.0]], [0.0]).intersection(HPolytope.box([-1.0] * 3, [1.0] * 3))
    lower, upper = prism.inner_box()
    np.testing.assert_allclose(upper - lower, [0.0, 0.0, 2.0], atol=1e-15)
    assert lower[0] + lower[1] == pytest.approx(0.0)
