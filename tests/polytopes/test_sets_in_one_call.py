"""Sets that one call of the core answers for: short ones are exact, hulls hold all points, volumes are right."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from polytopes import HPolytope
from polytopes.checks import Floats
from polytopes.exact_generators import integer_form
from polytopes.exact_sides import exact_form
from polytopes.general_position import rows_around, summed_volume
from polytopes.integers import floats_of_points, integer_rows, is_short
from polytopes.minkowski_weyl import ExactGenerators, distinct, generators_of
from polytopes.outward import float_rows
from polytopes.pontryagin_difference import moved_sides
from polytopes.rows import Rows
from polytopes.short_sets import are_short, has_short_rows, short_hull, short_unit, short_vertices, short_volume


def short_rows(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Rows of integers or short fractions: some bounded, some not, some empty or flat, in units of their own."""
    n = int(rng.integers(1, 5))
    A, b = rng.integers(-3, 4, (int(rng.integers(n + 1, 10)), n)).astype(float), rng.integers(-1, 6, 20).astype(float)
    if rng.integers(2):
        A = np.vstack([A, np.eye(n), -np.eye(n)])
    return np.ldexp(A, int(rng.integers(-20, 20))), np.ldexp(b[: len(A)], int(rng.integers(-3, 4)))


def test_rows_and_points_are_short_as_their_integers_of_any_size_say() -> None:
    rng, short = np.random.default_rng(12), np.zeros(2, int)
    for _ in range(300):
        table = rng.integers(-(2**34), 2**34, (3, 3)) >> rng.integers(0, 34, (3, 3))
        table = np.ldexp(table.astype(float), rng.integers(-4, 5, (3, 1)))
        told = has_short_rows(Rows(table[:, :2], table[:, 2]).in_core), are_short(table)
        assert told == (is_short(table[:, :2], table[:, 2]), is_short(table, np.ones(3)))
        short += told
    assert (short > 30).all()
    assert (short < 270).all()


@pytest.mark.parametrize(("values", "unit"), [
    ([0.0, 0.0], 0), ([3.0, 0.5], 0), ([2.0**-40, 3.0], 0), ([3 * 2.0**-40, 0.0, 2.0**-38], -40), ([2.0**50, 0.0], 50),
])  # fmt: skip
def test_the_unit_of_short_points(values: list[float], unit: int) -> None:
    assert short_unit(np.array([values])) == unit


def test_vertices_of_short_rows_are_those_in_integers_of_any_size() -> None:
    rng, known = np.random.default_rng(0), 0
    for _ in range(200):
        A, b = short_rows(rng)
        A, b = A[: len(b)], b[: len(A)]
        exact = generators_of(integer_form(A, b, A[:0], b[:0]))
        found = short_vertices(Rows(A, b).in_core)
        if found is None:
            assert len(exact.rays) or len(exact.lines) or not len(exact.vertices)
            continue
        known += 1
        assert not len(exact.rays)
        points = floats_of_points(exact.vertices)
        np.testing.assert_array_equal(found.points, points[np.lexsort(points.T[::-1])])
        fractions = [[Fraction(int(v), int(row[-1])) for v in row[:-1]] for row in exact.vertices.tolist()]
        floats = [[Fraction(v) for v in row] for row in points.tolist()]
        assert found.exact == (fractions == floats)
    assert known > 60


def test_rows_that_others_with_their_normals_imply_need_not_be_short() -> None:
    rng = np.random.default_rng(5)
    for _ in range(30):
        A, b = short_rows(rng)
        b = b[: len(A)]
        chosen = rng.integers(0, len(A), 3)
        more = b[chosen] + np.abs(b[chosen]) * 1e-9 + 0.1
        plain, found = short_vertices(Rows(A, b).in_core), short_vertices(Rows(*both(A[chosen], more, A, b)).in_core)
        assert (plain is None) == (found is None)
        assert plain is None or (np.array_equal(plain.points, found.points) and plain.exact == found.exact)
        volumes = [short_volume(Rows(*rows).in_core) for rows in ((A, b), both(A, b, A[chosen], more))]
        assert volumes[0] == volumes[1]
    A, b = np.array([[1.0], [1.0], [-1.0]]), np.array([0.1, 0.1, 0.0])
    assert not has_short_rows(Rows(A, b).in_core)  # a row is not implied by itself


