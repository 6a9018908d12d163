"""A box inside a set."""

import numpy as np

from polytopes.affine_hull import explicit
from polytopes.checks import Floats
from polytopes.errors import UnboundedError, UndecidedError
from polytopes.exact_sides import exact_form
from polytopes.lengths import evened
from polytopes.rows import Rows
from polytopes.support import bounding_box, maxima

_SHRINK = 2.0**-50  # of the widths: the first step towards the middle where a row is broken
_STEPS = 8


def inner_box(P: Rows, by_volume: bool = False) -> tuple[Floats, Floats]:
    """Lower (n,) and upper (n,) of a box inside a bounded set that no larger box inside contains.

    A box lies in P if ``max(A, 0) upper + min(A, 0) lower <= b`` (Bemporad, Filippi and Torrisi 2004).  Either it is
    the largest ``c +- r w`` with the half-widths w of the bounding box, by a linear program, or the one of largest
    volume, by a convex one; then the faces move out one after the other.

    Raises
    ------
    EmptySetError
        If P is empty.
    UnboundedError
        If P is unbounded.
    UndecidedError
        If the convex program did not end.
    """
    lower, upper = bounding_box(P)
    if not np.isfinite(upper - lower).all():
        raise UnboundedError("P is unbounded, so no box inside is largest; intersect it with a box first.")
    if not (upper > lower).any():
        return lower, upper
    widths = _widths_of_largest_volume(P, lower, upper) if by_volume else (upper - lower) / 2.0
    return _pulled_in(P, *_spread(P, *_of_same_shape(P, widths)))


def _of_same_shape(P: Rows, widths: Floats) -> tuple[Floats, Floats]:
    """The largest box in P with half-widths proportional to some."""
    n = P.dim
    tilt = np.abs(P.C).sum(axis=0) @ widths  # an equality along a wide coordinate leaves r = 0
    equalities = np.vstack([np.hstack([P.C, np.zeros((P.d.size, 1))]), np.append(np.zeros(n), tilt)])
    lifted = Rows(np.hstack([P.A, (np.abs(P.A) @ widths)[:, None]]), P.b, equalities, np.append(P.d, 0.0))
    best = maxima(lifted, np.append(np.zeros(n), 1.0)[None])
    assert best is not None  # r = 0 at any point of P
    centre, scale = best.points[0, :n], max(0.0, float(best.values[0]))
    return centre - scale * widths, centre + scale * widths


def _widths_of_largest_volume(P: Rows, lower: Floats, upper: Floats) -> Floats:
    """Half-widths of the box in P whose product of widths is largest, over the coordinates that are free one by one."""
    import cvxpy as cp

    flat = explicit(P)
    free = ~flat.C.any(axis=0)
    if not free.any():
        return (upper - lower) / 2.0
    size = np.ldexp(1.0, np.frexp(np.where(upper > lower, upper - lower, 1.0))[1])
    A, sides = evened(flat.A * size, flat.b - flat.A @ lower)
    start, widths = cp.Variable(P.dim), cp.Variable(P.dim, nonneg=True)
    held = [A @ start + np.maximum(A, 0.0) @ widths <= sides]
    fixed = [widths[~free] == 0.0, (flat.C * size) @ start == flat.d - flat.C @ lower]
    problem = cp.Problem(cp.Maximize(cp.sum(cp.log(widths[free]))), held + (fixed if flat.d.size else []))
    problem.solve(solver=cp.CLARABEL)
    if problem.status not in ("optimal", "optimal_inaccurate") or widths.value is None:
        raise UndecidedError(f"no largest box was found: the solver ended as {problem.status!r}.")
    return np.asarray(0.5 * size * np.where(free, np.maximum(widths.value, 0.0), 0.0))


def _pulled_in(P: Rows, lower: Floats, upper: Floats) -> tuple[Floats, Floats]:
    """The box drawn towards its middle until no row is broken; as it is if that does not help."""
    middle = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
    part = 0.0
    for k in range(_STEPS):
        low, high = lower + part * (middle - lower), upper - part * (upper - middle)
        if all(exact_form(row, np.where(row > 0.0, high, low)) <= b for row, b in zip(P.A, P.b.tolist(), strict=True)):
            return low, high
        part = _SHRINK * 8.0**k
    return lower, upper


def _spread(P: Rows, lower: Floats, upper: Floats) -> tuple[Floats, Floats]:
    """The box with every face moved out as far as the rows allow, one coordinate after the other."""
    room = P.b - np.maximum(P.A, 0.0) @ upper - np.minimum(P.A, 0.0) @ lower
    for j in np.flatnonzero(~P.C.any(axis=0)):
        for rates, face, sign in ((P.A[:, j], upper, 1.0), (-P.A[:, j], lower, -1.0)):
            limits = rates > 0.0
            step = max(0.0, float((room[limits] / rates[limits]).min()))
            face[j] += sign * step
            room[limits] -= step * rates[limits]
    return lower, upper
