"""Vertices that are kept are those of the rows, exactly, and change no answer."""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import ppl
import pytest
from exact_sets import polyhedron
from sets import CATALOGUE, EMPTY, UNBOUNDED

from polytopes import HPolytope, convex_hull

RNG = np.random.default_rng(3)
SHEAR = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]])
SOURCES: dict[str, Callable[[], HPolytope]] = {
    "box": lambda: HPolytope.box([0.1, -0.7, 1 / 3], [0.3, 0.9, 0.5]),
    "flat box": lambda: HPolytope.box([0.1, 0.7, 0.0], [0.3, 0.7, 0.5]),
    "point": lambda: HPolytope.box([0.1, 0.7, 0.0], [0.1, 0.7, 0.0]),
    "simplex": lambda: HPolytope.simplex(3),
    "cross-polytope": lambda: HPolytope.cross_polytope(3),
    "hull": lambda: HPolytope.from_vertices(RNG.integers(-3, 4, (12, 3))),
    "hull of a grid": lambda: HPolytope.from_vertices(np.stack(np.meshgrid(*[[0, 1, 2]] * 3), -1).reshape(-1, 3)),
    "flat hull": lambda: HPolytope.from_vertices([[0, 0, 1], [4, 0, 1], [0, 4, 1], [1, 1, 1], [2, 2, 1]]),
    "thirds": lambda: HPolytope.from_vertices([[0, 0, 0], [3, 1, 0], [1, 3, 0], [0, 0, 7]]),
    "decimal hull": lambda: HPolytope.from_vertices(RNG.standard_normal((8, 3))),
    "segment": lambda: HPolytope.from_vertices([[0.1, 0.2, 0.3], [0.3, 0.1, 0.7]]),
}
MAPS: dict[str, Callable[[HPolytope], HPolytope]] = {
    "itself": lambda P: P,
    "moved": lambda P: P.translate([1.0, -0.5, 8.0]),
    "moved by decimals": lambda P: P.translate([0.1, -1e-3, 1e10]),
    "scaled": lambda P: 3 * P,
    "scaled by decimals": lambda P: -0.1 * P,
    "turned": lambda P: -P,
    "to the origin": lambda P: 0 * P,
    "sheared": lambda P: SHEAR @ P,
    "permuted": lambda P: np.eye(3)[[2, 0, 1]] @ P,
    "rotated": lambda P: np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]) @ P,
    "flattened": lambda P: np.diag([1.0, 1.0, 0.0]) @ P,
    "with a segment": lambda P: P.product(HPolytope.box([0.1], [0.4])),
    "squared": lambda P: P**2 if P.b.size < 7 else P,
    "twice": lambda P: SHEAR @ (2 * P + [1.0, 2.0, 3.0]) - [0.25, 0.0, 0.0],
}


def points(P: HPolytope) -> set:
    return {
        tuple(Fraction(int(g.coefficient(ppl.Variable(j))), int(g.divisor())) for j in range(P.dim))
        for g in polyhedron(P).minimized_generators()
    }


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("name", MAPS)
def test_kept_vertices_are_those_of_the_rows(source: str, name: str) -> None:
    P = MAPS[name](SOURCES[source]())
    found = P.vertices(exact=True)
    assert found == sorted(points(P))
    if P.made_of is None:
        return
    bare = HPolytope(*P.table)
    assert bare.made_of is None
    assert bare.vertices(exact=True) == found
    V, W = P.vertices(), bare.vertices()
    size = np.abs(V).max() + 1e-300
    V, W = (U[np.lexsort(np.round(U / size, 9).T[::-1])] for U in (V, W))
    np.testing.assert_allclose(V, W, rtol=1e-12, atol=1e-12 * size)
    T = np.random.default_rng(5).integers(-3, 4, (6, P.dim))
    assert P.support(T, exact=True) == bare.support(T, exact=True)
    np.testing.assert_array_equal(P.support(T), bare.support(T))
    assert P.volume() == pytest.approx(bare.volume(), rel=1e-9, abs=1e-300)
    assert P.volume(exact=True) == bare.volume(exact=True)
    assert bare == P
    assert polyhedron(convex_hull([P, P])) == polyhedron(convex_hull([bare, bare])) or P.exact is None
    image, other = np.ones((1, P.dim)) @ P, np.ones((1, P.dim)) @ bare
    np.testing.assert_allclose(image.bounding_box(), other.bounding_box(), rtol=1e-12)
    np.testing.assert_array_equal(P.incidence().table.sum(), bare.incidence().table.sum())


def test_where_vertices_are_kept() -> None:
    for name in ("box", "flat box", "point", "simplex", "cross-polytope", "hull", "flat hull", "thirds"):
        P = SOURCES[name]()
        assert P.made_of is not None, name
        for way in ("moved", "scaled", "turned", "sheared", "permuted", "with a segment"):
            if name in ("simplex", "cross-polytope", "hull", "thirds"):
                assert MAPS[way](P).made_of is not None, (name, way)
    assert SOURCES["decimal hull"]().made_of is None
    assert HPolytope.box([0.0, -np.inf], [1.0, 1.0]).made_of is None
    assert HPolytope.box([0.0, 1.0], [1.0, 0.0]).made_of is None
    assert HPolytope.box(np.zeros(20), np.ones(20)).made_of is None
    assert len(HPolytope.box(np.zeros(10), np.ones(10)).vertices()) == 1024


@pytest.mark.parametrize("name", CATALOGUE)
def test_nothing_is_kept_that_is_not_exact(name: str) -> None:
    P = CATALOGUE[name]
    rng = np.random.default_rng(4)
    for _ in range(4):
        Q = rng.standard_normal() * P + rng.standard_normal(P.dim)
        if name in EMPTY | UNBOUNDED:
            assert Q.made_of is None
        elif Q.made_of is not None:
            assert HPolytope(*Q.table).vertices(exact=True) == Q.vertices(exact=True)
