"""Powers of two on coordinates and rows change nothing, and no support is inward of the exact one.

The oracle is the Parma library, on the floats as rationals.
"""

from fractions import Fraction

import numpy as np
import ppl
import pytest
from exact_sets import polyhedron
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from polytopes import Certificate, HPolytope, duality
from polytopes.emptiness import strictly_inside
from polytopes.linear_program import Program
from polytopes.outer_supports import reach

Floats = NDArray[np.float64]


def slanted(rng: np.random.Generator, n: int, kind: str) -> HPolytope:
    """A random set: fat, far from the origin, thin, flat by an equality, touching, or empty by little."""
    m = int(rng.integers(n + 2, 3 * n + 3))
    A, x = rng.standard_normal((m, n)), rng.standard_normal(n) * (100.0 if kind == "far" else 1.0)
    box, room = np.vstack([np.eye(n), -np.eye(n)]), np.append(x + 2.0, 2.0 - x)
    if kind in ("touching", "empty"):  # above a corner, and below a plane through it, or beneath it
        corner, gap = np.round(x), 2.0 ** float(rng.integers(-50, -20)) if kind == "empty" else 0.0
        below = np.append(-corner, corner.sum() - gap)
        return HPolytope(np.vstack([-np.eye(n), np.ones(n), box]), np.append(below, room))
    slack = rng.random(m) * (10.0 ** rng.uniform(-9, -4) if kind == "thin" else 1.0)
    A, b = np.vstack([A, box]), np.append(A @ x + slack, room)
    if kind == "flat":
        normal = rng.standard_normal(n)
        return HPolytope(A, b, normal[None], [normal @ x])
    return HPolytope(A, b)


KINDS = ("fat", "far", "thin", "flat", "touching", "empty")


def in_units(P: HPolytope, columns: NDArray[np.int64], rows: NDArray[np.int64]) -> HPolytope:
    """The set with coordinates times ``2^columns`` and rows times ``2^rows``."""
    m = P.b.size
    A, C = np.ldexp(P.A, rows[:m, None] - columns), np.ldexp(P.C, rows[m:, None] - columns)
    return HPolytope(A, np.ldexp(P.b, rows[:m]), C, np.ldexp(P.d, rows[m:]))


