"""Vertices and facets of sets in general position, proven to be all by the compiled core (`core/polytopes/cone.c`).

In general position each vertex of a set lies on n rows, and each facet of a hull on n points.  Sets that are not, or
nearly not, are left to other methods.
"""

import numpy as np

from polytopes import kernel
from polytopes.checks import Floats
from polytopes.kernel import Indices
from polytopes.linear_program import Program

WIDE = 1e-6
"""Radius of a largest ball, relative to the size of b, from which rounding is small beside it."""

_MOST = 100_000  # vertices or facets
_APART = 1e-9  # distance of a vertex from a row, or of a facet from a point, below which it counts as nearly on it


def simple_vertices(program: Program) -> Floats | None:
    """Vertices (k, n) of a set without equalities, in lexicographic order; None if they are not proven to be all.

    The proof is one that the set is bounded too.  Thin sets are left to others.
    """
    if program.flat.pivots or not program.fat or program.interior.radius <= WIDE * program.size:
        return None
    d, m = program.AT.shape
    G = np.zeros((d + 1, m + 1))
    G[:d, :m], G[d, :m], G[d, m] = program.AT, -program.rhs, -1.0
    found = kernel.cone_rays(G, np.append(program.centre, 1.0), True, _MOST)
    if found is None or not _apart(found[2], program.size):
        return None
    points = program.lift(found[0][:, :-1])
    return points[np.lexsort(points.T[::-1])]


def simplicial_facets(points: Floats) -> tuple[Floats, Indices] | None:
    """Facets of the hull of points (k, n) of widths about one: unit normals with minus the offsets, numbers of points.

    Returns
    -------
    rows, simplices : arrays (f, n + 1) and (f, n), or None if they are not proven to be all
    """
    k, n = points.shape
    middle = points.mean(axis=0)
    offsets = points - middle
    G = np.vstack([offsets.T, np.full((1, k), -1.0)])
    found = kernel.cone_rays(G, np.append(np.zeros(n), 1.0), False, _MOST)
    if found is None or not _apart(found[2], 1.0):
        return None
    rays, simplices, _ = found
    rows = rays / np.linalg.norm(rays[:, :-1], axis=1, keepdims=True)
    rows[:, -1] = -rows[:, -1] - rows[:, :-1] @ middle
    return rows, simplices


def _apart(slack: float, size: float) -> bool:
    return slack > _APART * size
