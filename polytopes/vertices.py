"""Vertices of bounded sets: in integers where the rows are short or the set is flat or thin (see `exact_generators`).

Sets in general position are gone through from vertex to vertex (see `general_position`).  For what is left Qhull does
the combinatorics (the hull of the dual points), on coordinates centred in the set and scaled to about unit size along
its own axes; flat sets are handled in their subspace.  Points are never rounded on the way.
"""

import numpy as np

from polytopes.affine_hull import explicit
from polytopes.checks import Floats
from polytopes.errors import UnboundedError, UndecidedError
from polytopes.frame import UnitBody, unit_body
from polytopes.integers import floats_of_points
from polytopes.minkowski_weyl import ExactGenerators
from polytopes.qhull import dual_hull
from polytopes.redundancy import facets
from polytopes.rows import Rows
from polytopes.support import is_bounded, known_nonempty

_SAME = 1e-9  # relative distance below which two computed vertices are one
_RANK = float(np.finfo(np.float64).eps)  # relative singular value, per row, that counts as zero


def vertices(P: Rows) -> Floats:
    """Vertices of a bounded set, array (k, n); (0, n) if it is empty.

    Vertices closer than 1e-9 of the size of the set (measured in scaled coordinates) are merged.

    Raises
    ------
    UnboundedError
        If P is unbounded.
    """
    if P.made_of is not None:
        return in_order(P.made_of)
    known = quick_vertices(P)
    if known is not None:
        return known.copy()
    if not known_nonempty(P):
        return np.empty((0, P.dim))
    if not is_bounded(P):
        raise UnboundedError("P is unbounded, so its vertices do not describe it; intersect it with a box first.")
    if P.exact is not None:
        return in_order(P.exact)
    flat = explicit(P)
    program = flat.program.balanced
    free = program.flat.free
    if not free:
        return program.flat.point[None].copy()
    chosen = np.searchsorted(program.kept, facets(program))
    rows, rhs = np.ascontiguousarray(program.AT[:, chosen].T), program.rhs[chosen]
    z = _interval_ends(rows, rhs) if len(free) == 1 else _vertices_in_frame(rows, rhs, program.centre)
    return program.lift(z)


def known_vertices(P: Rows) -> Floats | None:
    """The vertices (k, n) of a box or of a set of short rows, if they are floats and soon found; not to be written."""
    if P.as_box is not None:
        return P.as_box.vertices
    return P.corners.points if P.corners is not None and P.corners.exact else None


def quick_vertices(P: Rows) -> Floats | None:
    """The vertices (k, n) in lexicographic order, where one call of the core finds them; not to be written."""
    known = None if P.as_box is None else P.as_box.vertices
    if known is None:
        known = P.listed if P.corners is None else P.corners.points
    return known


def in_order(found: ExactGenerators) -> Floats:
    """Vertices in integers to the nearest floats, in lexicographic order."""
    points = floats_of_points(found.vertices) if np.isnan(found.points).any() else found.points
    return points[np.lexsort(points.T[::-1])]


def _interval_ends(rows: Floats, rhs: Floats) -> Floats:
    ends = rhs / rows[:, 0]
    return np.sort(ends)[:, None]


def _vertices_in_frame(rows: Floats, rhs: Floats, inner: Floats) -> Floats:
    """Vertices of a bounded, full-dimensional set, by the dual hull in coordinates where it is about a unit ball."""
    body = unit_body(rows, rhs, inner)
    if body is None:
        raise UndecidedError("cannot list the vertices: the set is too thin for coordinates in which it is round.")
    return body.lift(listed(body))


def listed(body: UnitBody) -> Floats:
    """Vertices of a body in its own coordinates."""
    active, guesses = dual_hull(body.rows, body.rhs, body.inner)
    return _merged(_corners(body.rows, body.rhs, active, guesses))


def _corners(rows: Floats, rhs: Floats, active: list[list[int]], guesses: Floats) -> Floats:
    """The vertices recomputed from their active rows: the least correction of each guess."""
    corrected = guesses.copy()
    counts = np.array([len(numbers) for numbers in active])
    for count in np.unique(counts):
        chosen = np.flatnonzero(counts == count)
        numbers = np.array([active[k] for k in chosen])
        normals = rows[numbers]
        missed = rhs[numbers] - (normals @ guesses[chosen][:, :, None])[:, :, 0]
        corrected[chosen] += (np.linalg.pinv(normals, rcond=_RANK * count) @ missed[:, :, None])[:, :, 0]
    return corrected


def _merged(points: Floats) -> Floats:
    """Points without near-duplicates, in lexicographic order of their first occurrence."""
    from scipy.spatial import cKDTree

    ordered = points[np.lexsort(points.T[::-1])]
    reach = _SAME * max(1.0, float(np.abs(points).max()))
    keep = np.ones(len(ordered), dtype=bool)
    for first, second in sorted(cKDTree(ordered).query_pairs(reach, p=np.inf)):
        keep[second] &= not keep[first]
    merged: Floats = ordered[keep]
    return merged
