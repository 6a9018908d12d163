"""Distances against exact rationals: projections on all faces by brute force, and programs of an exact library."""

import itertools
from fractions import Fraction

import numpy as np
import ppl
import pytest
from exact_sets import polyhedron
from flint import fmpq, fmpq_mat
from scipy.optimize import nnls
from sets import CATALOGUE, EMPTY

from polytopes import EmptySetError, HPolytope
from polytopes.exact import rational_matrix
from polytopes.least_distance import nearest

EVERY = pytest.mark.parametrize("name", CATALOGUE)
NORMS = (1, 2, np.inf)
PLANAR = (
    "square", "triangle", "half-plane", "wedge", "strip", "line", "segment by an equality", "ray", "point", "empty",
    "whole space", "duplicate rows", "touching", "thin",
)  # fmt: skip
PAIRS = list(itertools.combinations(PLANAR, 2))


def squared_by_faces(P: HPolytope, x: list[float]) -> Fraction:
    """Least squared distance: of the projections on the affine hulls of all sets of rows, those that lie in the set."""
    rows = rational_matrix(np.vstack([P.C, P.A])), rational_matrix(np.append(P.d, P.b))
    start, q, best = rational_matrix(np.array(x)), P.d.size, None
    for k in range(P.dim + 1):
        for chosen in itertools.combinations(range(P.b.size), k):
            held = [*range(q), *(q + i for i in chosen)]
            R = fmpq_mat(len(held), P.dim, [rows[0][i, j] for i in held for j in range(P.dim)])
            r = fmpq_mat(len(held), 1, [rows[1][i, 0] for i in held])
            independent = R.transpose().rref()[1] == len(held)
            if held and not independent:
                continue
            y = start
            if held:
                y = start + R.transpose() * (R * R.transpose()).solve(r - R * start)
            missed = rows[0] * y - rows[1]
            if all(missed[i, 0] == 0 for i in range(q)) and all(missed[i, 0] <= 0 for i in range(q, missed.nrows())):
                squared = sum((v * v for v in (y - start).entries()), fmpq(0))
                value = Fraction(int(squared.p), int(squared.q))
                best = value if best is None else min(best, value)
    assert best is not None
    return best


def by_an_exact_program(P: HPolytope, x: list[float], norm: float) -> Fraction:
    """The least ``|y - x|`` in the norm 1 or inf."""
    n = P.dim
    exact, more = polyhedron(P), n if norm == 1 else 1
    exact.add_space_dimensions_and_embed(more)
    for j, value in enumerate(x):
        ratio = Fraction(value)
        bound = ratio.denominator * ppl.Variable(n + (j if norm == 1 else 0))
        form = ratio.denominator * ppl.Variable(j) - ratio.numerator
        exact.add_constraint(form <= bound)
        exact.add_constraint(-form <= bound)
    answer = exact.minimize(sum((ppl.Variable(n + j) for j in range(more)), 0 * ppl.Variable(0)))
    return Fraction(int(answer["inf_n"]), int(answer["inf_d"]))


def check(distance: float, norm: float, exact: Fraction) -> None:
    """Of the norm 2, `exact` is the square."""
    power = 2 if norm == 2 else 1
    assert Fraction(distance.lower) ** power <= exact <= Fraction(distance.upper) ** power
    assert distance.lower <= distance <= distance.upper
    assert distance.upper <= distance.lower * (1 + 2.0**-51)


