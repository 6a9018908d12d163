"""Faces, triangulations, moments, rays, gauges and polars: against exact rationals, closed forms and each other."""

import itertools
from fractions import Fraction
from math import comb, factorial

import numpy as np
import ppl
import pytest
from exact_sets import polyhedron
from flint import fmpq_mat
from sets import CATALOGUE, EMPTY, FACETS, UNBOUNDED, VERTICES

from polytopes import EmptySetError, HPolytope, UnboundedError
from polytopes.exact import rational_matrix

EVERY = pytest.mark.parametrize("name", CATALOGUE)
BOUNDED = pytest.mark.parametrize("name", [name for name in CATALOGUE if name not in EMPTY | UNBOUNDED])
ROUND = ("decimal ray", "slice", "scaled rows")  # their vertices are no floats


def random_polytope(case: int, decimals: bool = False) -> HPolytope:
    rng = np.random.default_rng([case, 77])
    n, k = 2 + case % 3, 6 + case % 7
    V = rng.standard_normal((k, n)) if decimals else rng.integers(-3, 4, (k, n)).astype(float)
    return HPolytope.from_vertices(V)


def test_faces_of_known_polytopes() -> None:
    for n in (1, 2, 3, 4):
        cube, cross, simplex = HPolytope.box(-np.ones(n), np.ones(n)), HPolytope.cross_polytope(n), HPolytope.simplex(n)
        assert cube.incidence().f_vector() == tuple(2 ** (n - i) * comb(n, i) for i in range(n))
        assert cross.incidence().f_vector() == tuple(2 ** (i + 1) * comb(n, i + 1) for i in range(n))
        assert simplex.incidence().f_vector() == tuple(comb(n + 1, i + 1) for i in range(n))
        assert (cube.adjacency().sum(axis=1) == n).all()
    t = np.arange(8.0)
    cyclic = HPolytope.from_vertices(np.stack([t, t**2, t**3, t**4], axis=1)).incidence()
    assert cyclic.f_vector() == (8, 28, 40, 20)
    assert cyclic.vertex_adjacency().sum() == 8 * 7  # neighbourly: every two vertices are joined


@pytest.mark.parametrize("decimals", [False, True])
def test_faces_keep_eulers_relation_and_edges_have_their_rank(decimals: bool) -> None:
    for case in range(4 if decimals else 16):
        P = random_polytope(case, decimals)
        found = P.incidence()
        assert sum((-1) ** i * f for i, f in enumerate(found.f_vector())) == 1 - (-1) ** found.dim, case
        assert len(found.faces(0)) == len(found.vertices)
        assert found.faces(found.dim) == [tuple(range(len(found.vertices)))]
        assert len(found.faces(found.dim - 1)) == len(found.rows)
        rows, joined = rational_matrix(P.A[found.rows]), found.vertex_adjacency()
        for i in range(len(found.vertices)):
            for j in range(i):
                both = np.flatnonzero(found.table[:, i] & found.table[:, j]).tolist()
                shared = fmpq_mat(len(both), P.dim, [rows[q, c] for q in both for c in range(P.dim)])
                assert joined[i, j] == (shared.rref()[1] == P.dim - 1), case
        edges = [set(face) for face in found.faces(1)]
        assert {frozenset(e) for e in edges} == {frozenset(e) for e in np.argwhere(joined).tolist()}, case
        ridges = found.faces(found.dim - 2) if found.dim > 1 else []
        assert found.facet_adjacency().sum() == 2 * len(ridges), case


@BOUNDED
def test_incidence_of_every_kind(name: str) -> None:
    P, found = CATALOGUE[name], CATALOGUE[name].incidence()
    assert found.dim == P.affine_dim()
    assert len(found.vertices) == VERTICES[name]
    assert len(found.rows) == FACETS[name][0]
    np.testing.assert_allclose(found.vertices, P.vertices(), atol=1e-15)
    slack = P.b[found.rows, None] - P.A[found.rows] @ found.vertices.T
    assert (np.abs(slack[found.table]) < 1e-9).all()
    assert (slack[~found.table] > 0.0).all()


@EVERY
def test_facets_are_sets(name: str) -> None:
    P = CATALOGUE[name]
    facets = P.facets()
    assert len(facets) == (0 if name in EMPTY else FACETS[name][0])
    assert all(F.affine_dim() == P.affine_dim() - 1 and F <= P for F in facets)