def both(A: Floats, b: Floats, A2: Floats, b2: Floats) -> tuple[Floats, Floats]:
    return np.vstack([A, A2]), np.append(b, b2)


@pytest.mark.parametrize("decimals", [0, 1, 20])
def test_rows_moved_inward_by_points_are_exact_or_rounded_up(decimals: int) -> None:
    rng, rounded = np.random.default_rng(decimals), 0
    for _ in range(60):
        n, unit = int(rng.integers(1, 4)), 2.0 ** int(rng.integers(-60, 60))
        A, b, V = (np.round(rng.uniform(-9, 9, size), decimals) for size in ((5, n), 5, (4, n)))
        sides = moved_sides(Rows(A, b * unit).in_core, V * unit)
        for row, given, side in zip(A, b, sides, strict=True):
            value = min(Fraction(given * unit) - exact_form(row, v * unit) for v in V)
            assert value <= side <= value + 2 * Fraction(np.spacing(abs(side)))
            rounded += side != value
    assert (rounded == 0) == (decimals == 0)
    assert moved_sides(Rows([[1e200]], [1.0]).in_core, np.ones((1, 1))) is None


def test_lower_bounds_of_supports_are_never_above_them_and_near() -> None:
    rng = np.random.default_rng(8)
    for _ in range(40):
        n, m = int(rng.integers(1, 4)), int(rng.integers(0, 4))
        units = 2.0 ** rng.integers(-30, 30, n)
        A = np.vstack([rng.standard_normal((m, n)), np.eye(n), -np.eye(n)]) * units
        A, b = np.vstack([A, A[:2]]), np.append(rng.uniform(0.1, 1.0, len(A)), [0.9, 0.8])
        P, directions = Rows(A, b), np.vstack([rng.standard_normal((5, n)) * units, A])
        V = generators_of(integer_form(A, b, A[:0], b[:0])).vertices.tolist()
        corners = [[Fraction(int(v), int(row[-1])) for v in row[:-1]] for row in V]
        assert P.prepared is not None
        for c, low in zip(directions, P.prepared.lower_supports(directions), strict=True):
            exact = max(sum(Fraction(u) * v for u, v in zip(c.tolist(), x, strict=True)) for x in corners)
            assert low <= exact <= low + 1e-13 * max(1.0, abs(low))
    half = Rows([[1.0, 0.0]], [1.0]).prepared
    assert half is None or half.lower_supports(np.array([[0.0, 1.0]])) == [np.inf]


def test_a_first_support_is_no_more_than_some_roundings_above_the_exact_one() -> None:
    rng = np.random.default_rng(1)
    body = HPolytope(np.vstack([rng.standard_normal((20, 5)), np.eye(5), -np.eye(5)]), np.ones(30))
    P, near = body.project([3, 0, 1]), body.project_within([3, 0, 1], 0.05)
    for c in near.outer.A[:8]:
        above = Fraction(HPolytope(P.A, P.b).support(c)) - HPolytope(P.A, P.b).support(c, exact=True)
        assert 0 <= above <= 1e-13


def test_hulls_of_short_points_are_those_in_integers_of_any_size() -> None:
    rng, known = np.random.default_rng(1), 0
    for _ in range(150):
        n = int(rng.integers(1, 5))
        V = np.ldexp(rng.integers(-4, 5, (int(rng.integers(n + 1, 12)), n)).astype(float), int(rng.integers(-20, 20)))
        found = short_hull(V)
        points = integer_rows(np.hstack([V, np.ones((len(V), 1))]))
        nothing = np.zeros((0, n), np.int64)
        A, b, C, _ = float_rows(ExactGenerators(distinct(points), nothing, nothing))
        if found is None:
            assert len(C)
            continue
        known += 1
        assert {tuple(row) for row in found} == {tuple(row) for row in np.hstack([A, b[:, None]])}
    assert known > 100


