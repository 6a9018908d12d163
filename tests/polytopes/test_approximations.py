"""Directions, projections between two sets, largest copies, and exact numbers."""

from fractions import Fraction

import numpy as np
import ppl
import pytest
from exact_sets import polyhedron
from sets import CATALOGUE, EMPTY, UNBOUNDED

from polytopes import (
    EmptySetError,
    HPolytope,
    UnboundedError,
    box_directions,
    eigenvector_directions,
    octagon_directions,
    sphere_directions,
)

EVERY = pytest.mark.parametrize("name", CATALOGUE)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7])
def test_directions(n: int) -> None:
    assert HPolytope.box(-np.ones(n), np.ones(n)) == HPolytope(box_directions(n), np.ones(2 * n))
    assert octagon_directions(n).shape == (2 * n**2, n)
    assert len(np.unique(octagon_directions(n), axis=0)) == 2 * n**2
    T = sphere_directions(n, 200)
    np.testing.assert_allclose(np.linalg.norm(T, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(T, sphere_directions(n, 200))
    if n > 1:
        assert np.abs(T.mean(axis=0)).max() < (0.03 if n < 4 else 0.06)
        np.testing.assert_allclose(T.T @ T / len(T), np.eye(n) / n, atol=0.03 if n < 4 else 0.06)
        nearest = np.sort(T @ T.T, axis=1)[:, -2]
        assert nearest.max() < 1.0 - 1e-9  # no two alike


def test_supports_along_eigenvectors_are_multiplied() -> None:
    M = np.array([[0.5, 0.25, 0.0], [0.0, 0.75, 0.0], [1.0, 0.0, -0.25]])
    T, P = eigenvector_directions(M), HPolytope.cross_polytope(3)
    assert T.shape == (6, 3)
    values = np.linalg.eigvals(M.T)
    for k, value in enumerate(values):
        assert (M @ P).support(T[k]) == pytest.approx(abs(value) * P.support(np.sign(value) * T[k]))
    turn = eigenvector_directions([[0.0, -1.0], [1.0, 0.0]])
    assert turn.shape == (4, 2)
    assert np.linalg.matrix_rank(turn) == 2
    with pytest.raises(ValueError, match="expected a square matrix"):
        eigenvector_directions([[1.0, 2.0]])


@pytest.mark.parametrize("eps", [0.3, 0.05, 0.0])
def test_a_projection_is_between_two_sets(eps: float) -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        P = HPolytope(np.vstack([rng.standard_normal((20, 5)), np.eye(5), -np.eye(5)]), np.ones(30))
        kept = [3, 0, 1][: 2 + seed % 2]
        found, exact = P.project_within(kept, eps), P.project(kept)
        assert found.outer.contains(exact, tol=1e-12)
        assert exact.contains(found.inner, tol=1e-9)
        assert found.gap <= max(eps, 1e-9)
        T = rng.standard_normal((200, len(kept)))
        assert (found.outer.support(T) >= exact.support(T) - 1e-12).all()
        normals = found.inner.normalise()
        assert (exact.support(normals.A) <= normals.b + found.gap + 1e-9).all()
        if eps == 0.0:
            assert found.inner.equals(exact, tol=1e-8)


@EVERY
def test_projections_of_every_kind_between_two_sets(name: str) -> None:
    P = CATALOGUE[name]
    prism = P.product(HPolytope.box([-1.0], [1.0]))
    kept = list(range(P.dim))
    if name in UNBOUNDED and P.dim > 1 and P.affine_dim() == P.dim:
        with pytest.raises(UnboundedError):
            prism.project_within(kept, 0.1)
        return
    found = prism.project_within(kept, 1e-3)
    assert found.outer.contains(P, tol=1e-9)
    assert P.contains(found.inner, tol=1e-9)
    assert found.gap <= 1e-3


@EVERY
def test_the_largest_copy_of_a_box(name: str) -> None:
    P, Q = CATALOGUE[name], HPolytope.box(np.full(CATALOGUE[name].dim, -0.5), np.full(CATALOGUE[name].dim, 1.0))
    if name in EMPTY:
        with pytest.raises(EmptySetError):
            P.largest_copy(Q)
        return
    if name in ("whole space", "half-plane", "wedge", "half-line", "cone", "cone in space"):
        with pytest.raises(UnboundedError, match="any size"):
            P.largest_copy(Q)
        return
    found = P.largest_copy(Q)
    assert P.contains(found.set, tol=1e-12)
    assert found.set.equals(found.scale * Q + found.centre, tol=1e-12)
    assert found.scale >= 0.0
    assert (found.scale > 1e-15) == (P.affine_dim() == P.dim)
    larger = Q.scale(found.scale + 1e-6)
    assert P.pontryagin_difference(larger).is_empty()


def test_the_largest_copy_in_closed_form() -> None:
    simplex = HPolytope.simplex(3)
    assert simplex.largest_copy(simplex).scale == pytest.approx(1.0, rel=1e-14)
    assert simplex.largest_copy(-simplex).scale == pytest.approx(1.0 / 3.0, rel=1e-12)
    assert HPolytope.cross_polytope(4).largest_copy(HPolytope.box(-np.ones(4), np.ones(4))).scale == pytest.approx(0.25)
    with pytest.raises(UnboundedError, match="Q is unbounded"):
        simplex.largest_copy(HPolytope.whole_space(3))


@EVERY
def test_exact_numbers_are_those_of_an_exact_library(name: str) -> None:
    P, exact = CATALOGUE[name], polyhedron(CATALOGUE[name])
    points = (
        {
            tuple(Fraction(int(g.coefficient(x)), int(g.divisor())) for x in variables(P.dim))
            for g in exact.minimized_generators()
            if g.is_point()
        }
        if name not in EMPTY
        else set()
    )
    if name in UNBOUNDED:
        with pytest.raises(UnboundedError):
            P.vertices(exact=True)
    else:
        assert P.vertices(exact=True) == sorted(points)
    T = np.random.default_rng(5).integers(-3, 4, (12, P.dim))
    for row, value in zip(T, P.support(T, exact=True), strict=True):
        if name in EMPTY:
            assert value == -np.inf
            continue
        answer = exact.maximize(
            sum((int(c) * x for c, x in zip(row, variables(P.dim), strict=True)), 0 * variables(1)[0])
        )
        assert value == (Fraction(int(answer["sup_n"]), int(answer["sup_d"])) if answer["bounded"] else np.inf)
        assert P.support(row, exact=True) == value
        assert P.support(row) >= value


def variables(n: int) -> list:
    return [ppl.Variable(j) for j in range(n)]


def test_decimals_are_exact_too() -> None:
    P = HPolytope([[0.1, 0.2], [-1.0, 0.0], [0.0, -1.0]], [0.3, 0.0, 0.0])
    far = Fraction(0.3) / Fraction(0.1)
    assert P.support([1.0, 0.0], exact=True) == far
    assert P.vertices(exact=True)[-1] == (far, Fraction(0))
    with pytest.raises(TypeError, match="exact="):
        P.support([1.0, 0.0], True)  # type: ignore[misc]
