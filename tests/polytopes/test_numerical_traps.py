"""Cases on which floating-point libraries are known to be wrong, one named test each."""

import itertools

import numpy as np
import pytest
from exact_sets import minimal_size, polyhedron
from sets import CATALOGUE, EMPTY

from polytopes import Certificate, HPolytope, UnboundedError, UndecidedError, convex_hull
from polytopes.frame import unit_frame
from polytopes.projection import METHODS
from polytopes.redundancy import settle


def test_a_thin_rectangle_has_four_vertices() -> None:
    for width in (1e-7, 1e-9, 1e-12):
        V = HPolytope.box([0.0, 0.0], [1.0, width]).vertices()
        np.testing.assert_array_equal(V[np.lexsort(V.T)], [[0.0, 0.0], [1.0, 0.0], [0.0, width], [1.0, width]])


def test_columns_of_different_scales_lose_no_vertices() -> None:
    rng = np.random.default_rng(0)
    A = rng.standard_normal((40, 4))
    even = HPolytope(A, np.ones(40))
    uneven = HPolytope(A / 2.0 ** np.array([0, 7, 13, 20]), np.ones(40))
    assert len(uneven.vertices()) == len(even.vertices()) > 50


@pytest.mark.parametrize("apart", [1e-8, 1e-11])
def test_rows_close_to_each_other_both_count(apart: float) -> None:
    P = HPolytope([[1.0, 0.0], [1.0, apart], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], [1.0] * 5)
    assert P.remove_redundancy().b.size == minimal_size(polyhedron(P))[0] == 5
    assert len(P.vertices()) == 5


def test_a_coefficient_of_1e_8_is_kept() -> None:
    P = HPolytope([[1e-8, 1.0], [0.0, -1.0], [-1.0, 0.0]], [1.0, 0.0, 0.0])
    assert P.support([1.0, 0.0]) == 1e8
    assert P.is_bounded()
    assert P.project([0]).bounding_box()[1] == pytest.approx(1e8)
    assert len(P.vertices()) == 3


def test_points_are_not_rounded_before_the_hull() -> None:
    """Corners of a turned cube: rounding them first would split its faces."""
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((4, 4)))[0]
    corners = np.array(list(itertools.product([0.0, 1.0], repeat=4))) @ turn
    assert HPolytope.from_vertices(corners).b.size == 8


def test_the_empty_set_has_no_dual_hull() -> None:
    for name in EMPTY:
        P = CATALOGUE[name]
        assert P.vertices().shape == (0, P.dim)
        assert P.volume() == 0.0
        assert convex_hull([P, P]).emptiness().status == "empty"


def test_an_unbounded_set_gives_no_nan() -> None:
    P = CATALOGUE["wedge"]
    with pytest.raises(UnboundedError):
        P.vertices()
    assert P.volume() == np.inf
    G = P.generators()
    assert np.isfinite(np.vstack([G.vertices, G.rays, G.lines])).all()


def test_a_small_radius_is_not_empty_and_a_small_gap_is() -> None:
    for size in (1e-6, 1e-8, 1e-12, 1e-15):
        assert HPolytope.box([0.0, 1.0], [size, 1.0 + 2.0**-52]).emptiness().status == "nonempty"
        assert HPolytope.box([size, 0.0], [0.0, 1.0]).emptiness().status == "empty"


def test_an_equality_stays_an_equality() -> None:
    P = HPolytope.box([-1.0] * 3, [1.0] * 3).intersection(HPolytope(np.zeros((0, 3)), [], [[1.0, 1e-9, 0.0]], [0.5]))
    for Q in (P.remove_redundancy(), P.project([0, 1]), P.minkowski_sum(HPolytope.box([0.0] * 3, [0.0] * 3))):
        assert Q.d.size == 1
        assert Q.affine_dim() == Q.dim - 1


def test_a_flat_set_by_opposite_rows_is_as_unbounded_as_it_is() -> None:
    """Slacks of zero say nothing about its other widths."""
    P = HPolytope([[0, 2, -2], [-2, -2, 2], [0, -2, 2], [2, 2, -2]], [3, -6, -2, 6])
    assert P.affine_dim() == 2
    np.testing.assert_array_equal(P.support([[1, -2, -1], [0, 1, 1], [0, 2, -2], [1, 1, -1]]), [np.inf, np.inf, 3, 3])


def test_emptiness_is_decided_on_every_kind_of_set_and_its_proof_stands_alone() -> None:
    for name, P in CATALOGUE.items():
        answer = P.emptiness()
        assert answer.status == ("empty" if name in EMPTY else "nonempty")
        if answer.certificate is not None:
            assert Certificate.from_dict(answer.certificate.to_dict()).verify(HPolytope(P.A, P.b, P.C, P.d))


def test_generators_agree_with_cdd_in_scaled_coordinates() -> None:
    cdd = pytest.importorskip("cdd", reason="needs pycddlib: pip install 'svo-fdi[cdd]'")
    from polytopes.conversions import to_cdd

    for trial in range(60):
        rng = np.random.default_rng(trial)
        n = int(rng.integers(2, 5))
        P = random_unbounded(rng, n)
        G = P.generators()
        found = cdd.copy_generators(cdd.polyhedron_from_matrix(to_cdd(P)))
        table = np.array(found.array).reshape(-1, n + 1)
        lines = len(found.lin_set)
        assert len(G.lines) == lines
        if lines == 0:
            assert len(G.vertices) == np.count_nonzero(table[:, 0] == 1.0)
            assert len(G.rays) == np.count_nonzero(table[:, 0] == 0.0)


