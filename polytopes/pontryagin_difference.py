"""The Pontryagin difference ``P - Q = {x : x + y in P for all y in Q}``: each row moves inward by the support of Q."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from polytopes.checks import Floats
from polytopes.errors import UndecidedError
from polytopes.exact_sides import with_sides
from polytopes.linear_program import Program
from polytopes.native import Address, Entries, Given, InCore, Integer, function
from polytopes.outer_supports import exact_supports, lower_supports
from polytopes.rows import Rows, Table, everything, nothing
from polytopes.support import maxima
from polytopes.vertices import known_vertices

_CONSTANT = 1e-12  # of the terms of a linear form: variation that counts as none, unless all numbers are short
_ROUNDED = 1e-9  # radius of a largest ball, relative to the size of b, from which rounding makes no difference

_moved_rows = function("fdi_moved_rows", *[Integer] * 2, *[Address] * 2, Integer, Given, Entries, returns=Integer)


def pontryagin_difference(P: Rows, Q: Rows) -> Table:
    """Rows A, b, C, d of the difference: ``b - h_Q(a)`` for each row, the whole space if Q is empty.

    An equality ``c'x = d`` of P survives only if ``c'y`` is constant over Q; else nothing is left.  The supports are
    exact, where the numbers are short and where rounding could empty what is flat; what remains is rounded up.

    Raises
    ------
    UndecidedError
        If Q is flat or thin, or the result nearly flat, and Q too large for rational arithmetic.
    """
    known = _by_known_vertices(P, Q) or _by_floats(P, Q)
    if known is not None:
        return known
    result = maxima(Q, np.vstack([P.A, P.C, -P.C]))
    if result is None:
        return everything(P.dim)
    if not np.isfinite(result.values).all() or (P.C.any() and Q.wide):
        return nothing(P.dim)
    short = P.short and Q.short
    near = None
    if not short and Q.wide:
        with np.errstate(over="ignore"):  # the least float is above what is below all
            near = P.A, np.nextafter(P.b - lower_supports(Q, P.A), np.inf), P.C, P.d
        if _clear(Rows(*near).program, P.b):
            return near
    exact = exact_supports(Q, np.vstack([P.A, P.C, -P.C]))
    if exact is not None:
        size = np.abs(P.C) @ np.abs(result.points).max(axis=0, initial=0.0)
        return _moved_exactly(P, exact, 0.0 * size if short else _CONSTANT * size)
    if near is None:
        raise UndecidedError("Q is flat or thin, and too large for its supports along the rows of P in rationals.")
    return near


def _by_known_vertices(P: Rows, Q: Rows) -> Table | None:
    """The rows moved inward, rounded up, where the vertices of Q are floats and P has no equalities; else None."""
    V = None if P.d.size else _vertices_that_count(P, Q)
    sides = None if V is None else moved_sides(P.in_core, V)
    return None if sides is None else (P.A, sides, P.C, P.d)


def _vertices_that_count(P: Rows, Q: Rows) -> Floats | None:
    """The vertices (k, n) of Q that are known; of a box, if these are more than the rows of P, one that each needs."""
    box = Q.as_box
    if box is None or 2.0**Q.dim <= P.b.size or not box.bounded or box.rounded.any():
        return known_vertices(Q)
    lower, upper = box.corners
    return np.where(P.A > 0.0, upper, lower)


def moved_sides(rows: InCore, V: Floats) -> Floats | None:
    """Sides (m,) of rows moved inward by points V (k, n), exact or rounded up; None if sizes are too different."""
    sides = np.empty(rows[1])
    return sides if _moved_rows(*rows, len(V), V, sides) else None


def _by_floats(P: Rows, Q: Rows) -> Table | None:
    """The rows moved inward by lower bounds of the supports, where floats settle them and rounding changes nothing."""
    if P.d.size or Q.prepared is None or (P.short and Q.short):
        return None
    supports = Q.prepared.lower_supports(P.A)
    if supports is None or not np.isfinite(supports).all():
        return None
    with np.errstate(over="ignore"):  # the least float is above what is below all
        sides = np.nextafter(P.b - supports, np.inf)
    left = Rows(P.A, sides).prepared
    if left is None or left.radius <= _ROUNDED * np.abs(np.ldexp(P.b, left.row_powers)).max():
        return None
    return P.A, sides, P.C, P.d


def _clear(program: Program, b: Floats) -> bool:
    """Whether rounding of right-hand sides that were differences of numbers b (m,) changes nothing of the set."""
    nearest = abs(program.interior.radius) if program.consistent else 0.0
    sizes = np.abs(b[program.kept]) * program.scale
    return nearest > _ROUNDED * max(program.size, float(sizes.max(initial=0.0)))


def _moved_exactly(P: Rows, supports: Sequence[Fraction], constant: Floats) -> Table:
    """The rows of P moved inward by supports along ``[A, C, -C]``, rounded up; an equality so becomes two rows.

    A linear form of an equality may vary over Q by `constant`.
    """
    k, q = P.b.size, P.d.size
    if any(supports[k + i] + supports[k + q + i] > constant[i] for i in range(q)):
        return nothing(P.dim)
    middles = [(supports[k + i] - supports[k + q + i]) / 2 for i in range(q)]
    sides = [Fraction(b) - h for b, h in zip(P.b.tolist(), supports[:k], strict=True)]
    return with_sides(P.A, sides, P.C, [Fraction(d) - middle for d, middle in zip(P.d.tolist(), middles, strict=True)])