def test_numbers_that_do_not_fit_are_left_to_larger_integers() -> None:
    assert short_vertices(Rows([[1.0], [-1.0]], [0.1, 0.0]).in_core) is None
    assert short_hull(np.array([[0.1], [0.2]])) is None
    large = np.array([[2.0**31 - 1, 1.0], [1.0, 2.0**31 - 1], [-(2.0**31 - 3), 3.0], [5.0, -(2.0**31 - 5)]])
    assert short_vertices(Rows(large, [2.0**31 - 7, 3.0, 5.0, 2.0**31 - 9]).in_core) is None
    P = HPolytope(large, np.array([2.0**31 - 7, 3.0, 5.0, 2.0**31 - 9]))
    assert [tuple(map(float, v)) for v in P.vertices(exact=True)] == [tuple(v) for v in P.vertices().tolist()]


def cyclic(rng: np.random.Generator) -> Floats:
    return rng.uniform(-1.0, 1.0, (9, 1)) ** np.arange(1, int(rng.integers(3, 5)))


def permuted(rng: np.random.Generator) -> Floats:
    return np.array(list(itertools.permutations(range(4))))[:, :3] @ np.linalg.qr(rng.standard_normal((3, 3)))[0]


def lattice(rng: np.random.Generator) -> Floats:
    """Points in common faces, some inside, some twice."""
    grid = np.array(list(itertools.product([-1.0, 0.0, 1.0], repeat=3)))
    some = np.vstack([grid[rng.permutation(27)[:20]], grid[:1], grid[-1:]])
    return some @ np.linalg.qr(rng.standard_normal((3, 3)))[0]


def bumped(size: float) -> Floats:
    """A cube with a pyramid on a face, so flat that its facets are nearly the face's."""
    return np.vstack([list(itertools.product([-1.0, 1.0], repeat=3)), [[0.1, 0.2, 1.0 + size]]]) / 3.0


POINTS = {
    "cyclic": cyclic,
    "permuted": permuted,
    "lattice": lattice,
    "random": lambda rng: rng.standard_normal((12, int(rng.integers(1, 5)))),
    **{f"bump of 1e-{k}": lambda rng, k=k: bumped(10.0**-k) for k in range(8, 17)},
}


@pytest.mark.parametrize("kind", POINTS)
def test_a_hull_in_floats_holds_every_point_exactly_and_reaches_no_further(kind: str) -> None:
    rng, found = np.random.default_rng([3, len(kind)]), 0
    for _ in range(6):
        V = POINTS[kind](rng)
        units = 2.0 ** rng.integers(-30, 31, V.shape[1])
        V = V * units
        rows = rows_around(V)
        if rows is None:
            continue
        found += 1
        for row in rows:
            assert max(exact_form(row[:-1], v) for v in V) <= Fraction(row[-1])
        P = HPolytope(rows[:, :-1], rows[:, -1])
        directions = rng.standard_normal((40, len(units))) / units
        excess = P.support(directions) - (V @ directions.T).max(axis=0)
        assert excess.max() < 1e-9 * np.ptp(V @ directions.T, axis=0).max()
        assert len(P.remove_redundancy().b) == len(rows)
    assert found or kind in ("bump of 1e-9", "bump of 1e-10")


@pytest.mark.parametrize("kind", ["cyclic", "permuted", "lattice", "random"])
def test_volumes_by_simplices_are_right(kind: str) -> None:
    rng, found = np.random.default_rng([4, len(kind)]), 0
    for _ in range(5):
        V = POINTS[kind](rng) * 2.0 ** float(rng.integers(-30, 31))
        P = HPolytope.from_vertices(V)
        exact = P.volume(exact=True)
        volume = None if P.prepared is None else summed_volume(P.prepared)
        assert P.volume() == pytest.approx(float(exact), rel=1e-9)
        found += volume is not None
        assert volume is None or volume == pytest.approx(float(exact), rel=1e-11)
    assert found


