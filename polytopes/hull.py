"""Between vertices and rows: convex hulls of points, and the vertices of bounded sets.

Qhull does the combinatorics, on coordinates centred in the set and scaled to about unit size along its own axes; flat
sets are handled in their subspace.  Points are never rounded on the way.
"""

import numpy as np
from numpy.typing import NDArray

from polytopes.affine_hull import explicit
from polytopes.errors import UnboundedError
from polytopes.redundancy import irredundant
from polytopes.rows import Rows
from polytopes.support import is_bounded, known_nonempty

Floats = NDArray[np.float64]
_FLAT = 1e-12  # relative width below which points are taken to lie in a subspace
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
    kept = irredundant(program)
    rows, rhs = np.ascontiguousarray(program.AT[:, kept].T), program.rhs[kept]
    z = _interval_ends(rows, rhs) if len(free) == 1 else _vertices_in_frame(rows, rhs)
    lifted: Floats = program.flat.lift(z)
    return lifted


def _interval_ends(rows: Floats, rhs: Floats) -> Floats:
    ends = rhs / rows[:, 0]
    return np.sort(ends)[:, None]


def _vertices_in_frame(rows: Floats, rhs: Floats) -> Floats:
    """Vertices of a bounded, full-dimensional set, by the dual hull in coordinates where it is about a unit ball."""
    from scipy.spatial import HalfspaceIntersection

    centre, frame = _frame(rows, rhs)
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


def _frame(rows: Floats, rhs: Floats) -> tuple[Floats, Floats]:
    """A centre and axes (columns) in which the set has widths of about one.

    Widths along the current axes scale them; where the support points then lie near a subspace (a thin, skew set), the
    axes turn to the principal ones and the widths are taken again.
    """
    program = Rows(rows, rhs).program
    centre, frame = program.interior.point, np.eye(rows.shape[1])
    for _ in range(3):
        axes = np.linalg.inv(frame)
        values = program.maximise(np.vstack([axes, -axes])).values
        frame = frame * (values[: len(axes)] + values[len(axes) :])
        axes = np.linalg.inv(frame)
        points = (program.maximise(np.vstack([axes, -axes])).points - centre) @ axes.T
        _, sizes, principal = np.linalg.svd(points - points.mean(axis=0))
        if sizes[-1] > 0.05:
            break
        turned = frame @ principal.T
        axes = np.linalg.inv(turned)
        values = program.maximise(np.vstack([axes, -axes])).values
        frame = turned * (values[: len(axes)] + values[len(axes) :])
    return centre, frame


def _merged(points: Floats) -> Floats:
    """Points without near-duplicates, in lexicographic order of their first occurrence."""
    reach = _SAME * max(1.0, float(np.abs(points).max()))
    chosen: list[Floats] = []
    for point in points[np.lexsort(points.T[::-1])]:
        if not chosen or np.abs(np.array(chosen) - point).max(axis=1).min() > reach:
            chosen.append(point)
    return np.array(chosen)


def rows_of_points(V: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Rows A, b, C, d of the convex hull of points (k, n), k >= 1.

    Points within 1e-12 of their spread of a subspace give explicit equalities.  Every right-hand side is the maximum
    over the points, so that each point satisfies its rows to rounding.
    """
    n = V.shape[1]
    centre = V.mean(axis=0)
    offsets = V - centre
    spread = float(np.abs(offsets).max())
    _, sizes, axes = np.linalg.svd(offsets, full_matrices=True)
    rank = int(np.count_nonzero(sizes > _FLAT * max(float(sizes[0]), np.finfo(float).tiny))) if spread > 0 else 0
    C = axes[rank:]
    d = C @ centre
    if rank == 0:
        return np.empty((0, n)), np.empty(0), np.eye(n), V[0].copy()
    normals = _facet_normals(offsets @ axes[:rank].T / sizes[:rank]) / sizes[:rank] @ axes[:rank]
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    hull = Rows(normals, (V @ normals.T).max(axis=0), C, d)
    kept = hull.program.kept[irredundant(hull.program)]
    return hull.A[kept], hull.b[kept], C, d


def _facet_normals(points: Floats) -> Floats:
    """Outward normals of the hull of full-dimensional points."""
    from scipy.spatial import ConvexHull

    if points.shape[1] == 1:
        return np.array([[1.0], [-1.0]])
    normals: Floats = ConvexHull(points).equations[:, :-1]
    return normals
