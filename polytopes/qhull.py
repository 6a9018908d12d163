"""SciPy's Qhull for points and half-spaces of about unit size, and what to do when it gives up.

Qhull ends with an error where rounding leaves its first simplex flat or its facets inconsistent.  Turned points have
other rounding errors; if no turn helps, the question is undecided.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.errors import UndecidedError

_TURNS = 4


def point_hull(points: Floats) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Hull of points (k, n), n >= 2: normals with offsets (f, n + 1), simplices (f, n), numbers of the vertices."""
    from scipy.spatial import ConvexHull, QhullError

    for turn in _turns(points.shape[1]):
        try:
            hull = ConvexHull(points @ turn.T)
        except (QhullError, ValueError):
            continue
        equations = np.hstack([hull.equations[:, :-1] @ turn, hull.equations[:, -1:]])
        return equations, hull.simplices, hull.vertices
    raise UndecidedError(_given_up(f"the hull of {len(points)} points"))


def dual_hull(rows: Floats, rhs: Floats, inner: Floats) -> tuple[list[list[int]], Floats]:
    """Vertices of ``{rows x <= rhs}`` around the point `inner`: the numbers of the rows through each, and its place."""
    from scipy.spatial import HalfspaceIntersection, QhullError

    for turn in _turns(inner.size):
        try:
            hull: Any = HalfspaceIntersection(np.hstack([rows @ turn.T, -rhs[:, None]]), turn @ inner)
        except (QhullError, ValueError):
            continue
        if np.isfinite(hull.intersections).all():
            return hull.dual_facets, hull.intersections @ turn
    raise UndecidedError(_given_up(f"the vertices of {len(rhs)} rows"))


def points_volume(points: Floats) -> float:
    """Volume of the hull of points (k, n), n >= 2."""
    from scipy.spatial import ConvexHull, QhullError

    for turn in _turns(points.shape[1]):
        try:
            return float(ConvexHull(points @ turn.T).volume)
        except (QhullError, ValueError):
            continue
    raise UndecidedError(_given_up(f"the volume of {len(points)} points"))


def _turns(n: int) -> Any:
    """The identity, then a few orthogonal matrices, the same every time."""
    yield np.eye(n)
    rng = np.random.default_rng(0)
    for _ in range(_TURNS):
        yield np.linalg.qr(rng.standard_normal((n, n)))[0]


def _given_up(task: str) -> str:
    return f"Qhull gave up on {task} in {_TURNS + 1} coordinate systems: rounding hides which faces meet where."
