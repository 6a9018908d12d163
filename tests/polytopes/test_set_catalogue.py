"""Every operation on every kind of set: empty, whole, unbounded, flat, 1-D, point, duplicate, scaled and zero rows."""

import numpy as np
import pytest
from sets import CATALOGUE, DIMENSION, EMPTY, FACETS, UNBOUNDED, VERTICES

from polytopes import EmptySetError, HPolytope, UnboundedError, union_bounds

EVERY = pytest.mark.parametrize("name", CATALOGUE)


def directions(P: HPolytope) -> np.ndarray:
    return np.random.default_rng(1).standard_normal((40, P.dim))


@EVERY
def test_emptiness(name: str) -> None:
    P, answer = CATALOGUE[name], CATALOGUE[name].emptiness()
    if name in EMPTY:
        assert answer.status == "empty"
        assert answer.certificate is not None
        assert answer.certificate.verify(P)
    else:
        assert answer.status == "nonempty"
        assert answer.witness is not None
        assert P.contains(answer.witness)


@EVERY
def test_support_and_bounds(name: str) -> None:
    P = CATALOGUE[name]
    values = P.support(directions(P))
    assert P.is_bounded() == (name not in UNBOUNDED)
    if name in EMPTY:
        assert (values == -np.inf).all()
        with pytest.raises(EmptySetError):
            P.bounding_box()
        with pytest.raises(EmptySetError):
            P.chebyshev()
        return
    result, (lower, upper) = P.support_points(directions(P)), P.bounding_box()
    np.testing.assert_array_equal(result.values, values)
    finite = np.isfinite(values)
    assert finite.all() == (name not in UNBOUNDED)
    assert P.contains(result.points[finite]).all()
    assert np.isnan(result.points[~finite]).all()
    np.testing.assert_allclose(
        np.sum(result.points * directions(P), axis=1)[finite], values[finite], rtol=1e-12, atol=1e-15
    )
    for j, axis in enumerate(np.eye(P.dim)):
        assert (lower[j], upper[j]) == pytest.approx((-P.support(-axis), P.support(axis)), abs=1e-15)
    ball = P.chebyshev()
    assert P.contains(ball.centre)
    assert ball.radius >= 0.0


@EVERY
def test_dimension_and_minimal_description(name: str) -> None:
    P = CATALOGUE[name]
    assert P.affine_dim() == DIMENSION.get(name, 2)
    Q = P.remove_redundancy()
    assert (Q.b.size, Q.d.size) == FACETS[name]
    assert Q.equals(P)
    np.testing.assert_allclose(Q.support(directions(P)), P.support(directions(P)), atol=1e-12)


@EVERY
def test_vertices(name: str) -> None:
    P = CATALOGUE[name]
    if name in UNBOUNDED:
        with pytest.raises(UnboundedError, match="intersect it with a box"):
            P.vertices()
        return
    V = P.vertices()
    assert V.shape == (VERTICES[name], P.dim)
    if len(V):
        assert P.contains(V).all()
        np.testing.assert_allclose((V @ directions(P).T).max(axis=0), P.support(directions(P)), atol=1e-12)
        again = HPolytope.from_vertices(V)
        assert again.equals(P, tol=1e-9)
        assert again.affine_dim() == P.affine_dim()


@EVERY
def test_containment_and_equality(name: str) -> None:
    P = CATALOGUE[name]
    assert P.contains(P)
    assert P.equals(P)
    assert P.contains(HPolytope.empty(P.dim))
    assert HPolytope.whole_space(P.dim).contains(P)
    assert HPolytope.empty(P.dim).contains(P) == (name in EMPTY)
    assert P.contains(HPolytope.whole_space(P.dim)) == (name == "whole space")


@EVERY
def test_intersection_product_preimage(name: str) -> None:
    P = CATALOGUE[name]
    assert P.intersection(P).equals(P)
    assert P.intersection(HPolytope.whole_space(P.dim)).equals(P)
    assert P.intersection(HPolytope.empty(P.dim)).emptiness().status == "empty"
    prism = P.product(HPolytope.box([0.0], [1.0]))
    assert prism.affine_dim() == (-1 if name in EMPTY else P.affine_dim() + 1)
    shift = np.full(P.dim, 0.5)
    moved = P.preimage(2.0 * np.eye(P.dim), shift)
    c = directions(P)
    np.testing.assert_allclose(2.0 * moved.support(c) + c @ shift, P.support(c), atol=1e-12)
    collapsed = P.preimage(np.zeros((P.dim, 2)))
    assert (collapsed.emptiness().status == "nonempty") == bool(P.contains(np.zeros(P.dim), tol=0.0))


@EVERY
def test_a_cone_keeps_its_apex_and_a_flat_set_its_points_in_any_template(name: str) -> None:
    P = CATALOGUE[name]
    if name in EMPTY:
        return
    best = P.support_points(directions(P)).points
    for corner in np.vstack([P.generators().vertices, best[np.isfinite(best).all(axis=1)][:1]]):
        point = HPolytope(np.empty((0, P.dim)), [], np.eye(P.dim), corner)
        if P.intersection(point).emptiness().status == "nonempty":  # else it was rounded
            T = directions(P)
            for Q in (P.outer_template(T), union_bounds([P, P], directions=T), P.affine_map(np.eye(P.dim))):
                assert Q.intersection(point).emptiness().status == "nonempty"


@EVERY
def test_outer_template(name: str) -> None:
    P = CATALOGUE[name]
    normals = np.vstack([np.eye(P.dim), -np.eye(P.dim), directions(P)[:5]])
    T = P.outer_template(normals)
    assert T.contains(P, tol=1e-13)
    np.testing.assert_allclose(T.support(normals), P.support(normals), atol=1e-12)


@EVERY
def test_inner_box_lies_inside_and_no_larger_one_does(name: str) -> None:
    P = CATALOGUE[name]
    if name in EMPTY | UNBOUNDED:
        with pytest.raises(EmptySetError if name in EMPTY else UnboundedError):
            P.inner_box()
        return
    lower, upper = P.inner_box()
    assert P.contains(HPolytope.box(lower, upper), tol=1e-12)
    for j, axis in enumerate(np.eye(P.dim)):
        assert lower[j] <= upper[j]
        assert not P.contains(HPolytope.box(lower, upper + 1e-6 * axis), tol=1e-9 * 2.0**-9)
        assert not P.contains(HPolytope.box(lower - 1e-6 * axis, upper), tol=1e-9 * 2.0**-9)


@EVERY
def test_bounds_of_a_union(name: str) -> None:
    P = CATALOGUE[name]
    Q = HPolytope.box(np.full(P.dim, 2.0), np.full(P.dim, 3.0))
    normals = np.vstack([np.eye(P.dim), -np.eye(P.dim), directions(P)[:5]])
    for chosen in (None, normals):
        bounds = union_bounds([P, Q, HPolytope.empty(P.dim)], directions=chosen)
        assert bounds.contains(P, tol=0.0 if name in EMPTY else 1e-13)
        assert bounds.contains(Q, tol=1e-13)
        tested = normals[: 2 * P.dim] if chosen is None else normals
        np.testing.assert_allclose(bounds.support(tested), np.maximum(P.support(tested), Q.support(tested)), atol=1e-12)
    assert union_bounds([HPolytope.empty(P.dim)]).emptiness().status == "empty"
