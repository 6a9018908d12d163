"""Operators and small operations, over every kind of set, against exact rationals."""

import itertools
import math
from fractions import Fraction

import numpy as np
import ppl
import pytest
import scipy.sparse
from exact_sets import polyhedron
from kinds_of_sets import KINDS, eroded, integer_set, mapped, rows_of, total_of
from sets import CATALOGUE, EMPTY

from polytopes import Emptiness, HPolytope, UndecidedError

EVERY = pytest.mark.parametrize("name", CATALOGUE)
SAME_SPACE = [(p, q) for p, q in itertools.product(CATALOGUE, repeat=2) if CATALOGUE[p].dim == CATALOGUE[q].dim]
PAIRS = [pytest.param(*pair, marks=[pytest.mark.slow] if k % 3 else []) for k, pair in enumerate(SAME_SPACE)]


def image(P: HPolytope, s: float, t: list[float]) -> ppl.C_Polyhedron:
    """``s x + t`` over P, the floats taken as rationals."""
    ratios = [Fraction(v) for v in (s, *t)]
    common = math.lcm(*(v.denominator for v in ratios))
    scale, *shift = (int(v * common) for v in ratios)
    return mapped(polyhedron(P), scale * np.eye(P.dim, dtype=object), np.array(shift, dtype=object), common)


def exact_point(x: list[float]) -> ppl.C_Polyhedron:
    ratios = [Fraction(v) for v in x]
    common = max(v.denominator for v in ratios)
    form = sum((int(v * common) * ppl.Variable(j) for j, v in enumerate(ratios)), 0 * ppl.Variable(len(x) - 1))
    system = ppl.Generator_System()
    system.insert(ppl.point(form, common))
    return ppl.C_Polyhedron(system)


@EVERY
def test_translation_and_scaling_of_short_numbers_are_exact(name: str) -> None:
    P = CATALOGUE[name]
    t = [0.5, -2.25, 3.0][: P.dim]
    one = [0.0] * P.dim
    if name not in ("decimal ray", "slice", "scaled rows"):
        assert polyhedron(P + t) == polyhedron(t + P) == polyhedron(np.array(t) + P) == image(P, 1.0, t)
        assert polyhedron(P - t) == image(P, 1.0, [-v for v in t])
        for s in (2.0, -0.5, 3.0, 0.375):
            assert polyhedron(s * P) == polyhedron(P * np.float64(s)) == image(P, s, one)
    assert polyhedron(-P) == image(P, -1.0, one)
    assert polyhedron(0 * P) == image(P, 0.0, one)
    assert polyhedron(1 * P) == polyhedron(P + one) == polyhedron(P)


@EVERY
def test_translation_and_scaling_of_decimals_contain_the_exact_set(name: str) -> None:
    P, rng = CATALOGUE[name], np.random.default_rng(4)
    for _ in range(10):
        t, s = rng.standard_normal(P.dim).tolist(), float(rng.standard_normal())
        for made, exact in ((P + t, image(P, 1.0, t)), (s * P, image(P, s, [0.0] * P.dim))):
            assert polyhedron(made).contains(exact)
            assert made.is_empty() == (name in EMPTY)
            if P.is_bounded() and name not in EMPTY:
                V = s * P.vertices() if exact == image(P, s, [0.0] * P.dim) else P.vertices() + t
                assert HPolytope.from_vertices(V).contains(made, tol=1e-15 * np.linalg.norm(V, axis=1).max())


@pytest.mark.parametrize(("p", "q"), PAIRS)
def test_inclusion_and_equality_are_exact(p: str, q: str) -> None:
    P, Q = CATALOGUE[p], CATALOGUE[q]
    first, second = polyhedron(P), polyhedron(Q)
    assert (P <= Q) == (Q >= P) == second.contains(first)
    assert (P == Q) == (first == second)
    assert (P != Q) == (first != second)
    assert polyhedron(P & Q) == polyhedron(P.intersection(Q))


