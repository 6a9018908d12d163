"""Vertices of bounded sets.

Qhull does the combinatorics (the hull of the dual points), on coordinates centred in the set and scaled to about unit
size along its own axes; flat sets are handled in their subspace.  Points are never rounded on the way.
"""

import numpy as np
from numpy.typing import NDArray

from polytopes.affine_hull import explicit
from polytopes.errors import UnboundedError
from polytopes.frame import unit_frame
from polytopes.redundancy import facets
from polytopes.rows import Rows
from polytopes.support import is_bounded, known_nonempty

Floats = NDArray[np.float64]
_SAME = 1e-9  # relative distance below which two computed vertices are one


def vertices(P: Rows) -> Floats:
    """Vertices of a bounded set, array (k, n); (0, n) if it is empty.

    Vertices closer than 1e-9 of the size of the set (measured in scaled coordinates) are merged.

    Raises
    ------
    UnboundedError
        If P is unbounded.
    """
    if not known_nonempty(P):
        return np.empty((0, P.dim))
    if not is_bounded(P):
        raise UnboundedError("P is unbounded, so its vertices do not describe it; intersect it with a box first.")
    flat = explicit(P)
    program = flat.program
    free = program.flat.free
    if not free:
        return program.flat.point[None].copy()
    chosen = np.searchsorted(program.kept, facets(program))
    rows, rhs = np.ascontiguousarray(program.AT[:, chosen].T), program.rhs[chosen]
    z = _interval_ends(rows, rhs) if len(free) == 1 else _vertices_in_frame(rows, rhs)
    lifted: Floats = program.flat.lift(z)
    return lifted


def _interval_ends(rows: Floats, rhs: Floats) -> Floats:
    ends = rhs / rows[:, 0]
    return np.sort(ends)[:, None]


def _vertices_in_frame(rows: Floats, rhs: Floats) -> Floats:
    """Vertices of a bounded, full-dimensional set, by the dual hull in coordinates where it is about a unit ball."""
    from scipy.spatial import HalfspaceIntersection

    program = Rows(rows, rhs).program
    centre = program.interior.point
    frame = unit_frame(lambda directions: program.maximise(directions).points, centre)
    scaled, room = rows @ frame, rhs - rows @ centre
    lengths = np.linalg.norm(scaled, axis=1)
    scaled, room = scaled / lengths[:, None], room / lengths
    inner = Rows(scaled, room).program.interior.point
    hull = HalfspaceIntersection(np.hstack([scaled, -room[:, None]]), inner)
    corners = zip(hull.dual_facets, hull.intersections, strict=True)
    points = _merged(np.array([_corner(scaled, room, active, guess) for active, guess in corners]))
    return centre + points @ frame.T


def _corner(rows: Floats, rhs: Floats, active: list[int], guess: Floats) -> Floats:
    """The vertex recomputed from its active rows."""
    correction = np.linalg.lstsq(rows[active], rhs[active] - rows[active] @ guess, rcond=None)[0]
    corrected: Floats = guess + correction
    return corrected


def _merged(points: Floats) -> Floats:
    """Points without near-duplicates, in lexicographic order of their first occurrence."""
    reach = _SAME * max(1.0, float(np.abs(points).max()))
    chosen: list[Floats] = []
    for point in points[np.lexsort(points.T[::-1])]:
        if not chosen or np.abs(np.array(chosen) - point).max(axis=1).min() > reach:
            chosen.append(point)
    return np.array(chosen)