def random_unbounded(rng: np.random.Generator, n: int) -> HPolytope:
    """Few integer rows around the origin: mostly unbounded, sometimes with lines."""
    m = int(rng.integers(max(1, n - 1), n + 4))
    A = rng.integers(-3, 4, (m, n)).astype(float)
    A = A[A.any(axis=1)]
    return HPolytope(A, rng.integers(1, 5, len(A)))


@pytest.mark.parametrize("power", [-900, -600, 600, 900])
def test_rows_may_be_multiplied_by_any_number(power: int) -> None:
    """Also by numbers whose squares are no floats: the set, and what follows from it, stays the same."""
    rng = np.random.default_rng(3)
    A = np.vstack([rng.integers(-3, 4, (8, 3)), np.eye(3), -np.eye(3)]).astype(float)
    b = rng.integers(1, 4, 14).astype(float)
    factors = np.where(rng.random(14) < 0.5, 2.0**power, 1.0)
    P, Q = HPolytope(A, b), HPolytope(A * factors[:, None], b * factors)
    c = rng.integers(-4, 5, (20, 3))
    np.testing.assert_allclose(Q.support(c), P.support(c), rtol=1e-12)
    np.testing.assert_allclose(Q.vertices(), P.vertices(), atol=1e-12)
    assert len(Q.generators().vertices) == len(P.generators().vertices)
    assert Q.remove_redundancy().b.size == P.remove_redundancy().b.size
    for method in METHODS:
        assert Q.project([0, 1], method=method).equals(P.project([0, 1], method=method), tol=1e-12)
    corner = HPolytope([[2.0**power, 0.0], [0.0, -1.0]], [2.0**power, 0.0]).generators()
    assert (len(corner.vertices), len(corner.rays)) == (1, 2)


@pytest.mark.parametrize("bound", [1e200, 9e307])
def test_bounds_beyond_the_squares_of_floats_are_refused(bound: float) -> None:
    """No infinity, no NaN and no ZeroDivisionError: the row and the limit are named."""
    box = HPolytope.box([0.0, 0.0], [bound, 1.0])
    assert box.vertices().max() == bound  # known since it was made
    for P in (box, HPolytope([[1.0, 1.0]], [bound])):
        for question in (P.emptiness, P.bounding_box, P.generators, P.remove_redundancy):
            with pytest.raises(ValueError, match=r"row 0 of A bounds .* from the origin; expected at most 1e"):
                question()


@pytest.mark.parametrize("rank", [2, 3])
def test_a_set_less_itself_is_a_point(rank: int) -> None:
    """What is left of the right-hand sides is rounding, so their own size does not tell whether it matters."""
    rng = np.random.default_rng(rank)
    for _ in range(10):
        V = rng.normal(size=(6, rank)) @ rng.normal(size=(rank, 3)) + rng.normal(size=3)
        P = HPolytope.from_vertices(V)
        left = P.pontryagin_difference(P)
        assert left.emptiness().status == "nonempty"
        assert left.affine_dim() == 0
        assert left.contains(np.zeros(3), tol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_rays_on_axes_of_different_scales_stay_in_the_set(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scales = 10.0 ** np.array([-6.0, 0.0, 2.0])
    V, rays = rng.normal(size=(4, 3)) * scales, rng.normal(size=(3, 3)) * scales
    P = HPolytope.from_vertices(V, rays)
    lengths = np.abs(P.A) @ np.abs(rays).max(axis=0)
    assert len(P.b) > 0
    assert (1e-9 * lengths[:, None] >= P.A @ rays.T).all()
    assert (P.b[:, None] + 1e-9 * (np.abs(P.A) @ np.abs(V).max(axis=0))[:, None] >= P.A @ V.T).all()


def test_rows_that_meet_leave_no_width_to_measure() -> None:
    """An elimination in floats may end in such rows: numpy's LinAlgError came out of the polytope observer."""
    side = float.fromhex("0x1.f8f4b01938a56p+10")
    rows, rhs = np.array([[-0.5], [0.5]]), np.array([side, -side])
    assert settle(rows, rhs, np.array([-2.0 * side]), np.array([True, True])).tolist() == [0, 1]


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_support_points_that_tell_no_width(value: float) -> None:
    centre = np.zeros(2)
    with pytest.raises(UndecidedError, match="too thin"):
        unit_frame(lambda directions: np.full((len(directions), 2), value), centre)


def test_supports_of_sets_thinner_than_the_simplex_method_sees_are_near() -> None:
    rng = np.random.default_rng(11)
    for _ in range(30):
        n = int(rng.integers(2, 5))
        A = np.vstack([rng.integers(-8, 9, (6, n)) / 8.0, np.eye(n), -np.eye(n), -np.eye(n)[:1]])
        b = np.r_[rng.integers(2, 25, 6) / 8.0, np.full(2 * n, 3.0), -3.0 + 10.0 ** -float(rng.integers(11, 15))]
        P = HPolytope(A, b)
        if P.is_empty():
            continue
        directions = np.vstack([np.eye(n), -np.eye(n), rng.standard_normal((4, n))])
        exact = np.array([float(v) for v in P.support(directions, exact=True)])
        found = P.support(directions)
        assert (found >= exact - 1e-15).all()
        assert (found - exact).max() < 1e-11
