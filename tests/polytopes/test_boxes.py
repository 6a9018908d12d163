"""What a box is asked without a program: against exact rationals, and against the same set asked with programs."""

from fractions import Fraction

import numpy as np
import pytest

from polytopes import HPolytope
from polytopes.box import Box
from polytopes.rows import Rows

SEEDS = range(40)


def random_box(rng: np.random.Generator, exact: bool) -> tuple[np.ndarray, np.ndarray]:
    """Rows of one entry each, some coordinates without a bound, some bounded twice, one row of zeros."""
    n = int(rng.integers(1, 6))
    rows, rhs = [np.zeros(n)], [0.0]
    for j in range(n):
        for sign in (1.0, -1.0):
            for _ in range(rng.choice([0, 1, 1, 2])):
                size = 2.0 ** rng.integers(-40, 41) if exact else rng.uniform(0.1, 10.0) * 10.0 ** rng.integers(-9, 10)
                rows.append(sign * size * np.eye(n)[j])
                bound = float(rng.integers(0, 9)) if exact else rng.uniform(-0.1, 1.0)
                rhs.append(bound * size * 2.0 ** rng.integers(-3, 4))
    order = rng.permutation(len(rhs))
    return np.array(rows)[order], np.array(rhs)[order]


def corner(A: np.ndarray, b: np.ndarray, j: int, sign: int) -> Fraction | None:
    """The exact bound of ``sign x_j`` (None: there is none)."""
    found = [Fraction(r) / abs(Fraction(a)) for a, r in zip(A[:, j].tolist(), b.tolist(), strict=True) if a * sign > 0]
    return min(found, default=None)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("exact", [True, False])
def test_corners_and_supports_are_those_of_rationals_rounded_outward(seed: int, exact: bool) -> None:
    rng = np.random.default_rng(seed)
    A, b = random_box(rng, exact)
    P = HPolytope(A, b)
    n, box = P.dim, P.as_box
    bounds = [[corner(A, b, j, sign) for j in range(n)] for sign in (1, -1)]
    empty = any(u is not None and v is not None and u + v < 0 for u, v in zip(*bounds, strict=True))
    if box is None:
        assert empty or not exact  # a gap of less than a unit of the last place is left to programs
        assert (P.emptiness().status == "empty") == empty
        return
    assert not empty
    point = [Fraction(x) for x in P.emptiness().witness.tolist()]
    for row, r in zip(A.tolist(), b.tolist(), strict=True):
        assert sum(Fraction(a) * x for a, x in zip(row, point, strict=True)) <= Fraction(r)
    assert P.is_bounded() == all(v is not None for side in bounds for v in side)
    lower, upper = P.bounding_box()
    for found, right in zip([*upper, *-lower], bounds[0] + bounds[1], strict=True):
        assert_rounded_up(found, right)
    for c in np.vstack([rng.standard_normal((3, n)), rng.integers(-4, 5, (3, n))]):
        terms = [Fraction(abs(v)) * w if (w := bounds[0 if v > 0 else 1][j]) is not None else None
                 for j, v in enumerate(c.tolist()) if v]  # fmt: skip
        right = None if None in terms else sum(terms, Fraction(0))
        if exact:
            assert_rounded_up(P.support(c), right)
        elif right is None:
            assert P.support(c) == np.inf
        else:
            assert right <= Fraction(P.support(c)) <= right + sum(abs(t) for t in terms) / 2**51


def assert_rounded_up(found: float, right: Fraction | None) -> None:
    """The float itself, or the next one or two above."""
    if right is None:
        assert found == np.inf
        return
    nearest = float(right)
    above = np.nextafter(nearest, np.inf)
    assert found in {nearest, above, np.nextafter(above, np.inf)}
    assert Fraction(found) >= right
    if Fraction(nearest) == right:
        assert found == nearest


@pytest.mark.parametrize("seed", SEEDS)
def test_programs_say_the_same(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    A, b = random_box(rng, exact=False)
    quick = HPolytope(A, b)
    C = rng.standard_normal((4, quick.dim))
    answers = quick.emptiness().status, quick.is_bounded(), quick.support(C)
    monkeypatch.setattr(Box, "of", classmethod(lambda *_: None))
    slow = HPolytope(A, b)
    assert (slow.emptiness().status, slow.is_bounded()) == answers[:2]
    np.testing.assert_allclose(answers[2], slow.support(C), rtol=1e-12)
    if answers[0] == "nonempty":
        np.testing.assert_allclose(quick.bounding_box(), slow.bounding_box(), rtol=1e-12)


def test_units_of_powers_of_two_change_nothing() -> None:
    A, b = random_box(np.random.default_rng(3), exact=False)
    r, s = np.arange(b.size) * 7 - 20, np.arange(A.shape[1]) * 13 - 20
    P, Q = HPolytope(A, b), HPolytope(np.ldexp(A, r[:, None] + s), np.ldexp(b, r))
    np.testing.assert_array_equal(np.ldexp(Q.bounding_box(), s), P.bounding_box())
    np.testing.assert_array_equal(np.ldexp(Q.emptiness().witness, s), P.emptiness().witness)


def test_no_program_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Rows, "program", property(lambda _: pytest.fail("a program was prepared")))
    box = HPolytope.box([0.0, -1.0], [1.0, np.inf])
    assert box.emptiness().status == "nonempty"
    assert not box.is_bounded()
    assert box.support([1.0, -2.0]) == 3.0
    np.testing.assert_array_equal(box.bounding_box(), [[0.0, -1.0], [1.0, np.inf]])


@pytest.mark.parametrize("P", [HPolytope.box([1.0], [-1.0]), HPolytope.empty(2)])
def test_an_empty_box_is_proved_by_a_certificate(P: HPolytope) -> None:
    certificate = P.emptiness().certificate
    assert certificate is not None
    assert certificate.verify(P)
    assert P.support(np.ones(P.dim)) == -np.inf


@pytest.mark.parametrize("bound", [1e-300, 1e145])
def test_extreme_numbers_are_not_lost(bound: float) -> None:
    P = HPolytope.box([-bound], [bound])
    np.testing.assert_array_equal(P.bounding_box(), [[-bound], [bound]])
    assert P.support([0.75]) >= 0.75 * bound


def test_a_bound_too_far_from_the_origin_is_refused_as_ever() -> None:
    with pytest.raises(ValueError, match="from the origin"):
        HPolytope.box([-1.0], [1e200]).bounding_box()