@BOUNDED
def test_simplices_fill_a_set_and_do_not_overlap(name: str) -> None:
    P = CATALOGUE[name]
    simplices = P.triangulate()
    assert all(len(S) == P.affine_dim() + 1 for S in simplices)
    points = P.random_points(20, np.random.default_rng(1))
    inside = sum(HPolytope.from_vertices(S).contains(points, tol=1e-12).astype(int) for S in simplices)
    assert (inside >= 1).all()
    if P.affine_dim() == P.dim:
        assert (inside == 1).all()


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_exact_volumes_in_closed_form(n: int) -> None:
    one = np.ones(n)
    assert HPolytope.simplex(n).volume(exact=True) == Fraction(1, factorial(n))
    assert HPolytope.cross_polytope(n).volume(exact=True) == Fraction(2**n, factorial(n))
    assert HPolytope.box(0 * one, 0.1 * one).volume(exact=True) == Fraction(0.1) ** n
    assert HPolytope.simplex(n).scale(3.0).volume(exact=True) == Fraction(3**n, factorial(n))


@pytest.mark.parametrize("decimals", [False, True])
def test_moments_of_a_set_are_those_of_its_parts(decimals: bool) -> None:
    for case in range(2 if decimals else 8):
        P = random_polytope(case, decimals)
        normal = np.random.default_rng(case).integers(-2, 3, P.dim).astype(float)
        parts = [P & HPolytope(sign * normal[None], [0.0]) for sign in (1, -1)]
        volumes = [part.volume(exact=True) for part in parts]
        whole = P.volume(exact=True)
        assert whole == sum(volumes) or not normal.any(), case
        assert float(whole) == pytest.approx(P.volume(), rel=1e-12)
        assert float(whole) == pytest.approx(P.volume(relative=True), rel=1e-12)
        if not normal.any() or not all(volumes):
            continue
        weights = np.array([float(v / whole) for v in volumes])
        centres = np.array([part.centroid() for part in parts])
        np.testing.assert_allclose(weights @ centres, P.centroid(), atol=1e-13)
        offsets = centres - P.centroid()
        spread = sum(
            w * (part.covariance() + np.outer(o, o)) for w, part, o in zip(weights, parts, offsets, strict=True)
        )
        np.testing.assert_allclose(spread, P.covariance(), atol=1e-12)


def test_moments_of_boxes_and_flat_sets() -> None:
    box = HPolytope.box([0.0, 1.0], [2.0, 4.0])
    np.testing.assert_allclose(box.centroid(), [1.0, 2.5])
    np.testing.assert_allclose(box.covariance(), np.diag([4.0, 9.0]) / 12.0)
    M = np.array([[1.0, 0.0], [2.0, 0.0], [2.0, 3.0]])  # areas grow by 9: lengths 3, 3 across
    flat = M @ box
    assert flat.volume() == 0.0 == flat.volume(exact=True)
    assert flat.volume(relative=True) == pytest.approx(6.0 * np.sqrt(np.linalg.det(M.T @ M)))
    np.testing.assert_allclose(flat.centroid(), M @ box.centroid())
    np.testing.assert_allclose(flat.covariance(), M @ box.covariance() @ M.T, atol=1e-13)
    assert HPolytope.from_vertices([[0.0, 0.0, 0.0], [2.0, 3.0, 6.0]]).volume(relative=True) == pytest.approx(7.0)
    assert HPolytope.from_vertices([[1.0, 2.0]]).volume(relative=True) == 1.0
    skew = CATALOGUE["thin and skew"]
    assert skew.volume(exact=True) == Fraction(2.0**-30)
    assert skew.volume(relative=True) == pytest.approx(2.0**-30, rel=1e-12)


@EVERY
def test_moments_of_every_kind(name: str) -> None:
    P = CATALOGUE[name]
    if name in EMPTY | UNBOUNDED:
        for ask in (P.centroid, P.covariance, P.incidence, P.triangulate, P.inscribed_ellipsoid, P.enclosing_ellipsoid):
            with pytest.raises(EmptySetError if name in EMPTY else UnboundedError):
                ask()
        assert P.volume(relative=True) == (0.0 if name in EMPTY else np.inf)
        assert P.volume(exact=True) == P.volume()
        return
    assert P.contains(P.centroid(), tol=1e-12)
    spread = np.linalg.eigvalsh(P.covariance())
    assert np.count_nonzero(spread > 1e-20) == P.affine_dim() or name == "thin and skew"  # 1e-19 beside 0.1
    assert P.volume(relative=True) > 0.0
    assert float(P.volume(exact=True)) == pytest.approx(P.volume(), rel=1e-12)


