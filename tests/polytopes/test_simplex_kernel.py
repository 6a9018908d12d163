"""The compiled kernel against HiGHS, and its multipliers against the equations they must satisfy."""

from fractions import Fraction

import numpy as np
import pytest
from random_programs import KINDS, many

from polytopes import HPolytope, kernel
from polytopes.highs import HighsProgram
from polytopes.preparation import prepare


@pytest.mark.parametrize("kind", KINDS)
def test_supports_agree_with_highs(kind: str) -> None:
    compared = 0
    for rng, A, b in many(kind, 150):
        P = HPolytope(A, b)
        if P.emptiness().status == "empty":
            continue
        directions = np.vstack([A[0], rng.standard_normal((4, P.dim))])
        ours, reference = P.support(directions), HighsProgram(A, b)
        for direction, value in zip(directions, ours, strict=True):
            answer = reference.maximise(direction)
            if answer.status == "optimal":
                assert value == pytest.approx(answer.value, rel=1e-8, abs=1e-8)
                compared += 1
            elif answer.status == "unbounded":
                assert value == np.inf
                compared += 1
    assert compared > 400 or kind == "empty"


@pytest.mark.parametrize("kind", KINDS)
def test_points_are_feasible_and_multipliers_prove_the_value(kind: str) -> None:
    for rng, A, b in many(kind, 100):
        P = HPolytope(A, b)
        if P.emptiness().status == "empty":
            continue
        directions = rng.standard_normal((5, P.dim))
        result = P.support_points(directions)
        finite = np.isfinite(result.values)
        points, weights = result.points[finite], result.multipliers[finite]
        reach = max(1.0, np.abs(points).max(initial=0.0))
        lengths = np.linalg.norm(A, axis=1)
        assert (points @ A.T <= b + 1e-11 * reach * lengths + 1e-13 * np.abs(b)).all()
        assert (weights * lengths >= -1e-9).all()
        np.testing.assert_allclose(weights @ A, directions[finite], atol=1e-8)
        np.testing.assert_allclose(weights @ b, result.values[finite], rtol=1e-9, atol=1e-9 * reach)


def exact_vertex(AT: np.ndarray, b: np.ndarray, active: np.ndarray) -> list[Fraction]:
    """Where the active rows hold with equality, by Gauss and Jordan in rationals; artificial ones hold at zero."""
    d = len(AT)
    rows = [[*map(Fraction, AT[:, i].tolist()), Fraction(b[i])] if i >= 0 else
            [Fraction(int(j == -1 - i)) for j in range(d)] + [Fraction(0)] for i in active.tolist()]  # fmt: skip
    for j in range(d):
        pivot = next(row for row in rows[j:] if row[j])
        rows.remove(pivot)
        rows.insert(j, [v / pivot[j] for v in pivot])
        rows = [row if k == j else [u - row[j] * v for u, v in zip(row, rows[j], strict=True)]
                for k, row in enumerate(rows)]  # fmt: skip
    return [row[d] for row in rows]


@pytest.mark.parametrize("seed", range(30))
def test_bounds_are_not_undercut_by_an_exact_vertex(seed: int) -> None:
    """c'x of the exact vertex against ``bounds - spare + beside'|x|``, which is within a few units of rounding."""
    rng = np.random.default_rng(seed)
    d, m = int(rng.integers(1, 6)), int(rng.integers(12, 40))
    A = rng.standard_normal((m, d))
    P = HPolytope(A, rng.uniform(0.5, 1.5, m))
    AT, b = P.program.AT, P.program.rhs
    C = rng.standard_normal((5, d))
    _, _, bounds, spare, beside, active, status = kernel.supports(AT, b, P.program.centre, C)
    for q in np.flatnonzero(status == kernel.OPTIMAL):
        x = exact_vertex(AT, b, active[q])
        value = sum(Fraction(c) * v for c, v in zip(C[q].tolist(), x, strict=True))
        bound = Fraction(bounds[q]) - Fraction(spare[q])
        bound += sum(Fraction(e) * abs(v) for e, v in zip(beside[q].tolist(), x, strict=True))
        assert value <= bound
        assert bound - value <= 2.0**-48 * (1.0 + abs(value))


def test_batch_and_single_directions_agree() -> None:
    rng = np.random.default_rng(5)
    P = HPolytope(rng.standard_normal((50, 5)), rng.uniform(0.5, 1.5, 50))
    directions = rng.standard_normal((200, 5))
    singles = [P.support(direction) for direction in directions]
    np.testing.assert_allclose(P.support(directions), singles, rtol=1e-12)