@EVERY
def test_distances_of_points_are_exact(name: str) -> None:
    P, rng = CATALOGUE[name], np.random.default_rng(3)
    for k in range(6):
        x = rng.integers(-4, 5, P.dim).astype(float) if k % 2 else rng.standard_normal(P.dim) * 2.0
        if name in EMPTY:
            assert all(P.distance(x, norm=norm) == np.inf for norm in NORMS)
            with pytest.raises(EmptySetError):
                P.closest_point(x)
            continue
        check(P.distance(x), 2, squared_by_faces(P, x.tolist()))
        for norm in (1, np.inf):
            check(P.distance(x, norm=norm), norm, by_an_exact_program(P, x.tolist(), norm))
        y = P.closest_point(x)
        assert P.contains(y, tol=1e-13)
        assert np.linalg.norm(y - x) == pytest.approx(float(P.distance(x)), rel=1e-14)
        np.testing.assert_array_equal(P.distance(x).point, y)


@pytest.mark.parametrize(("p", "q"), PAIRS)
def test_distances_of_sets_are_those_of_the_origin_from_their_difference(p: str, q: str) -> None:
    P, Q = CATALOGUE[p], CATALOGUE[q] + [5.0, -2.0]
    if "empty" in (p, q):
        assert P.distance(Q) == np.inf == Q.distance(P, norm=1)
        return
    difference, origin = P + (-Q), [0.0, 0.0]
    check(P.distance(Q), 2, squared_by_faces(difference, origin))
    for norm in (1, np.inf):
        check(P.distance(Q, norm=norm), norm, by_an_exact_program(difference, origin, norm))
    found = P.distance(Q)
    assert P.contains(found.point, tol=1e-12)
    assert Q.contains(found.other, tol=1e-12)
    assert np.linalg.norm(found.point - found.other) == pytest.approx(float(found), rel=1e-12, abs=1e-14)
    assert Q.distance(P) == found


@pytest.mark.parametrize("count", [8, pytest.param(1500, marks=pytest.mark.slow)])
@pytest.mark.parametrize("unit", [1.0, 2.0**-60])
def test_distances_of_random_decimal_sets_are_exact(count: int, unit: float) -> None:
    for case in range(count):
        rng = np.random.default_rng([case, 8])
        n, m = 1 + case % 4, 5 + case % 4
        P = HPolytope(np.vstack([rng.standard_normal((m, n)), np.eye(n)]), unit * np.append(rng.random(m), np.ones(n)))
        x = unit * 3.0 * rng.standard_normal(n)
        check(P.distance(x), 2, squared_by_faces(P, x.tolist()))


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7])
def test_distances_known_in_closed_form(n: int) -> None:
    one = np.ones(n)
    P, Q = HPolytope.box(0 * one, one), HPolytope.box(2 * one, 3 * one)
    for norm, value in ((2, np.sqrt(n)), (1, n), (np.inf, 1.0)):
        assert P.distance(Q, norm=norm) == pytest.approx(value, rel=1e-15)
    assert HPolytope.simplex(n).distance(2 * one) == pytest.approx((2 * n - 1) / np.sqrt(n), rel=1e-15)
    if n < 5:
        box, cross = HPolytope.box(-one, one), HPolytope.cross_polytope(n)
        assert box.hausdorff(cross) == pytest.approx((n - 1) / np.sqrt(n), rel=1e-15, abs=1e-15)
        assert box.hausdorff(cross, norm=1) == pytest.approx(n - 1.0)
        assert box.hausdorff(cross, norm=np.inf) == pytest.approx((n - 1.0) / n)


@EVERY
def test_hausdorff_distances(name: str) -> None:
    P = CATALOGUE[name]
    for norm in NORMS:
        assert P.hausdorff(P, norm=norm) == 0.0
    shift = np.array([0.0, 3.0, 0.0])[-P.dim :] if P.dim > 1 else np.array([3.0])
    if name not in EMPTY:
        assert P.hausdorff(HPolytope.empty(P.dim)) == np.inf
        assert P.hausdorff(P + shift) <= 3.0 * (1 + 1e-15)
        assert P.hausdorff(P + shift, norm=1) <= 3.0 * (1 + 1e-15)
        point = HPolytope.box(shift, shift)
        assert P.hausdorff(point) == pytest.approx(
            max(np.linalg.norm(P.vertices() - shift, axis=1)) if P.is_bounded() else np.inf
        )


