"""A set ``{x : T x <= h}`` inside a polytope that no larger one of the same normals inside contains.

From the largest copy of ``{T x <= |T|}`` (one linear program) each face moves out as far as supports along the rows of
the polytope allow, one after the other, by bisection.  Of a flat set all this is within its affine hull.
"""

import numpy as np

from polytopes.affine_hull import explicit
from polytopes.checks import Floats
from polytopes.errors import UndecidedError
from polytopes.inclusion import broken_row
from polytopes.largest_copy import largest_copy
from polytopes.lengths import lengths
from polytopes.rows import Rows, Table
from polytopes.support import is_bounded, maxima, support

_HALVINGS = 45
_ROUNDING = 1e-13  # of the terms of a row: what a support may exceed it while faces move
_ACROSS = 1e-12  # of its length: what a direction may have along a flat set
_SHRINK = 2.0**-42  # towards the centre, until inclusion is proved
_STEPS = 10


def inner_template(P: Rows, T: Floats) -> Table:
    """Rows T and h, and the equalities of P, of a set in a bounded set P of dimension 1 or more; proved to lie in it.

    Raises
    ------
    ValueError
        If the directions leave sets unbounded.
    UndecidedError
        If inclusion could not be proved.
    """
    body = explicit(P)
    sizes, most = lengths(_along(body, T)), np.atleast_1d(support(body, T))
    across = sizes <= _ACROSS * lengths(T)
    shape = Rows(T, np.where(across, 0.0, sizes), body.C, 0.0 * body.d)
    if not is_bounded(shape):
        raise ValueError("directions leave sets unbounded; expected rows that hold one: box_directions(n) and others.")
    centre, scale = largest_copy(body, shape)
    middle = np.where(across, most, T @ centre)
    sides = middle + scale * shape.b
    for j in range(len(T)):
        sides[j] = _moved_out(body, T, sides, j, max(float(most[j]), float(sides[j])))
    shrink = 0.0
    for k in range(_STEPS):
        found = Rows(T, middle + (1.0 - shrink) * (sides - middle), body.C, body.d)
        if broken_row(P, found) is None:
            return found.table
        shrink = _SHRINK * 16.0**k
    raise UndecidedError("no set with these normals was proved to lie inside: the set is too thin for floats.")


def _along(P: Rows, T: Floats) -> Floats:
    """Directions (k, n) without their parts across the affine hull of a set with explicit equalities."""
    return np.asarray(T - T @ np.linalg.pinv(P.C) @ P.C) if P.d.size else T


def _moved_out(P: Rows, T: Floats, sides: Floats, j: int, most: float) -> float:
    """The largest side j, at most `most`, with which the set keeps the rows of P to rounding."""
    inside, outside = float(sides[j]), most
    if _keeps(P, T, np.where(np.arange(len(sides)) == j, outside, sides)):
        return outside
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        if _keeps(P, T, np.where(np.arange(len(sides)) == j, middle, sides)):
            inside = middle
        else:
            outside = middle
    return inside


def _keeps(P: Rows, T: Floats, sides: Floats) -> bool:
    best = maxima(Rows(T, sides, P.C, P.d), P.A)
    if best is None:
        return True
    terms = np.abs(best.points) @ np.abs(P.A.T)
    return bool((best.values <= P.b + _ROUNDING * (np.diag(terms) + np.abs(P.b))).all())