@pytest.mark.parametrize("count", [60, pytest.param(1000, marks=pytest.mark.slow)])
def test_operators_of_random_pairs_match_an_exact_library(count: int) -> None:
    for case in range(count):
        rng = np.random.default_rng([case, 21])
        n = 1 + case % 3
        P, Q = (integer_set(rng, KINDS[k], n) for k in rng.integers(0, len(KINDS), 2))
        first, second, t, M = rows_of(P), rows_of(Q), rng.integers(-3, 4, n), rng.integers(-2, 3, (2, n))
        assert polyhedron(first + second) == total_of(P, Q), case
        assert polyhedron(first - second) == eroded(P, Q), case
        assert polyhedron(M @ first) == mapped(P, M, np.zeros(2, dtype=int)), case
        assert polyhedron(scipy.sparse.csr_array(M) @ first) == polyhedron(M @ first), case
        assert polyhedron(first + t) == mapped(P, np.eye(n, dtype=int), t), case
        assert (first <= second) == Q.contains(P), case
        assert (first == second) == (P == Q), case
        assert first == first.remove_redundancy(), case
        x = rng.integers(-4, 5, n).astype(float)
        assert (x in first) == P.contains(exact_point(x.tolist())), case


@pytest.mark.parametrize("unit", [2.0**-40, 1.0, 0.1, 2.0**60])
def test_one_unit_in_the_last_place_decides(unit: float) -> None:
    rng = np.random.default_rng(5)
    for case in range(30):
        n = 1 + case % 4
        A, b = np.vstack([rng.standard_normal((5, n)), np.eye(n), -np.eye(n)]), np.full(5 + 2 * n, 1.0) * unit
        P, i = HPolytope(A, b), int(rng.integers(0, 5 + 2 * n))
        b[i] = np.nextafter(b[i], np.inf)
        Q = HPolytope(A, b)
        assert P <= Q
        assert (Q <= P) == (P == Q) == polyhedron(P).contains(polyhedron(Q)), case
        corner = P.support_points(A[i]).points[0].tolist()
        assert (corner in P) == polyhedron(P).contains(exact_point(corner)), case
        assert (corner in Q) == polyhedron(Q).contains(exact_point(corner)), case


def test_points_on_the_boundary_are_in_the_set() -> None:
    P = HPolytope.box([0.0, 0.1], [0.3, 0.7])
    assert [0.3, 0.1] in P
    assert [0.1 + 0.2, 0.1] not in P  # 0.30000000000000004
    assert [5, 7] in HPolytope.whole_space(2)
    assert [5, 7] not in HPolytope.empty(2)
    with pytest.raises(ValueError, match=r"x has shape \(3,\)"):
        [0.0, 0.0, 0.0] in P  # noqa: B015
    with pytest.raises(TypeError, match="Q <= P"):
        P in P  # noqa: B015


def test_sets_compare_as_sets_and_have_no_hash() -> None:
    P = HPolytope.box([0.0, 0.0], [1.0, 1.0])
    pentagon = HPolytope([[2, 0], [0, 2], [-1, 0], [0, -1], [1, 1]], [2, 2, 0, 0, 2])
    assert P == HPolytope.from_vertices(P.vertices()) == pentagon
    interval = HPolytope.box([0.0], [1.0])
    assert interval != P
    assert P != "square"
    assert P != P.A
    assert HPolytope.empty(2) == HPolytope([[0.0, 0.0]], [-3.0])
    with pytest.raises(TypeError, match="unhashable"):
        {P}  # noqa: B018
    with pytest.raises(ValueError, match="Q has dimension 2"):
        interval >= P  # noqa: B015
    with pytest.raises(TypeError, match="not supported"):
        P <= 3  # noqa: B015


def test_what_is_undecided_raises() -> None:
    P, Q = HPolytope([[1.0], [-1.0]], [0.5, -0.5]), HPolytope([[2.0], [-2.0]], [1.0, -1.0])
    P.__dict__["decided"] = Emptiness("undecided", None, None, "told so")
    P.__dict__["as_box"] = None
    for ask in (lambda: P == Q, lambda: P <= Q, lambda: P.is_empty(), lambda: Q == P, lambda: 0 * P):
        with pytest.raises(UndecidedError, match="told so"):
            ask()
    assert HPolytope(P.A, P.b) == P  # the same rows: no question about points


def test_wrong_operands_are_refused() -> None:
    P = HPolytope.box([0.0, 0.0], [1.0, 1.0])
    with pytest.raises(ValueError, match=r"M has shape \(3, 3\)"):
        np.eye(3) @ P
    with pytest.raises(ValueError, match=r"t has shape \(\)"):
        P + 1.0
    with pytest.raises(ValueError, match="Q has dimension 1"):
        P & HPolytope.box([0.0], [1.0])
    with pytest.raises(TypeError):
        P & 3
    with pytest.raises(TypeError):
        P * P
    with pytest.raises(ValueError, match="s has shape"):
        P * [1.0, 2.0]
    with pytest.raises(ValueError, match="k is 0; expected an integer of at least 1"):
        P**0
    with pytest.raises(TypeError):
        [1.0, 1.0] - P