def test_unbounded_sets_are_near_if_their_directions_are_the_same() -> None:
    wedge, cut = HPolytope([[-1, 0], [0, -1]], [0, 0]), HPolytope([[-1, 0], [0, -1], [-1, -1]], [0, 0, -2])
    assert wedge.hausdorff(cut) == pytest.approx(np.sqrt(2.0))
    assert wedge.hausdorff(HPolytope([[-1, 0]], [0])) == np.inf
    assert wedge.hausdorff(HPolytope.whole_space(2)) == np.inf


def test_without_a_proof_in_rationals_bounds_are_those_of_floats(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    monkeypatch.setattr("polytopes.least_distance._MAX_UNKNOWNS", 0)
    for _ in range(6):
        A, x = rng.standard_normal((12, 3)), 5.0 * rng.standard_normal(3)
        P = HPolytope(np.vstack([A, np.eye(3), -np.eye(3)]), np.ones(18))
        found, exact = P.distance(x), squared_by_faces(P, x.tolist())
        assert Fraction(found.lower) ** 2 <= exact <= Fraction(found.upper) ** 2
        assert found.upper <= found.lower * (1 + 1e-12)


def test_the_nearest_point_in_many_variables() -> None:
    rng = np.random.default_rng(5)
    A = rng.standard_normal((300, 100))
    P, x = HPolytope(np.vstack([A, np.eye(100), -np.eye(100)]), np.ones(500)), 5.0 * rng.standard_normal(100)
    y = nearest(P, np.eye(100), x, exactly=False).point
    assert (P.A @ y <= P.b + 1e-12).all()
    assert nnls(P.A[P.A @ y > P.b - 1e-9].T, x - y)[1] < 1e-9  # x - y is in the cone of the rows that hold y


def test_wrong_distances_are_refused() -> None:
    P = HPolytope.box([0.0, 0.0], [1.0, 1.0])
    with pytest.raises(ValueError, match=r"norm is 3; expected 1, 2 or numpy.inf"):
        P.distance([0.0, 0.0], norm=3)
    with pytest.raises(ValueError, match=r"x has shape \(3,\)"):
        P.distance([0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="Q has dimension 1"):
        P.distance(HPolytope.box([0.0], [1.0]))
    with pytest.raises(TypeError, match="norm="):
        P.distance([0.0, 0.0], 1)  # type: ignore[misc]


@pytest.mark.parametrize("unit", [2.0**-600, 2.0**40])
def test_units_of_equalities_change_no_distance(unit: float) -> None:
    """A search that told ranks from rows as long as they were given stopped at another vertex."""
    rng = np.random.default_rng(8)
    for _ in range(2):
        P = HPolytope.from_vertices(rng.integers(-4, 5, (6, 3)))
        edge = HPolytope.from_vertices(rng.integers(-4, 5, (2, 3)))
        Q = HPolytope(edge.A, edge.b, edge.C * [[1.0], [unit]], edge.d * [1.0, unit])
        for norm in NORMS:
            assert P.hausdorff(Q, norm=norm) == pytest.approx(P.hausdorff(edge, norm=norm), rel=1e-14)
        x = rng.standard_normal(3)
        missed = nearest(Q, np.eye(3), x, exactly=False).point - edge.closest_point(x)
        assert np.abs(missed).max() < 1e-12


@pytest.mark.parametrize("n", [6, pytest.param(8, marks=pytest.mark.slow)])
def test_hausdorff_distances_of_many_vertices(n: int) -> None:
    cube, cross = HPolytope.box([-1.0] * n, [1.0] * n), HPolytope.cross_polytope(n)
    for norm, value in ((1, n - 1), (2, (n - 1) / n**0.5), (np.inf, (n - 1) / n)):
        assert cube.hausdorff(cross, norm=norm) == pytest.approx(value, rel=1e-14)
