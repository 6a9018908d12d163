"""The value type: construction, validation, immutability, and laws that relate its operations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1.0, 2.0], [1.0]), r"A has shape \(2,\)"),
        (([[1.0, 2.0]], [1.0, 2.0]), r"b has shape \(2,\); expected \(1,\)"),
        (([[np.nan, 2.0]], [1.0]), "A contains NaN"),
        (([[1.0, 2.0]], [-np.inf]), r"b\[0\] is -inf"),
        (([[1.0, 2.0]], [1.0], [[1.0]], [1.0]), r"C has shape \(1, 1\); expected \(q, 2\)"),
        (([[1.0, 2.0]], [1.0], [[1.0, 1.0]], [1.0, 2.0]), r"d has shape \(2,\)"),
        (([[1.0, 2.0]], [1.0], [[1.0, 1.0]]), "C and d must be given together"),
        ((np.empty((1, 0)), [1.0]), "at least one column"),
    ],
)
def test_wrong_rows_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        HPolytope(*arguments)


def test_wrong_types_and_arguments_are_refused() -> None:
    P = HPolytope.box([0.0, 0.0], [1.0, 1.0])
    with pytest.raises(TypeError, match="A has dtype"):
        HPolytope([["a", "b"]], [1.0])
    with pytest.raises(TypeError, match="A has dtype complex"):
        HPolytope([[1j, 0.0]], [1.0])
    with pytest.raises(ValueError, match=r"directions has shape \(3,\)"):
        P.support([1.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="x has shape"):
        P.contains([1.0])
    with pytest.raises(ValueError, match="tol is -1"):
        P.contains([0.0, 0.0], tol=-1.0)
    with pytest.raises(TypeError, match="Q is a ndarray"):
        P.intersection(np.eye(2))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="Q has dimension 3"):
        P.equals(HPolytope.empty(3))
    with pytest.raises(ValueError, match="M has shape"):
        P.preimage(np.eye(3))
    with pytest.raises(ValueError, match="upper has shape"):
        HPolytope.box([0.0, 0.0], [1.0])
    with pytest.raises(ValueError, match="V has shape"):
        HPolytope.from_vertices(np.empty((0, 2)))


def test_a_polytope_is_a_value() -> None:
    A, b = np.vstack([np.eye(2), -np.eye(2)]), np.ones(4)
    P = HPolytope(A, b)
    A[0, 0] = 7.0
    assert P.A[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        P.b[0] = 2.0
    with pytest.raises(AttributeError):
        P.A = A  # type: ignore[misc]
    assert "dim=2" in repr(P)
    assert "4 inequalities" in repr(P)


def test_rows_come_back_as_given() -> None:
    A, b = np.array([[3.0, 1e-7], [0.1, 0.2]]), np.array([1.0, 2.0])
    P = HPolytope(A, b, [[0.3, 0.1]], [0.7])
    np.testing.assert_array_equal(P.A, A)
    np.testing.assert_array_equal(P.b, b)
    np.testing.assert_array_equal(P.C, [[0.3, 0.1]])
    np.testing.assert_array_equal(P.d, [0.7])


def test_infinite_bounds_of_a_box_give_no_row() -> None:
    P = HPolytope.box([-np.inf, 0.0], [1.0, np.inf])
    assert P.b.size == 2
    np.testing.assert_array_equal(P.bounding_box()[0], [-np.inf, 0.0])


def test_tolerance_is_a_distance() -> None:
    P = HPolytope([[1000.0, 0.0]], [0.0])
    assert P.contains([1e-10, 0.0])
    assert not P.contains([1e-8, 0.0])
    assert P.contains([1e-8, 5.0], tol=1e-7)
    assert HPolytope.box([0.0], [1.0]).contains(HPolytope.box([0.0], [1.0 + 1e-6]), tol=2e-6)
    assert not HPolytope.box([0.0], [1.0]).contains(HPolytope.box([0.0], [1.0 + 1e-6]), tol=5e-7)


def test_vertices_of_points_in_general_position() -> None:
    rng = np.random.default_rng(2)
    on_sphere = rng.standard_normal((30, 4))
    on_sphere /= np.linalg.norm(on_sphere, axis=1)[:, None]
    V = HPolytope.from_vertices(on_sphere).vertices()
    order, expected = np.lexsort(V.T), np.lexsort(on_sphere.T)
    np.testing.assert_allclose(V[order], on_sphere[expected], atol=1e-12)


def test_vertices_with_badly_scaled_columns() -> None:
    rng = np.random.default_rng(3)
    scales = np.logspace(0, 6, 4)
    points = rng.standard_normal((25, 4))
    points /= np.linalg.norm(points, axis=1)[:, None]
    assert len(HPolytope.from_vertices(points * scales).vertices()) == 25


def test_vertices_of_a_thin_skew_box() -> None:
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    box = HPolytope.box([0.0, 0.0, 0.0], [1.0, 1e-9, 1.0])
    V = box.preimage(turn).vertices() @ turn.T
    assert V.shape == (8, 3)
    np.testing.assert_allclose(np.sort(V[:, 1])[[0, -1]], [0.0, 1e-9], atol=1e-15)


entries = st.integers(-3, 3)


@st.composite
def bounded_sets(draw: st.DrawFn, n: int = 3) -> HPolytope:
    m = draw(st.integers(0, 6))
    A = draw(st.lists(st.lists(entries, min_size=n, max_size=n), min_size=m, max_size=m))
    b = draw(st.lists(st.integers(0, 5), min_size=m, max_size=m))
    rows = np.vstack([np.reshape(A, (m, n)), np.eye(n), -np.eye(n)])
    return HPolytope(rows, np.append(b, np.full(2 * n, 2.0)))


@settings(max_examples=60, deadline=None)
@given(bounded_sets(), bounded_sets())
def test_intersection_lies_in_both_and_has_the_common_points(P: HPolytope, Q: HPolytope) -> None:
    common = P.intersection(Q)
    assert P.contains(common)
    assert Q.contains(common)
    points = np.random.default_rng(0).uniform(-2.0, 2.0, (50, 3))
    np.testing.assert_array_equal(common.contains(points), P.contains(points) & Q.contains(points))


@settings(max_examples=60, deadline=None)
@given(bounded_sets())
def test_vertices_and_rows_describe_the_same_set(P: HPolytope) -> None:
    V = P.vertices()
    c = np.random.default_rng(0).standard_normal((20, 3))
    np.testing.assert_allclose((V @ c.T).max(axis=0), P.support(c), atol=1e-11)
    assert P.contains(V).all()
    assert HPolytope.from_vertices(V).equals(P, tol=1e-9)


@settings(max_examples=60, deadline=None)
@given(bounded_sets(), st.lists(entries, min_size=9, max_size=9))
def test_preimage_contains_exactly_the_points_that_map_into_the_set(P: HPolytope, flat: list[int]) -> None:
    M = np.reshape(flat, (3, 3)).astype(float)
    points = np.random.default_rng(0).uniform(-2.0, 2.0, (50, 3))
    np.testing.assert_array_equal(P.preimage(M).contains(points, tol=0.0), P.contains(points @ M.T, tol=0.0))
