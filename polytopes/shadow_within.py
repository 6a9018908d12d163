"""A projection between two sets: refined by supports until no facet is off by more than a stated distance.

The hull of support points is inside; along the normal of each of its facets the support bounds the projection from
outside, and a new point is taken where the two are farthest apart (Kamenev 1992, Lotov, Bushenkov and Kamenev 2004).
"""

from dataclasses import dataclass

import numpy as np

from polytopes.affine_hull import affine_dim
from polytopes.checks import Floats
from polytopes.errors import UnboundedError
from polytopes.outer_supports import upper_supports
from polytopes.qhull import point_hull
from polytopes.rows import Rows
from polytopes.support import known_nonempty, support_points

_ROUNDS = 10_000


@dataclass(frozen=True, eq=False)
class Bracket:
    """What a projection is between: points (k, d) that span it from inside, and outer rows T (m, d), h (m,).

    `gap` is the largest distance from a facet of the inner set to the support of the projection along its normal.
    """

    points: Floats
    normals: Floats
    offsets: Floats
    gap: float


def bracket(P: Rows, kept: list[int], eps: float) -> Bracket | None:
    """Points and rows of the projection on the coordinates kept; None where it is flat, or has one dimension.

    Raises
    ------
    UnboundedError
        If the projection is unbounded.
    """
    frame = np.eye(P.dim)[kept]
    if len(kept) < 2 or not known_nonempty(P) or affine_dim(P) < P.dim:
        return None
    axes = np.eye(len(kept))
    points = _corners(P, frame, np.vstack([axes, -axes, np.ones((1, len(kept))), -np.ones((1, len(kept)))]))
    while np.linalg.matrix_rank(points - points.mean(axis=0)) < len(kept):
        across = np.linalg.svd(points - points.mean(axis=0))[2][-1]
        points = np.vstack([points, _corners(P, frame, np.vstack([across, -across]))])
    for _ in range(_ROUNDS):
        rows = np.unique(point_hull(points)[0], axis=0)
        normals, inner = rows[:, :-1], -rows[:, -1]
        offsets = upper_supports(P, normals @ frame)
        gaps = offsets - inner
        worst = float(gaps.max())
        far = gaps > max(eps, 0.5 * worst)
        fresh = _corners(P, frame, normals[far]) if far.any() else points[:0]
        known = {point.tobytes() for point in points}
        fresh = np.unique(fresh, axis=0)
        fresh = fresh[[point.tobytes() not in known for point in fresh]]
        if not len(fresh):
            return Bracket(points, normals, offsets, max(worst, 0.0))
        points = np.vstack([points, fresh])
    return Bracket(points, normals, offsets, max(worst, 0.0))


def _corners(P: Rows, frame: Floats, directions: Floats) -> Floats:
    """Support points of the projection."""
    best = support_points(P, directions @ frame)
    if not np.isfinite(best.values).all():
        raise UnboundedError("the projection is unbounded; intersect P with a box first, or use project.")
    return np.asarray(best.points @ frame.T)