def test_equalities_give_the_support_of_the_flat_set() -> None:
    rng = np.random.default_rng(6)
    for _ in range(50):
        C, d = rng.standard_normal((2, 5)), rng.standard_normal(2) * 0.1
        A, b = np.vstack([np.eye(5), -np.eye(5)]), np.ones(10)
        flat = HPolytope(A, b, C, d)
        pair = HighsProgram(np.vstack([A, C, -C]), np.concatenate([b, d, -d]))
        c = rng.standard_normal(5)
        result = flat.support_points(c)
        assert result.values[0] == pytest.approx(pair.maximise(c).value, abs=1e-8)
        combined = result.multipliers[0] @ A + result.equality_multipliers[0] @ C
        np.testing.assert_allclose(combined, c, atol=1e-9)
        assert result.multipliers[0] @ b + result.equality_multipliers[0] @ d == pytest.approx(result.values[0])


def test_small_coefficients_are_not_dropped() -> None:
    wedge = HPolytope([[1e-8, 1.0], [0.0, -1.0], [-1.0, 0.0]], [1.0, 0.0, 0.0])
    assert wedge.support([1.0, 0.0]) == pytest.approx(1e8)
    needle = HPolytope([[1e-11, 1.0], [0.0, -1.0], [-1.0, 0.0]], [1.0, 0.0, 0.0])
    assert needle.support([1.0, 0.0]) == pytest.approx(1e11)
    assert needle.is_bounded()


def test_largest_ball_on_a_known_set() -> None:
    ball = HPolytope([[3.0, 4.0], [-1.0, 0.0], [0.0, -1.0]], [12.0, 0.0, 0.0]).chebyshev()
    assert ball.radius == pytest.approx(1.0)
    np.testing.assert_allclose(ball.centre, [1.0, 1.0])
    assert HPolytope([[1.0, 0.0]], [1.0]).chebyshev().radius == np.inf
    segment = HPolytope.box([-1.0, -1.0], [1.0, 1.0]).intersection(HPolytope([[0.0, 0.0]], [0.0], [[1.0, 1.0]], [0.0]))
    assert segment.chebyshev().radius == pytest.approx(np.sqrt(2.0))


def test_large_programs_go_to_highs() -> None:
    rng = np.random.default_rng(7)
    A, b = rng.standard_normal((120, 60)), rng.uniform(1.0, 2.0, 120)
    P = HPolytope(np.vstack([A, np.eye(60), -np.eye(60)]), np.append(b, np.ones(120)))
    assert P.emptiness().status == "nonempty"
    c = rng.standard_normal(60)
    result = P.support_points(c)
    assert result.multipliers[0] @ P.b == pytest.approx(result.values[0])


def test_failure_of_the_kernel_is_repaired(monkeypatch: pytest.MonkeyPatch) -> None:
    skew = HPolytope.box([0.0, 0.0], [1.0, 2.0]).intersection(HPolytope([[1.0, 1.0]], [2.5]))
    assert skew.support([1.0, 1.0]) == pytest.approx(2.5)
    supports = kernel.supports

    def broken(*arguments: np.ndarray) -> tuple[np.ndarray, ...]:
        *results, status = supports(*arguments)
        return *results, np.full_like(status, kernel.LIMIT)

    monkeypatch.setattr(kernel, "supports", broken)
    assert skew.support([1.0, 1.0]) == pytest.approx(2.5)


def test_scaling_is_by_powers_of_two_only() -> None:
    rng = np.random.default_rng(8)
    A = rng.standard_normal((20, 3)) * 10.0 ** rng.uniform(-6, 6, (20, 1))
    program = prepare(A, rng.random(20), np.empty((0, 3)), np.empty(0))
    assert (np.frexp(program.scale)[0] == 0.5).all()
    np.testing.assert_array_equal(program.AT.T / program.scale[:, None] / program.columns, A)
    assert (program.norms >= 0.5).all()
    assert (program.norms < 1.0).all()


def test_near_ties_do_not_displace_a_vertex() -> None:
    """Rows that meet within the Harris tolerance (1e-11) of a point: the optimum satisfies them to rounding."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        A = rng.standard_normal((30, 4))
        A /= np.linalg.norm(A, axis=1)[:, None]
        A *= np.sign(A @ [1.0, 1.0, 1.0, 1.0])[:, None]
        b = A @ [0.3, -0.2, 0.1, 0.4] + rng.uniform(0.0, 5e-12, 30)
        P = HPolytope(A, b).intersection(HPolytope.box([-1.0] * 4, [1.0] * 4))
        result = P.support_points(np.vstack([A[:5], rng.standard_normal((5, 4))]))
        assert (result.points @ P.A.T - P.b).max() <= 1e-13
        np.testing.assert_allclose(result.multipliers @ P.b, result.values, rtol=0.0, atol=1e-13)
        assert (result.multipliers >= -1e-13).all()


def test_bounds_hold_where_products_underflow() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        c, b = 1.0 + rng.random(), (1.0 + rng.random()) * 2.0**-1030
        _, _, bounds, spare, beside, _, status = kernel.supports(
            np.array([[1.0, -1.0]]), np.array([b, 1.0]), np.zeros(1), np.array([[c]])
        )
        exact = Fraction(c) * Fraction(b)
        assert status[0] == kernel.OPTIMAL
        assert exact <= Fraction(bounds[0]) - Fraction(spare[0]) + Fraction(beside[0, 0]) * Fraction(b)
