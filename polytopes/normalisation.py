"""Rows of unit length: right-hand sides that are distances from the origin."""

import numpy as np

from polytopes.checks import Floats
from polytopes.integers import lowest_bit
from polytopes.outer_supports import reach
from polytopes.rows import Rows, Table, nothing
from polytopes.support import is_bounded, known_nonempty

_EPS = float(np.finfo(np.float64).eps)


def normalised(P: Rows) -> Table:
    """Rows of P over their Euclidean lengths; rows of zeros that hold are left out.

    A quotient that is no float is rounded, and then so is the direction of the row.  Of a bounded set each rounded row
    moves out by what that is worth over the set, so that the result contains it; of an unbounded one rows are right to
    rounding (a few 1e-16 of their distance) and no more.  The empty set is ``0'x <= -1``.
    """
    if not known_nonempty(P):
        return nothing(P.dim)
    A, b, C, d = P.A[P.A.any(axis=1)], P.b[P.A.any(axis=1)], P.C[P.C.any(axis=1)], P.d[P.C.any(axis=1)]
    rows, fixed, kept = _of_unit_length(A, b), _of_unit_length(C, d), len(b)
    rounded, broken = _rounded(A, b, rows), _rounded(C, d, fixed)
    most = reach(P) if (rounded.any() or broken.any()) and is_bounded(P) else None
    if most is None:
        return rows[:, :-1], rows[:, -1], fixed[:, :-1], fixed[:, -1]
    pairs = np.vstack([rows, fixed[broken], -fixed[broken]])
    moved = np.append(rounded, np.ones(len(pairs) - kept, dtype=bool))
    room = (P.dim + 8) * _EPS * (np.abs(pairs[:, :-1]) @ most + np.abs(pairs[:, -1]))
    return pairs[:, :-1], pairs[:, -1] + moved * room, fixed[~broken, :-1], fixed[~broken, -1]


def _of_unit_length(A: Floats, b: Floats) -> Floats:
    """``[A, b]`` over the lengths of the rows, which are taken in units in which their squares are floats."""
    top = np.frexp(np.abs(A).max(axis=1, initial=0.0))[1][:, None]
    even = np.ldexp(np.hstack([A, b[:, None]]), -top)
    lengths = np.linalg.norm(even[:, :-1], axis=1)[:, None]
    return np.asarray(even / lengths)


def _rounded(A: Floats, b: Floats, unit: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether a row is not the given one times a power of two."""
    given = np.hstack([A, b[:, None]])
    ratio = np.frexp(given)[0] == np.frexp(unit)[0]
    shift = np.where(given != 0.0, lowest_bit(given) - lowest_bit(unit), 0)
    first = np.array([row[np.flatnonzero(values)[0]] for row, values in zip(shift, given, strict=True)], dtype=np.int64)
    return ~(ratio & ((shift == first[:, None]) | (given == 0.0))).all(axis=1)
