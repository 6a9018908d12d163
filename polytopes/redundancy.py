"""Redundancy removal: the rows without which the set would grow."""

import numpy as np
from numpy.typing import NDArray

from polytopes import simplex_kernel as kernel
from polytopes.affine_hull import explicit
from polytopes.exact import rational_matrix
from polytopes.linear_program import OPTIMAL, UNBOUNDED, Program, prepare, warm_up
from polytopes.rows import Rows
from polytopes.support import known_nonempty

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
_TOLERANCE = 1e-12  # relative to the size of b; the kernel's optima are good to some 1e-14
_FAR = 1e6  # a row this many times farther from the inner point than most is no measure of the size of b
_CLARKSON_FROM = 24  # rows; below, one program per row is faster


def minimal_rows(P: Rows) -> tuple[Floats, Floats, Floats, Floats]:
    """Minimal description A, b, C, d of P: independent equalities, and one row per facet.

    Implicit equalities become explicit.  A row is dropped if the others keep ``a_i'x`` below ``b_i + tolerance``, with
    a tolerance of 1e-12 of the largest |b| (rows scaled to about unit norm; not counting rows a million times farther
    from the centre than half of them): the result contains P.  The empty set is
    ``0'x <= -1``.
    """
    n = P.dim
    if not known_nonempty(P):
        return np.zeros((1, n)), np.array([-1.0]), np.empty((0, n)), np.empty(0)
    flat = explicit(P)
    program = flat.program
    rows = facets(program)
    independent = independent_rows(flat.C)
    return flat.A[rows], flat.b[rows], flat.C[independent], flat.d[independent]


def independent_rows(C: Floats) -> list[int]:
    """A largest set of exactly independent rows."""
    if C.shape[0] == 0:
        return []
    reduced, rank = rational_matrix(np.ascontiguousarray(C.T)).rref()
    return [next(j for j in range(C.shape[0]) if reduced[k, j] != 0) for k in range(rank)]


def facets(program: Program, inner: Floats | None = None) -> Indices:
    """Numbers of the rows of A that are facets of a full-dimensional program.

    Parameters
    ----------
    program : Program
    inner : array (free,), optional
        A point strictly inside, in the free coordinates; the centre of a largest ball if absent.
    """
    if program.AT.size == 0:
        return np.empty(0, np.int64)
    start = program.interior.point[program.flat.free] if inner is None else inner
    return program.kept[irredundant(program.AT, program.rhs, start)]


def irredundant(AT: Floats, b: Floats, inner: Floats) -> Indices:
    """Numbers of a minimal set of rows; Clarkson's method, then one program per row if that left doubts.

    Parameters
    ----------
    AT, b : arrays (n, m) and (m,)
        Rows without zero rows, scaled to about unit norm, transposed.
    inner : array (n,)
        A point strictly inside.
    """
    # A row of cancellation scaled to unit norm may lie very far out; it must not set the scale of the others.
    slack = b - inner @ AT
    near = slack <= _FAR * np.partition(slack, slack.size // 2)[slack.size // 2]
    tolerance = _TOLERANCE * (float(np.abs(b[near]).max()) or 1.0)
    chosen = _distinct(AT, b)
    AT, b, start = np.ascontiguousarray(AT[:, chosen]), b[chosen], np.ascontiguousarray(inner)
    warm_up()
    if b.size >= _CLARKSON_FROM:
        keep, doubtful = kernel.irredundant_clarkson(AT, b, start, tolerance)
        kept = np.flatnonzero(keep)
        if not doubtful.any():
            return chosen[kept]
        chosen, AT, b = chosen[kept], np.ascontiguousarray(AT[:, kept]), b[kept]
    keep, doubtful = kernel.irredundant_naive(AT, b, start, tolerance)
    for i in np.flatnonzero(doubtful):
        keep[i] = _needed(AT, b, np.flatnonzero(keep), int(i), tolerance)
    return chosen[np.flatnonzero(keep)]


def _distinct(AT: Floats, b: Floats) -> Indices:
    """Of rows with exactly the same scaled normal, the tightest."""
    order = np.lexsort([b, *AT])
    table = AT[:, order]
    first = np.ones(order.size, dtype=bool)
    first[1:] = (table[:, 1:] != table[:, :-1]).any(axis=0)
    return np.sort(order[first])


def _needed(AT: Floats, b: Floats, kept: Indices, i: int, tolerance: float) -> bool:
    """The same question for one row, by the careful route; a row that stays undecided is kept."""
    others = np.setdiff1d(kept, [i])
    rest = prepare(np.ascontiguousarray(AT[:, others].T), b[others], np.empty((0, AT.shape[0])), np.empty(0))
    best = rest.maximise(np.ascontiguousarray(AT[:, [i]].T))
    if best.status[0] == UNBOUNDED:
        return True
    return best.status[0] != OPTIMAL or bool(best.values[0] > b[i] + tolerance)
