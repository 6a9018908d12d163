"""Implicit equalities: rows that hold with equality at every point, hence the affine hull and its dimension."""

import numpy as np

from polytopes.checks import Floats
from polytopes.emptiness import combined_value, float_combination, strictly_inside
from polytopes.errors import EmptySetError, UndecidedError
from polytopes.exact import rational_matrix
from polytopes.rows import Rows, Table, nothing
from polytopes.support import known_nonempty


def implicit_equalities(P: Rows) -> list[int]:
    """Numbers of the rows of A that hold with equality all over P (a set of rows that spans the affine hull).

    Exact: a set of width 1e-12 is not flat.  If no point satisfies all rows strictly, the multipliers that prove it sit
    on rows that are equalities; these are made explicit, and the search goes on in the smaller space.

    Raises
    ------
    EmptySetError
        If P is empty.
    UndecidedError
        If P is thin and too large for rational arithmetic.
    """
    if not known_nonempty(P):
        raise EmptySetError("the empty set has no affine hull; ask emptiness() first.")
    found: list[int] = []
    rest = P
    while rest.program.kept.size and rest.program.thin:
        fresh = _equalities_of_a_proof(rest)
        if not fresh:
            return found
        numbers = [i for i in range(P.b.size) if i not in found]
        found = sorted(found + [numbers[i] for i in fresh])
        rest = made_explicit(P, found)
    return found


def _equalities_of_a_proof(P: Rows) -> list[int]:
    """Rows that carry a proof that P has no strict point; empty if it has one."""
    program = P.program
    if strictly_inside(program, program.centre):
        return []
    combination = float_combination(P, program)
    if combination is not None and combined_value(P, combination) == 0:
        return sorted(combination.inequality)
    if not program.exact.affordable:
        raise UndecidedError(f"cannot tell whether a thin set of {P.A.shape[0]} rows is flat: too large to do exactly.")
    outcome = program.exact.only(program.kept).feasible(program.interior.point, strictly=True)
    if outcome.status == "limit":
        raise UndecidedError("cannot tell whether a thin set is flat: the rational simplex reached its pivot limit.")
    return [] if outcome.status == "reached" else [int(program.kept[i]) for i in outcome.multipliers]


def made_explicit(P: Rows, rows: list[int]) -> Rows:
    """P with some rows of A as equalities, the last ones of C."""
    others = np.setdiff1d(np.arange(P.b.size), rows)
    return Rows(P.A[others], P.b[others], np.vstack([P.C, P.A[rows]]), np.concatenate([P.d, P.b[rows]]))


def explicit(P: Rows) -> Rows:
    """The same set with its implicit equalities made explicit; P itself if there are none."""
    rows = implicit_equalities(P)
    return made_explicit(P, rows) if rows else P


def hull_of(P: Rows) -> Table:
    """Rows of the affine hull: independent equalities of P, explicit and implicit ones; empty if P is."""
    if not known_nonempty(P):
        return nothing(P.dim)
    flat = explicit(P)
    chosen = independent_rows(flat.C)
    return np.empty((0, P.dim)), np.empty(0), flat.C[chosen], flat.d[chosen]


def independent_rows(C: Floats) -> list[int]:
    """A largest set of exactly independent rows."""
    if C.shape[0] == 0:
        return []
    reduced, rank = rational_matrix(np.ascontiguousarray(C.T)).rref()
    return [next(j for j in range(C.shape[0]) if reduced[k, j] != 0) for k in range(rank)]


def affine_dim(P: Rows) -> int:
    """Dimension of the affine hull of P; -1 if P is empty."""
    return len(explicit(P).program.flat.free) if known_nonempty(P) else -1
