"""Minimal descriptions against the exact oracle, and the traps of near-duplicates."""

from fractions import Fraction

import numpy as np
import pytest
from exact_sets import minimal_size, polyhedron
from random_programs import many

from polytopes import HPolytope
from polytopes.linear_program import Program
from polytopes.native import Entries, Given, Integer, function
from polytopes.redundancy import irredundant


def test_integer_systems_have_as_many_rows_as_the_exact_oracle_says() -> None:
    for k, (_, A, b) in enumerate(many("integer", 400)):
        P = HPolytope(A, b)
        Q = P.remove_redundancy()
        expected = (1, 0) if P.emptiness().status == "empty" else minimal_size(polyhedron(P))
        assert (Q.b.size, Q.d.size) == expected, k
        assert Q.equals(P, tol=1e-11)


def test_thin_sets_have_as_many_rows_as_the_exact_oracle_says() -> None:
    for k, (_, A, b) in enumerate(many("thin", 40)):
        if A.shape[1] <= 4:
            assert HPolytope(A, b).remove_redundancy().b.size == minimal_size(polyhedron(HPolytope(A, b)))[0], k


@pytest.mark.parametrize("kind", ["general", "degenerate", "duplicated", "unbounded"])
def test_clarkson_agrees_with_one_program_per_row(kind: str) -> None:
    for _, A, b in many(kind, 100):
        P = HPolytope(A, b)
        if P.emptiness().status == "empty":
            continue
        program = P.program
        kept = irredundant(program.AT, program.rhs, program.centre)
        needed = [i for i in range(program.rhs.size) if exceeds_the_others(program, kept, i)]
        assert kept.tolist() == needed
        minimal = HPolytope(P.A[program.kept[kept]], P.b[program.kept[kept]])
        assert minimal.equals(P, tol=1e-10 * program.size)


def exceeds_the_others(program: Program, kept: np.ndarray, i: int) -> bool:
    """One program: does the set of the other rows that were kept reach beyond row i?"""
    others = HPolytope(program.AT.T[kept[kept != i]], program.rhs[kept[kept != i]])
    room = 1e-11 * (program.rhs[i] - program.centre @ program.AT[:, i])
    return bool(i in kept and others.support(program.AT[:, i]) > program.rhs[i] - room)


def test_rows_that_differ_by_1e_8_are_both_kept_when_both_count() -> None:
    P = HPolytope([[1.0, 0.0], [1.0, 1e-8], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], [1.0, 1.0, 1.0, 1.0, 1.0])
    assert P.remove_redundancy().b.size == 5


def test_tightest_of_parallel_rows_is_kept() -> None:
    P = HPolytope([[1.0], [2.0], [4.0], [-1.0]], [1.0, 1.0, 8.0, 0.0])
    np.testing.assert_array_equal(P.remove_redundancy().bounding_box()[1], [0.5])


def test_a_row_of_cancellation_does_not_set_the_tolerance() -> None:
    """One elimination step of nearly opposite rows leaves 1e-13 x <= 1, at 1e13 once scaled: 1e-12 of that is 10."""
    angles = np.arange(8) * np.pi / 4.0
    octagon = np.vstack([np.cos(angles), np.sin(angles)])
    AT = np.ascontiguousarray(np.hstack([octagon, [[0.6], [0.8]]]))
    kept = irredundant(AT, np.append(np.ones(8), 1e13), np.array([0.1, 0.2]))
    np.testing.assert_array_equal(kept, np.arange(8))


def test_a_far_row_does_not_loosen_the_others() -> None:
    cut = HPolytope.box([-1.0, -1.0], [1.0, 1.0]).intersection(HPolytope([[1.0, 1.0], [1.0, 0.0]], [2.0 - 1e-6, 1e9]))
    assert cut.remove_redundancy().b.size == 5


@pytest.mark.parametrize(("cut", "rows"), [(1e-10, 5), (5e-12, 5), (1e-13, 4), (0.0, 4)])
def test_a_row_goes_if_the_set_grows_by_less_than_the_tolerance(cut: float, rows: int) -> None:
    """1e-12 of the row's slack at the centre, which is 2 here."""
    square = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
    assert square.intersection(HPolytope([[1.0, 1.0]], [2.0 - 2.0 * cut])).remove_redundancy().b.size == rows


def test_slacks_at_the_centre_have_twice_the_precision() -> None:
    """Built with reordering allowed, the sum that holds what was rounded off is optimised away."""
    centred = function("fdi_centred", *[Integer] * 2, *[Given] * 3, *[Entries] * 3, returns=Integer)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        A, x = rng.standard_normal((6, 3)), rng.standard_normal(3)
        b = A @ x + 1e-15 * rng.random(6)
        rhs = np.empty(6)
        inside = centred(3, 6, np.ascontiguousarray(A.T), b, x, np.empty((3, 6)), rhs, np.empty(100))
        exact = [Fraction(v) - sum(Fraction(p) * Fraction(q) for p, q in zip(row, x.tolist(), strict=True))
                 for row, v in zip(A.tolist(), b.tolist(), strict=True)]  # fmt: skip
        assert inside == all(v > 0 for v in exact)
        if inside:
            np.testing.assert_allclose(rhs, [np.frexp(float(v))[0] for v in exact], rtol=1e-14)