@EVERY
def test_rays_and_gauges_match_an_exact_library(name: str) -> None:
    P, rng = CATALOGUE[name], np.random.default_rng(9)
    for _ in range(20):
        x, v = rng.integers(-2, 3, P.dim).astype(float), rng.integers(-2, 3, P.dim).astype(float)
        if v.any():
            along = polyhedron(P.preimage(v[:, None], x) & HPolytope([[-1.0]], [0.0]))
            hit = P.ray_shoot(x, v)
            assert (hit is None) == along.is_empty()
            if hit is not None:
                first, last = along.minimize(1 * ppl.Variable(0)), along.maximize(1 * ppl.Variable(0))
                assert hit.enter == int(first["inf_n"]) / int(first["inf_d"])
                assert hit.leave == (int(last["sup_n"]) / int(last["sup_d"]) if last["bounded"] else np.inf)
                rows, sides = np.vstack([P.A, P.C]), np.append(P.b, P.d)
                for t, row in ((hit.enter, hit.entered), (hit.leave, hit.left)):
                    assert row is None or rows[row] @ (x + t * v) == pytest.approx(sides[row], abs=1e-12)
        # x in s P: A x <= s b, C x = s d
        table = np.vstack([P.A, P.C, -P.C]) @ x, np.concatenate([P.b, P.d, -P.d])
        multiples = polyhedron(HPolytope(np.append(-table[1], -1.0)[:, None], np.append(-table[0], 0.0)))
        least = np.inf
        if not multiples.is_empty() and not P.is_empty():
            found, most = multiples.minimize(1 * ppl.Variable(0)), multiples.maximize(1 * ppl.Variable(0))
            positive = not most["bounded"] or int(most["sup_n"]) > 0 or not x.any()
            least = int(found["inf_n"]) / int(found["inf_d"]) if positive else np.inf
        assert P.gauge(x) == least
    assert P.gauge(np.zeros((2, P.dim))).tolist() == [np.inf if name in EMPTY else 0.0] * 2


@EVERY
def test_polars_match_an_exact_library(name: str) -> None:
    P = CATALOGUE[name]
    exact = ppl.C_Polyhedron(P.dim, "universe")
    if name not in EMPTY:
        for g in polyhedron(P).minimized_generators():
            form = sum((c * ppl.Variable(j) for j, c in enumerate(g.coefficients())), 0 * ppl.Variable(P.dim - 1))
            exact.add_constraint(form <= g.divisor() if g.is_point() else form == 0 if g.is_line() else form <= 0)
    polar = P.polar()
    if name == "decimal ray":  # a line that no floats are along: rows hold near the vertices only
        return
    assert polyhedron(polar).contains(exact)
    if name not in ROUND:
        assert polyhedron(polar) == exact
        twice = polar.polar()
        assert twice >= P
        assert np.zeros(P.dim) in twice
        assert (twice == P) == (np.zeros(P.dim) in P)
    assert polar.contains(polyhedron_points(exact), tol=1e-12).all()


def polyhedron_points(exact: ppl.C_Polyhedron) -> np.ndarray:
    points = [g for g in exact.minimized_generators() if g.is_point()]
    n = exact.space_dimension()
    return np.array([[int(g.coefficient(ppl.Variable(j))) / int(g.divisor()) for j in range(n)] for g in points])


