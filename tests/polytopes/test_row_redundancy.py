"""Minimal descriptions against the exact oracle, and the traps of near-duplicates."""

import numpy as np
import ppl
import pytest
from random_programs import many

from polytopes import HPolytope
from polytopes import simplex_kernel as kernel
from polytopes.redundancy import irredundant


def exact_size(P: HPolytope) -> tuple[int, int]:
    """Numbers of inequalities and equalities of the minimal description, from the Parma library (integer rows)."""
    system = ppl.Constraint_System()
    x = [ppl.Variable(j) for j in range(P.dim)]
    system.insert(0 * x[-1] <= 0)
    for row, value in zip(P.A, P.b, strict=True):
        system.insert(sum((int(c) * v for c, v in zip(row, x, strict=True)), 0 * x[0]) <= int(value))
    minimal = ppl.C_Polyhedron(system).minimized_constraints()
    equalities = sum(1 for c in minimal if c.is_equality())
    return len(minimal) - equalities, equalities


def test_integer_systems_have_as_many_rows_as_the_exact_oracle_says() -> None:
    for k, (_, A, b) in enumerate(many("integer", 400)):
        P = HPolytope(A, b)
        Q = P.remove_redundancy()
        expected = (1, 0) if P.emptiness().status == "empty" else exact_size(P)
        assert (Q.b.size, Q.d.size) == expected, k
        assert Q.equals(P, tol=1e-11)


@pytest.mark.parametrize("kind", ["general", "degenerate", "thin", "duplicated", "unbounded"])
def test_clarkson_agrees_with_one_program_per_row(kind: str) -> None:
    for _, A, b in many(kind, 100):
        P = HPolytope(A, b)
        if P.emptiness().status == "empty":
            continue
        program = P.program
        tolerance = 1e-12 * program.size
        start = np.ascontiguousarray(program.interior.point)
        naive, doubtful = kernel.irredundant_naive(program.AT, program.rhs, start, tolerance)
        assert not doubtful.any()
        kept = irredundant(program)
        assert kept.size == np.count_nonzero(naive)
        minimal = HPolytope(P.A[program.kept[kept]], P.b[program.kept[kept]])
        assert minimal.equals(P, tol=1e-10 * program.size)


def test_rows_that_differ_by_1e_8_are_both_kept_when_both_count() -> None:
    P = HPolytope([[1.0, 0.0], [1.0, 1e-8], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], [1.0, 1.0, 1.0, 1.0, 1.0])
    assert P.remove_redundancy().b.size == 5


def test_tightest_of_parallel_rows_is_kept() -> None:
    P = HPolytope([[1.0], [2.0], [4.0], [-1.0]], [1.0, 1.0, 8.0, 0.0])
    np.testing.assert_array_equal(P.remove_redundancy().bounding_box()[1], [0.5])
