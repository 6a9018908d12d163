"""The double description on known cones, its limit, and what users see of it."""

import itertools
import time

import numpy as np
import pytest
from exact_sets import polyhedron

from polytopes import HPolytope, UndecidedError, convex_hull
from polytopes.double_description import cone_generators
from polytopes.minkowski_weyl import ExactGenerators, generators_of, rows_of


def cut_vectors(nodes: int) -> np.ndarray:
    """Vertices of the cut polytope: for each division of the nodes, which edges it cuts."""
    sides = np.array(list(itertools.product([0, 1], repeat=nodes - 1)))
    sides = np.hstack([np.zeros((len(sides), 1), dtype=int), sides])
    return np.array([[int(s[i] != s[j]) for i in range(nodes) for j in range(i)] for s in sides])


def cyclic(points: int, n: int) -> np.ndarray:
    """Points of the moment curve: all of them vertices, and the number of facets is the most there can be."""
    return np.arange(1, points + 1)[:, None] ** np.arange(1, n + 1)


def test_the_cut_polytope_of_six_nodes() -> None:
    start = time.process_time()
    P = HPolytope.from_vertices(cut_vectors(6))
    assert (P.b.size, P.d.size) == (368, 0)
    V = P.vertices()
    assert time.process_time() - start < 5.0
    np.testing.assert_array_equal(V[np.lexsort(V.T)], (W := cut_vectors(6))[np.lexsort(W.T)])


@pytest.mark.parametrize(("points", "n", "facets"), [(12, 5, 72), (10, 4, 35), (9, 6, 30), (14, 3, 24)])
def test_cyclic_polytopes(points: int, n: int, facets: int) -> None:
    P = HPolytope.from_vertices(cyclic(points, n))
    assert P.b.size == facets
    np.testing.assert_array_equal(P.vertices(), cyclic(points, n))


def test_cubes_and_cross_polytopes_are_dual() -> None:
    for n in (1, 3, 6):
        cube, cross = HPolytope.box(-np.ones(n), np.ones(n)), HPolytope.cross_polytope(n)
        assert len(cube.vertices()) == cross.b.size == 2**n
        assert len(cross.vertices()) == (cube.b.size if n > 1 else 2) == 2 * n
        assert HPolytope.from_vertices(cube.vertices()).b.size == 2 * n
        assert HPolytope.from_vertices(cross.vertices()).b.size == 2**n


def test_there_and_back_with_integers_beyond_machine_words() -> None:
    rng = np.random.default_rng(0)
    for bits in (8, 40, 200):
        numbers = [int(v) for v in rng.integers(-99, 100, 40)]
        points = np.array(numbers, dtype=object).reshape(8, 5) * (1 << bits) + rng.integers(-9, 10, (8, 5))
        V = np.hstack([points, np.ones((8, 1), dtype=object)])
        given = ExactGenerators(V, np.zeros((0, 5), dtype=np.int64), np.zeros((0, 5), dtype=np.int64))
        back = generators_of(rows_of(given))
        again = generators_of(rows_of(back))
        assert set(map(tuple, back.vertices.tolist())) <= set(map(tuple, V.tolist()))
        assert {tuple(row) for row in again.vertices.tolist()} == {tuple(row) for row in back.vertices.tolist()}


def test_the_core_and_large_integers_make_the_same_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    tables = [rng.integers(-9, 10, (int(rng.integers(4, 13)), int(rng.integers(2, 6)))) for _ in range(60)]
    tables += [rng.integers(-(1 << bits), 1 << bits, (9, 4)) for bits in (10, 20, 30, 40, 50, 60) for _ in range(5)]
    tables += [np.array([[2**62 - 1, 1], [1, 2**62 - 1], [-(2**61), 3]]), np.array([[2**62, 1], [1, 1]], dtype=object)]
    by_core = [cone_generators(table) for table in tables]
    monkeypatch.setattr("polytopes.kernel.pointed_cone", lambda *_: None)
    for table, (rays, lines) in zip(tables, by_core, strict=True):
        again, same_lines = cone_generators(table)
        np.testing.assert_array_equal(rays, again)
        np.testing.assert_array_equal(lines, same_lines)


def test_lines_and_a_cone_without_any_ray() -> None:
    rays, lines = cone_generators(np.array([[1, 1, 0], [-1, -1, 0]]))
    assert len(rays) == 0
    assert len(lines) == 2
    rays, lines = cone_generators(np.array([[1, 0], [0, 1], [-1, -1]]))
    assert len(rays) == len(lines) == 0


def test_the_limit_is_an_error_that_names_it() -> None:
    cube = np.vstack([np.eye(8, dtype=int), -np.eye(8, dtype=int)])
    table = np.vstack([np.hstack([cube, -np.ones((16, 1), dtype=int)]), -np.eye(9, dtype=int)[-1:]])
    assert len(cone_generators(table)[0]) == 256
    with pytest.raises(UndecidedError, match="17 rows in 9 coordinates passes its limit of 100 rays"):
        cone_generators(table, 100)


def test_segments_that_touch_meet() -> None:
    first, second = HPolytope.from_vertices([[0, 0], [1, 1]]), HPolytope.from_vertices([[1, 1], [2, 2]])
    meeting = first.intersection(second)
    assert meeting.emptiness().status == "nonempty"
    assert meeting.affine_dim() == 0
    np.testing.assert_array_equal(meeting.vertices(), [[1.0, 1.0]])


def test_a_hull_of_integer_points_meets_each_of_them() -> None:
    rng = np.random.default_rng(1)
    for _ in range(40):
        n = int(rng.integers(2, 5))
        V = rng.integers(-9, 10, (int(rng.integers(2, 8)), n)) @ rng.integers(-3, 4, (n, n))
        P = HPolytope.from_vertices(V)
        for point in V:
            meeting = P.intersection(HPolytope.from_vertices(point[None]))
            assert meeting.emptiness().status == "nonempty"


def test_hulls_of_coplanar_sets_are_flat_and_bounded() -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        span = rng.integers(-3, 4, (2, 3))
        P, Q = (HPolytope.from_vertices(rng.integers(-4, 5, (4, 2)) @ span) for _ in range(2))
        hull = convex_hull([P, Q])
        assert hull.is_bounded()
        assert hull.affine_dim() <= 2
        assert polyhedron(hull).contains(polyhedron(P))
        assert polyhedron(hull).contains(polyhedron(Q))


def test_the_preimage_of_an_image_is_not_empty() -> None:
    X, M = HPolytope.box([1.0], [2.0]), np.array([[0.1], [0.2], [0.3]])
    back = X.affine_map(M).preimage(M)
    assert back.emptiness().status == "nonempty"
    np.testing.assert_allclose(back.bounding_box(), ([1.0], [2.0]), rtol=1e-15)


def test_cones_keep_their_apex_in_every_template() -> None:
    rng = np.random.default_rng(3)
    for _ in range(60):
        n = int(rng.integers(2, 5))
        cone = HPolytope(rng.standard_normal((n + 1, n)) * 10.0 ** rng.uniform(-3, 3, (n + 1, 1)), np.zeros(n + 1))
        T = rng.standard_normal((12, n))
        for Q in (cone.outer_template(T), cone.outer_template(cone.A), convex_hull([cone, cone])):
            assert (Q.b >= 0.0).all()
