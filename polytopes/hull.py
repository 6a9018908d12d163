"""Convex hulls: of points, and of a set known only by its support points."""

import numpy as np
from numpy.typing import NDArray

from polytopes.frame import Oracle, principal_axes, unit_frame
from polytopes.redundancy import facets
from polytopes.rows import Rows

Floats = NDArray[np.float64]
_FLAT = 1e-12  # relative width below which points are taken to lie in a subspace
_REACHED = 1e-11  # a facet is final if no point of the set lies this far beyond it (widths are about one)


def rows_of_points(V: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Rows A, b, C, d of the convex hull of points (k, n), k >= 1.

    Points within 1e-12 of their spread of a subspace give explicit equalities.  Every right-hand side is the maximum
    over the points, so that each point satisfies its rows to rounding.
    """
    n = V.shape[1]
    centre = V.mean(axis=0)
    offsets = V - centre
    sizes, axes = principal_axes(V)
    rank = int(np.count_nonzero(sizes > _FLAT * sizes[0]))
    C = axes[rank:]
    d = C @ centre
    if rank == 0:
        return np.empty((0, n)), np.empty(0), np.eye(n), V[0].copy()
    normals = _facets(offsets @ axes[:rank].T / sizes[:rank])[:, :-1] / sizes[:rank] @ axes[:rank]
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    hull = Rows(normals, (V @ normals.T).max(axis=0), C, d)
    kept = facets(hull.program, centre)
    return hull.A[kept], hull.b[kept], C, d


def _facets(points: Floats) -> Floats:
    """Distinct facets of the hull of full-dimensional points: outward unit normals and minus the offsets."""
    from scipy.spatial import ConvexHull

    if points.shape[1] == 1:
        return np.array([[1.0, -points.max()], [-1.0, points.min()]])
    return np.unique(ConvexHull(points).equations, axis=0)


def hull_by_supports(oracle: Oracle, inner: Floats) -> tuple[Floats, Floats]:
    """Minimal rows of a bounded, full-dimensional set from its support points.

    The hull of a few support points is refined: a support point along the normal of every facet either confirms the
    facet or lies beyond it and is added.  Every row returned is a supporting half-space of the set, so the result
    contains it.

    Parameters
    ----------
    oracle : callable
        Directions (k, n) to a maximiser for each, (k, n).
    inner : array (n,)
        A point strictly inside.

    Returns
    -------
    A, b : arrays (m, n) and (m,)
    """
    n = inner.size
    if n == 1:
        ends = oracle(np.array([[1.0], [-1.0]]))[:, 0]
        return np.array([[1.0], [-1.0]]), ends * [1.0, -1.0]
    frame = unit_frame(oracle, inner)
    axes = np.linalg.inv(frame)

    def scaled_oracle(directions: Floats) -> Floats:
        points: Floats = (oracle(directions @ axes) - inner) @ axes.T
        return points

    normals = _refined_normals(scaled_oracle, n) @ axes
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    hull = Rows(normals, (normals * oracle(normals)).sum(axis=1))
    kept = facets(hull.program, inner)
    return hull.A[kept], hull.b[kept]


def _refined_normals(oracle: Oracle, n: int) -> Floats:
    """Normals of the facets of a set of widths about one.

    Each round starts Qhull afresh: its incremental mode ends the whole process on a topology error.
    """
    points = _spanning_points(oracle, n)
    final: set[bytes] = set()
    while True:
        found = _facets(points)
        fresh = found[[facet.tobytes() not in final for facet in found]]
        corners = oracle(fresh[:, :-1])
        beyond = (corners * fresh[:, :-1]).sum(axis=1) + fresh[:, -1] > _REACHED
        if not beyond.any():
            return found[:, :-1]
        final.update(facet.tobytes() for facet in fresh[~beyond])
        points = np.vstack([points, np.unique(corners[beyond], axis=0)])


def _spanning_points(oracle: Oracle, n: int) -> Floats:
    """Support points that do not lie near a hyperplane."""
    points = oracle(np.vstack([np.eye(n), -np.eye(n)]))
    for _ in range(n):
        spread, principal = principal_axes(points)
        if spread[-1] > _REACHED**0.5:
            break
        points = np.vstack([points, oracle(np.vstack([principal[-1], -principal[-1]]))])
    return points