@pytest.mark.parametrize("n", [1, 3])
def test_ellipsoids_in_closed_form(n: int) -> None:
    width = np.arange(1.0, n + 1.0)
    box, cross = HPolytope.box(-width, width), HPolytope.cross_polytope(n)
    inside, around = box.inscribed_ellipsoid(), box.enclosing_ellipsoid()
    np.testing.assert_allclose(inside.axes @ inside.axes.T, np.diag(width**2), atol=1e-5 * n**2)
    np.testing.assert_allclose(around.axes @ around.axes.T, n * np.diag(width**2), atol=1e-6 * n**3)
    np.testing.assert_allclose(cross.inscribed_ellipsoid().axes @ np.ones(n), np.full(n, n**-0.5), atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(cross.enclosing_ellipsoid().axes, axis=0), np.ones(n), atol=1e-6)
    ball = np.pi ** (n / 2) / factorial(n // 2) if n % 2 == 0 else None
    assert ball is None or inside.volume == pytest.approx(ball * np.prod(width), rel=1e-5)


@pytest.mark.parametrize(
    "name", ["triangle", "square", "segment by an equality", "point", "thin and skew", "cube", "interval"]
)
def test_ellipsoids_lie_inside_and_around_as_john_says(name: str) -> None:
    P = CATALOGUE[name]
    inside, around, d = P.inscribed_ellipsoid(), P.enclosing_ellipsoid(), max(P.affine_dim(), 1)
    T = np.vstack([np.random.default_rng(2).standard_normal((50, P.dim)), P.A])
    size = np.abs(T).sum(axis=1)
    assert inside.axes.shape[1] == around.axes.shape[1] == P.affine_dim()
    assert (inside.support(T) <= P.support(T) + 1e-12 * size).all()
    assert (around.support(T) >= P.support(T) - 1e-12 * size).all()
    for ellipsoid, larger in ((inside, d), (around, 1.0 / d)):  # John: d times the one covers, 1/d of the other fits
        values = T @ ellipsoid.centre + larger * (ellipsoid.support(T) - T @ ellipsoid.centre)
        gap = values - P.support(T) if larger >= 1.0 else P.support(T) - values
        assert (gap >= -1e-5 * size).all()


def test_ellipsoids_go_with_affine_maps_and_have_known_volumes() -> None:
    P, M = HPolytope.from_vertices([[0.0, 0.0], [4.0, 0.0], [1.0, 3.0]]), np.array([[2.0, 1.0], [0.0, 1e-3]])
    area = P.volume()
    assert P.inscribed_ellipsoid().volume == pytest.approx(area * np.pi / (3 * np.sqrt(3)), rel=1e-6)  # Steiner's
    assert P.enclosing_ellipsoid().volume == pytest.approx(area * 4 * np.pi / (3 * np.sqrt(3)), rel=1e-8)
    moved = M @ P
    assert moved.inscribed_ellipsoid().volume == pytest.approx(2e-3 * P.inscribed_ellipsoid().volume, rel=1e-6)
    np.testing.assert_allclose(moved.enclosing_ellipsoid().centre, M @ P.centroid(), rtol=1e-6)
    u = np.random.default_rng(1).standard_normal((9, 2))
    assert P.contains(P.inscribed_ellipsoid().surface(u)).all()


def test_wrong_questions_of_shape_are_refused() -> None:
    P = HPolytope.box([0.0, 0.0], [1.0, 1.0])
    with pytest.raises(ValueError, match="v is zero"):
        P.ray_shoot([0.0, 0.0], [0.0, 0.0])
    with pytest.raises(ValueError, match="dim is 3; expected 0 to 2"):
        P.incidence().faces(3)
    with pytest.raises(ValueError, match="relative and exact"):
        P.volume(relative=True, exact=True)  # type: ignore[call-overload]


def test_vertices_that_share_many_facets_need_not_be_adjacent() -> None:
    """The join of two squares in R^5: opposite corners of one lie in all four facets over the edges of the other."""
    square = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    first, second = np.hstack([square, np.zeros((4, 3))]), np.hstack([np.zeros((4, 2)), square, np.ones((4, 1))])
    P = HPolytope.from_vertices(np.vstack([first, second]))
    found, joined = P.incidence(), P.adjacency()
    assert len(found.vertices) == len(found.rows) == 8
    assert joined.sum(axis=1).tolist() == [6] * 8
    for i, j in itertools.combinations(range(8), 2):
        assert joined[i, j] == (not np.array_equal(found.vertices[i, :4], -found.vertices[j, :4]))


def test_rows_that_touch_in_a_vertex_or_an_edge_are_no_facets() -> None:
    cube = HPolytope.box([-1.0] * 3, [1.0] * 3)
    more = HPolytope([[1, 1, 1], [1, 1, 0], [0, 0, 1], [0, 0, 0], [2, 0, 0]], [3, 2, 1, 0, 2])
    found = (cube & more).incidence()
    assert found.rows.tolist() == list(range(6))
    assert [len(found.faces(k)) for k in range(4)] == [8, 12, 6, 1]
    assert found.vertex_adjacency().sum() == 24


@pytest.mark.parametrize("name", ["square", "cube", "triangle", "slice", "segment by two rows"])
def test_every_simplex_of_a_triangulation_has_a_volume(name: str) -> None:
    for simplex in CATALOGUE[name].triangulate():
        edges = simplex[1:] - simplex[0]
        assert np.linalg.matrix_rank(edges) == len(edges) == CATALOGUE[name].affine_dim()