@EVERY
def test_a_power_is_the_product_with_itself(name: str) -> None:
    P = CATALOGUE[name]
    assert polyhedron(P**2) == polyhedron(P.product(P))
    assert (P**1) == P


@EVERY
def test_slices_and_cylinders(name: str) -> None:
    P = CATALOGUE[name]
    cylinder = P.lift(P.dim + 1)
    assert polyhedron(cylinder) == polyhedron(P.product(HPolytope.whole_space(1)))
    order = list(range(P.dim, 0, -1))
    if name != "decimal ray":  # turned around, its exact rows are no floats
        turned = np.eye(P.dim)[::-1] @ P
        assert polyhedron(P.lift(P.dim + 1, order)) == polyhedron(HPolytope.whole_space(1).product(turned))
    assert cylinder.slice({P.dim: 7.25}) == P
    assert P.slice({}) == P
    if P.dim == 1:
        return
    for value in (0.25, 0.0, 3.0, 0.3):
        cut, exact, ratio = polyhedron(P.slice({0: value})), polyhedron(P), Fraction(value)
        exact.add_constraint(ratio.denominator * ppl.Variable(0) == ratio.numerator)
        shadow = mapped(exact, np.eye(P.dim, dtype=int)[1:], np.zeros(P.dim - 1, dtype=int))
        assert cut.contains(shadow)
        if value != 0.3 and name not in ("decimal ray", "slice"):
            assert cut == shadow


def test_wrong_slices_and_cylinders_are_refused() -> None:
    P = HPolytope.box([0.0, 0.0], [1.0, 1.0])
    with pytest.raises(ValueError, match="fixed has all 2 coordinates"):
        P.slice({0: 1.0, 1: 0.0})
    with pytest.raises(ValueError, match=r"fixed is \[2\]"):
        P.slice({2: 1.0})
    with pytest.raises(TypeError, match="expected a mapping"):
        P.slice([0])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="n is 1"):
        P.lift(1)
    with pytest.raises(ValueError, match=r"coordinates is \[0\]; expected 2"):
        P.lift(3, [0])


@EVERY
def test_rows_of_length_one(name: str) -> None:
    P = CATALOGUE[name]
    Q = P.normalise()
    if name in EMPTY:
        assert Q.is_empty()
        return
    np.testing.assert_allclose(np.linalg.norm(np.vstack([Q.A, Q.C]), axis=1), 1.0, rtol=1e-15)
    if P.is_bounded():
        assert P <= Q
        assert Q.equals(P, tol=1e-12)
    else:
        for rows, sides, unit, distances in ((P.A, P.b, Q.A, Q.b), (P.C, P.d, Q.C, Q.d)):
            lengths = np.linalg.norm(rows, axis=1)
            np.testing.assert_allclose(unit * lengths[:, None], rows, rtol=1e-15)
            np.testing.assert_allclose(distances * lengths, sides, rtol=1e-15)


@EVERY
def test_affine_hull(name: str) -> None:
    P = CATALOGUE[name]
    hull = P.affine_hull()
    assert hull >= P
    assert hull.affine_dim() == P.affine_dim()
    assert hull.b.size == (1 if name in EMPTY else 0)
    assert name in EMPTY or hull.d.size == P.dim - P.affine_dim()


def test_rows_without_a_bound_and_sparse_rows() -> None:
    A, C = scipy.sparse.csr_matrix([[1.0, 0.0], [0.0, 2.0]]), scipy.sparse.eye_array(2)
    P = HPolytope(A, [np.inf, 4.0], C, [1.0, 2.0])
    np.testing.assert_array_equal(P.A, [[0.0, 2.0]])
    np.testing.assert_array_equal(P.C, np.eye(2))
    with pytest.raises(ValueError, match=r"b\[1\] is -inf"):
        HPolytope(np.eye(2), [1.0, -np.inf])
    with pytest.raises(ValueError, match="b contains NaN"):
        HPolytope(np.eye(2), [1.0, np.nan])
