"""The Minkowski sum ``P + Q = {x + y : x in P, y in Q}``, whose support is the sum of the supports."""

import numpy as np

from polytopes.box import box_rows
from polytopes.checks import Floats
from polytopes.errors import ProjectionLimitError
from polytopes.general_position import rows_around
from polytopes.generators import exact_hull, in_integers
from polytopes.hull import normals_around
from polytopes.integers import rounded_difference
from polytopes.minkowski_weyl import total
from polytopes.outer_supports import upper_supports
from polytopes.outward import float_rows
from polytopes.projection import project
from polytopes.rows import Rows, Table, no_equalities, nothing
from polytopes.short_sets import Corners
from polytopes.support import is_bounded, known_nonempty
from polytopes.vertices import quick_vertices, vertices

_MAX_SUMS = 4_000  # sums of vertices up to which integers are affordable
_FEW_SUMS = 300
_CHEAP_ROWS = 1000


def minkowski_sum(P: Rows, Q: Rows) -> Table:
    """Rows A, b, C, d of the sum.

    In integers, the hull of all sums of vertices and of all rays and lines, where both sets are computed with in
    integers or one is unbounded.  Else elimination of y from ``{(z, y) : z - y in P, y in Q}`` tells the normals, as
    long as that is cheap and no set thin, then the sums of vertices do (half the time of the hull of support points
    where both were measured); ``h_P(a) + h_Q(a)`` is rounded up.

    Raises
    ------
    UndecidedError
        If a set is unbounded and the double description of it or of the sum too large.
    """
    known = _of_boxes(P, Q) or _of_exact_corners(P.corners, Q.corners)
    if known is not None:
        return known
    if not (known_nonempty(P) and known_nonempty(Q)):
        return nothing(P.dim)
    first, second = P.exact, Q.exact
    if first is not None and second is not None and len(first.vertices) * len(second.vertices) <= _MAX_SUMS:
        return float_rows(total(first, second))
    if not (is_bounded(P) and is_bounded(Q)):
        return float_rows(total(in_integers(P), in_integers(Q)))
    normals = _normals(P, Q)
    supports = upper_supports(P, normals) + upper_supports(Q, normals)
    return normals, np.nextafter(supports, np.inf), np.empty((0, P.dim)), np.empty(0)


def _of_boxes(P: Rows, Q: Rows) -> Table | None:
    """The sum of two boxes whose corners add up without rounding; None if they are not such."""
    if P.as_box is None or Q.as_box is None or not (P.as_box.exact and Q.as_box.exact):
        return None
    first, second = P.as_box.corners, Q.as_box.corners
    sums = first + second
    rounded = rounded_difference(first, -second, sums).any()
    return None if rounded else (*box_rows(*sums), *no_equalities(P.dim))


def _of_exact_corners(V: Corners | None, W: Corners | None) -> Table | None:
    """The sum of sets whose vertices, and their sums, are floats of few bits; None if they are not such."""
    if not (V and W and V.exact and W.exact and len(V.points) * len(W.points) <= _MAX_SUMS):
        return None
    first, second = V.points[:, None], W.points
    sums = first + second
    if rounded_difference(first, -second, sums).any():
        return None
    return exact_hull(sums.reshape(-1, sums.shape[2]))


def _normals(P: Rows, Q: Rows) -> Floats:
    """Normals of the facets of a bounded sum, and of a subspace that it nearly lies in."""
    n = P.dim
    few = _few_sums(quick_vertices(P), quick_vertices(Q))
    facets = None if few is None else rows_around(few)
    if facets is not None:
        return facets[:, :-1]
    try:
        if P.wide and Q.wide:
            return _normals_by_elimination(P, Q)
    except ProjectionLimitError:
        pass
    sums = vertices(P)[:, None, :] + vertices(Q)
    return normals_around(sums.reshape(-1, n))


def _few_sums(V: Floats | None, W: Floats | None) -> Floats | None:
    """All sums of known vertices, if they are so few that their hull is quicker than elimination."""
    if V is None or W is None or len(V) * len(W) > _FEW_SUMS:
        return None
    return (V[:, None] + W).reshape(-1, V.shape[1])


def _normals_by_elimination(P: Rows, Q: Rows) -> Floats:
    n = P.dim
    lifted = Rows(
        np.vstack([np.hstack([P.A, -P.A]), np.hstack([np.zeros((Q.b.size, n)), Q.A])]),
        np.concatenate([P.b, Q.b]),
    )
    return project(lifted, range(n), "fourier-motzkin", _CHEAP_ROWS, False)[0]
