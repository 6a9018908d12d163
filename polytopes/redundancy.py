"""Redundancy removal: the rows without which the set would grow."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polytopes import kernel
from polytopes.affine_hull import implicit_equalities, independent_rows, made_explicit
from polytopes.checks import Floats
from polytopes.exact import rational, rational_vector
from polytopes.exact_simplex import affordable
from polytopes.frame import unit_body
from polytopes.linear_program import Program
from polytopes.preparation import prepare
from polytopes.rows import Rows, Table, nothing
from polytopes.shown import Shown
from polytopes.support import known_nonempty

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class KeptRows(Shown):
    """Numbers of the rows that describe a set minimally.

    Attributes
    ----------
    inequalities : array of int
        Rows of A, one for each facet.
    equalities : array of int
        Rows of C.
    implicit : array of int
        Rows of A that hold with equality all over the set, and are equalities of the minimal description.
    """

    inequalities: Indices
    equalities: Indices
    implicit: Indices


def minimal_rows(P: Rows) -> Table:
    """Minimal description A, b, C, d of P: independent equalities, and one row per facet.

    Implicit equalities become explicit.  With c the centre of a largest ball, a row is dropped if the others keep it
    below ``a'c + (1 + 1e-12) (b - a'c)``: the result contains P and, whatever the shape and the scales of a bounded P,
    grows by no more than that factor about c (of an unbounded P, rays are told apart to 1e-14).  Rows that rounding
    leaves open are decided in coordinates where P is about a unit ball, then in rationals.  The empty set is
    ``0'x <= -1``.
    """
    at_once = None if P.prepared is None else P.prepared.facets()
    if at_once is not None:
        return P.A[at_once], P.b[at_once], P.C, P.d
    if not known_nonempty(P):
        return nothing(P.dim)
    kept = kept_rows(P)
    rows, fixed, flat = kept.inequalities, kept.equalities, kept.implicit
    if not (fixed.size or flat.size):
        return P.A[rows], P.b[rows], P.C[:0], P.d[:0]
    return P.A[rows], P.b[rows], np.vstack([P.C[fixed], P.A[flat]]), np.append(P.d[fixed], P.b[flat])


def kept_rows(P: Rows) -> KeptRows:
    """Numbers of the rows of a minimal description of a nonempty set.

    Raises
    ------
    EmptySetError
        If P is empty: no choice of its rows is minimal for sure.
    """
    if P.prepared is not None:
        found = P.prepared.facets()
        return KeptRows(facets(P.program) if found is None else found, *np.empty((2, 0), np.int64))
    implicit = np.array(implicit_equalities(P), dtype=np.int64)
    flat = made_explicit(P, implicit.tolist()) if implicit.size else P
    others = np.setdiff1d(np.arange(P.b.size), implicit)
    independent = np.array(independent_rows(flat.C), dtype=np.int64)
    own = independent < P.d.size
    return KeptRows(others[facets(flat.program)], independent[own], implicit[independent[~own] - P.d.size])


def facets(program: Program) -> Indices:
    """Numbers of the rows of A that are facets of a full-dimensional program."""
    if program.AT.size == 0:
        return np.empty(0, np.int64)
    balanced = program.balanced
    return program.kept[irredundant(balanced.AT, balanced.rhs, balanced.centre)]


def irredundant(AT: Floats, b: Floats, inner: Floats) -> Indices:
    """Numbers of a minimal set of rows: by the kernel, and rows that rounding leaves open by the careful route.

    Parameters
    ----------
    AT, b : arrays (n, m) and (m,)
        Rows without zero rows, transposed.
    inner : array (n,)
        A point strictly inside.
    """
    AT, b, inner = np.ascontiguousarray(AT), np.ascontiguousarray(b), np.ascontiguousarray(inner)
    kept, doubtful = kernel.irredundant(AT, b, inner)
    return kept[settle(AT[:, kept].T, b[kept], inner, doubtful)] if doubtful.any() else kept


def settle(A: Floats, b: Floats, inner: Floats, doubtful: Indices) -> Indices:
    """Numbers of a minimal set among rows (m, n) of which some are doubtful.

    In coordinates where the set is about a unit ball rounding is no issue, if there are such coordinates; what is open
    even there is decided by the rational simplex, or kept if that is not affordable.
    """
    kept = np.arange(b.size)
    body = unit_body(A, b, inner)
    if body is not None:
        rows, rhs = np.ascontiguousarray(body.rows.T), np.ascontiguousarray(body.rhs)
        kept, doubtful = kernel.irredundant(rows, rhs, body.inner)
    stays = np.ones(kept.size, dtype=bool)
    for k in np.flatnonzero(doubtful):
        stays[k] = False
        stays[k] = _needed(A[kept[stays]], b[kept[stays]], A[kept[k]], b[kept[k]])
    return kept[stays]


def _needed(A: Floats, b: Floats, row: Floats, rhs: float) -> bool:
    """Whether ``row'x <= rhs`` does not follow from the others, in rationals; True if that would take too long."""
    if not affordable(*A.shape):
        return True
    nothing = np.empty((0, row.size)), np.empty(0)
    start = prepare(np.vstack([A, row]), np.append(b, rhs), *nothing).exact.feasible(np.zeros(row.size))
    if start.status != "reached":
        return True
    best = prepare(A, b, *nothing).exact.maximum(row, start.point)
    if best.status != "optimal":
        return True
    inner = sum((u * v for u, v in zip(rational_vector(row), start.point, strict=True)), rational(0.0))
    return bool(best.value - rational(rhs) > rational(1e-12) * (rational(rhs) - inner))