def even(proof: Certificate, rows: NDArray[np.int64], m: int) -> tuple[dict, dict]:
    """The multipliers of a scaled set as those of the set before."""
    power = [Fraction(2) ** int(p) for p in rows]
    return (
        {i: Fraction(int(v.p), int(v.q)) * power[i] for i, v in proof.inequality.items()},
        {k: Fraction(int(v.p), int(v.q)) * power[m + k] for k, v in proof.equality.items()},
    )


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 4), st.sampled_from(KINDS))
def test_powers_of_two_change_nothing(seed: int, n: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    P = slanted(rng, n, kind)
    columns, rows = rng.integers(-60, 61, n), rng.integers(-60, 61, P.b.size + P.d.size)
    Q = in_units(P, columns, rows)
    ours, theirs = P.emptiness(), Q.emptiness()
    assert ours.status == theirs.status
    if ours.certificate is not None:
        assert theirs.certificate is not None
        assert theirs.certificate.verify(Q)
        none = np.zeros_like(rows)
        assert even(theirs.certificate, rows, P.b.size) == even(ours.certificate, none, P.b.size)
        return
    np.testing.assert_array_equal(np.ldexp(ours.witness, columns), theirs.witness)
    for mine, other in zip(P.bounding_box(), Q.bounding_box(), strict=True):
        np.testing.assert_array_equal(np.ldexp(mine, columns), other)
    c = rng.standard_normal((5, n))
    np.testing.assert_array_equal(P.support(c), Q.support(np.ldexp(c, -columns)))
    assert P.affine_dim() == Q.affine_dim()


@pytest.mark.parametrize("n", [2, 3])
def test_vertices_scale_along(n: int) -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        P = slanted(rng, n, "fat")
        columns, rows = rng.integers(-60, 61, n), rng.integers(-60, 61, P.b.size)
        V, W = P.vertices(), np.ldexp(in_units(P, columns, rows).vertices(), -columns)
        assert len(V) == len(W)
        reach = 1e-9 * np.abs(V).max()
        assert (np.abs(V[:, None] - W).max(axis=2).min(axis=1) <= reach).all()


def exact_support(P: ppl.C_Polyhedron, c: Floats) -> Fraction | None:
    ratios = [float(v).as_integer_ratio() for v in c]
    common = max(q for _, q in ratios)
    form = sum((p * (common // q) * ppl.Variable(j) for j, (p, q) in enumerate(ratios)), 0 * ppl.Variable(len(c) - 1))
    answer = P.maximize(form)
    return Fraction(int(answer["sup_n"]), int(answer["sup_d"]) * common) if answer["bounded"] else None


def check_outward(P: HPolytope, directions: Floats) -> None:
    """No support below the exact one, and none above it by more than 1e-12 of the size of the set along c."""
    exact = polyhedron(P)
    result = P.support_points(directions)
    reach = np.nan_to_num(np.abs(result.points)).max(axis=0)
    for c, value in zip(directions, result.values, strict=True):
        right = exact_support(exact, c)
        if right is None:
            assert value == np.inf
            continue
        assert Fraction(float(value)) >= right
        assert float(Fraction(float(value)) - right) <= 1e-12 * float(np.abs(c) @ reach + abs(value))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 4), st.sampled_from(KINDS[:4]))
def test_supports_and_boxes_are_outward(seed: int, n: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    P = slanted(rng, n, kind)
    if P.emptiness().status == "empty":
        return
    check_outward(P, np.vstack([np.eye(n), -np.eye(n), rng.standard_normal((4, n)), P.A[:2]]))
    lower, upper = P.bounding_box()
    assert (lower <= upper).all()


@pytest.mark.parametrize("seed", range(6))
def test_supports_of_unbounded_sets_are_outward(seed: int) -> None:
    """A direction that is a row but for rounding is truly unbounded; one that is a row is not."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((2, 3))
    P = HPolytope(A, rng.random(2))
    check_outward(P, np.vstack([A, A[0] + A[1], A[0] / 3.0, rng.standard_normal((2, 3))]))


def test_columns_of_very_different_units_keep_the_box_outward() -> None:
    """25 of 400 boxes were inward, often with the lower bound above the upper one."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        P = slanted(rng, 3, "fat")
        P = in_units(P, rng.choice([-40, 0, 40], 3), np.zeros(P.b.size, np.int64))
        lower, upper = P.bounding_box()
        exact = polyhedron(P)
        for j, axis in enumerate(np.eye(3)):
            assert Fraction(float(upper[j])) >= exact_support(exact, axis)
            assert Fraction(float(-lower[j])) >= exact_support(exact, -axis)
            assert lower[j] <= upper[j]


def test_what_is_exact_stays_exact() -> None:
    """Integers and short fractions: nothing is rounded, so nothing is added."""
    lower, upper = HPolytope.box([0.0, -0.75, 1e9], [1.0, 0.5, 1e9 + 1]).bounding_box()
    assert (lower.tolist(), upper.tolist()) == ([0.0, -0.75, 1e9], [1.0, 0.5, 1e9 + 1])
    simplex = HPolytope(np.vstack([-np.eye(3), np.ones((1, 3))]), [0, 0, 0, 1], [[1, -1, 0]], [0.25])
    lower, upper = simplex.bounding_box()
    assert (lower.tolist(), upper.tolist()) == ([0.25, 0.0, 0.0], [0.625, 0.375, 0.75])


def test_a_point_counts_only_beyond_what_is_rounded() -> None:
    """Rows that a point violates by less than a unit of the last place: floats often see slack where there is none."""
    rejected = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(2, 5))
        a, x = rng.standard_normal(n), rng.standard_normal(n)
        value = sum((Fraction(float(u)) * Fraction(float(v)) for u, v in zip(a, x, strict=True)), Fraction(0))
        b = float(value)
        if Fraction(b) > value:
            b = float(np.nextafter(b, -np.inf))  # the point violates the row, by less than a unit of the last place
        P = HPolytope(a[None], [b])
        program: Program = P.program
        z = np.ldexp(x, -program.powers)
        assert not strictly_inside(program, z)
        rejected += float(b - a @ x) > 0.0
    assert rejected > 10  # floats alone would have taken the point


def test_bounds_from_any_multipliers_hold() -> None:
    """Of HiGHS, say: multipliers that are off by 1e-9, on a set whose reach is known."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        A, c = rng.standard_normal((9, 3)), rng.standard_normal(3)
        A = np.vstack([A, np.eye(3), -np.eye(3)])
        b = np.append(rng.random(9), np.ones(6))
        y = np.maximum(HPolytope(A, b).support_points(c).multipliers[0] + 1e-9 * rng.standard_normal(15), 0.0)
        bounds = duality.multiplier_bounds(np.ascontiguousarray(A.T), b, c, y)
        bound = bounds.gaps(c[None], np.zeros((1, 3)), np.ones(3))[0][0]
        assert Fraction(float(bound)) >= exact_support(polyhedron(HPolytope(A, b)), c)


@pytest.mark.parametrize("seed", range(40))
def test_multipliers_of_equalities_in_other_units_combine_to_the_direction(seed: int) -> None:
    """Least squares of the rows as given left out an equality that is small beside another one."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    C, x = rng.integers(-4, 5, (int(rng.integers(1, n)), n)).astype(float), rng.integers(-4, 5, n).astype(float)
    if np.linalg.matrix_rank(C) < len(C):  # parallel rows: any two multipliers with the right sum will do
        C[0] = C[-1]
    ones = np.vstack([np.eye(n), -np.eye(n)])
    P = HPolytope(ones, ones @ x + 1.0, C, C @ x)
    columns, rows = rng.integers(-60, 61, n), rng.integers(-60, 61, P.b.size + P.d.size)
    Q, D = in_units(P, columns, rows), np.vstack([ones, rng.integers(-3, 4, (4, n))])
    answer = Q.support_points(np.ldexp(D, -columns))
    np.testing.assert_allclose(answer.values, P.support(D), rtol=1e-9, atol=1e-9)
    combined = answer.multipliers @ Q.A + answer.equality_multipliers @ Q.C
    np.testing.assert_allclose(np.ldexp(combined, columns), D, rtol=0, atol=1e-9)
    most = reach(Q)
    assert most is not None
    lower, upper = P.bounding_box()
    right = np.maximum(np.abs(lower), np.abs(upper))
    np.testing.assert_allclose(np.ldexp(most, -columns), right, rtol=1e-6, atol=1e-6)