def test_volumes_of_short_sets_are_right() -> None:
    rng, found = np.random.default_rng(5), 0
    for _ in range(60):
        A, b = short_rows(rng)
        A, b = A[: len(b)], b[: len(A)]
        volume = short_volume(Rows(A, b).in_core)
        if volume is not None:
            found += 1
            assert volume == pytest.approx(float(HPolytope(A, b).volume(exact=True)), rel=1e-13)
    assert found > 15
    assert short_volume(HPolytope.box(-np.ones(9), np.ones(9)).in_core) is None  # 9! simplices
    assert HPolytope.cross_polytope(5).volume() == pytest.approx(2.0**5 / 120.0, rel=1e-14)


def test_volumes_of_flat_and_thin_sets_are_right() -> None:
    rng, flat, thin = np.random.default_rng(6), 0, 0
    for _ in range(40):
        A, b = short_rows(rng)
        A, b, n = A[: len(b)], b[: len(A)], A.shape[1]
        row, side = rng.integers(-3, 4, n).astype(float), float(rng.integers(0, 3))
        thickness = float(rng.choice([0.0, 2.0**-20, 2.0**-30]))
        A, b = np.vstack([A, 3.0 * row, -3.0 * row]), np.r_[b, side, thickness - side]
        exact = HPolytope(A, b).volume(exact=True)
        assert HPolytope(A, b).volume() == pytest.approx(float(exact), rel=1e-9, abs=0.0)
        flat, thin = flat + (exact == 0), thin + (thickness > 0.0 and 0 < exact < np.inf)
    assert flat > 5
    assert thin > 2
    near = HPolytope([[2.0**31 - 1], [-(2.0**31 - 3)]], [2.0**30, -(2.0**30 - 1)])  # ends that are one float
    assert near.volume() == pytest.approx(float(near.volume(exact=True)), rel=1e-15)
    assert HPolytope([[3.0, 0.0], [-3.0, 0.0], [0.0, 1.0]], [1.0, -1.0, 1.0]).volume() == 0.0
    slab = HPolytope([[0.1, 0.0], [-0.1, 0.0], [0.0, 1.0], [0.0, -1.0]], [0.1, -0.1 + 2.0**-52, 1.0, 1.0])
    assert slab.volume() == pytest.approx(float(slab.volume(exact=True)), rel=1e-15)


def test_no_vertex_is_where_rows_that_nearly_depend_on_each_other_meet() -> None:
    rng, found = np.random.default_rng(7), 0
    for _ in range(20):
        n = int(rng.integers(3, 5))
        A = np.vstack([rng.integers(-3, 4, (n, n)), np.eye(n), -np.eye(n)])
        b = np.r_[rng.integers(1, 4, n), np.full(2 * n, 0.7)]
        for _ in range(2):
            i, j = rng.integers(len(b), size=2)
            A, b = np.vstack([A, A[i] + A[j]]), np.r_[b, b[i] + b[j] - 1e-11]
        P = HPolytope(A, b)
        if P.listed is None:
            continue
        found += 1
        assert (P.A @ P.vertices().T - P.b[:, None]).max() < 1e-9
        assert P.volume() == pytest.approx(float(P.volume(exact=True)), rel=1e-9)
    assert found > 8


def test_a_box_moves_each_row_by_the_corner_that_it_needs() -> None:
    """Not by all corners, of which a box in R^20 has a million."""
    rng = np.random.default_rng(20)
    for n in (3, 8, 20):
        A, b = rng.integers(-3, 4, (40, n)).astype(float), rng.integers(50, 99, 40).astype(float)
        lower = rng.integers(-4, 1, n).astype(float)
        upper = lower + rng.integers(0, 3, n)
        kept = HPolytope(A, b) - HPolytope.box(lower, upper)
        assert (kept.b == b - np.maximum(A * lower, A * upper).sum(axis=1)).all()
        halved = HPolytope(A / 2.0**40, b / 2.0**40) - HPolytope.box(lower, upper)
        assert (halved.b * 2.0**40 == kept.b).all()
