"""A box inside a set."""

import numpy as np

from polytopes.checks import Floats
from polytopes.errors import UnboundedError
from polytopes.rows import Rows
from polytopes.support import bounding_box, maxima


def inner_box(P: Rows) -> tuple[Floats, Floats]:
    """Lower (n,) and upper (n,) of a box inside a bounded set that no larger box inside contains.

    The box ``c +- r w`` with the half-widths w of the bounding box lies in P if ``A c + |A| w r <= b`` (Bemporad,
    Filippi and Torrisi 2004); r is maximised over (c, r), then the faces move out one after the other.

    Raises
    ------
    EmptySetError
        If P is empty.
    UnboundedError
        If P is unbounded.
    """
    lower, upper = bounding_box(P)
    if not np.isfinite(upper - lower).all():
        raise UnboundedError("P is unbounded, so no box inside is largest; intersect it with a box first.")
    n, widths = P.dim, (upper - lower) / 2.0
    if not widths.any():
        return lower, upper
    tilt = np.abs(P.C).sum(axis=0) @ widths  # an equality along a wide coordinate leaves r = 0
    equalities = np.vstack([np.hstack([P.C, np.zeros((P.d.size, 1))]), np.append(np.zeros(n), tilt)])
    lifted = Rows(np.hstack([P.A, (np.abs(P.A) @ widths)[:, None]]), P.b, equalities, np.append(P.d, 0.0))
    best = maxima(lifted, np.append(np.zeros(n), 1.0)[None])
    assert best is not None  # r = 0 at any point of P
    centre, scale = best.points[0, :n], max(0.0, float(best.values[0]))
    return _spread(P, centre - scale * widths, centre + scale * widths)


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
