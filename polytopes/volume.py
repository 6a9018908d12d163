"""The n-dimensional volume: that of the vertices by Qhull, in coordinates where the set is about round."""

from fractions import Fraction

import numpy as np
from flint import fmpq, fmpq_mat

from polytopes.affine_hull import affine_dim
from polytopes.box import Box
from polytopes.errors import UndecidedError
from polytopes.exact import to_floats
from polytopes.frame import unit_body
from polytopes.general_position import summed_volume
from polytopes.generators import exact_vertices
from polytopes.minkowski_weyl import ExactGenerators
from polytopes.qhull import points_volume
from polytopes.rows import Rows
from polytopes.short_sets import short_volume
from polytopes.support import is_bounded
from polytopes.vertices import listed


def volume(P: Rows) -> float:
    """Volume of P: 0 for flat and empty sets, inf for unbounded full-dimensional ones.

    Raises
    ------
    UndecidedError
        If the set is too thin for such coordinates, and not computed with in integers.
    """
    if P.as_box is not None:
        return _of_box(P, P.as_box)
    summed = _of_simplices(P)
    if summed is not None:
        return summed
    if affine_dim(P) < P.dim:
        return 0.0
    if not is_bounded(P):
        return np.inf
    if P.dim == 1:
        ends = [point[0] for point in exact_vertices(P)]
        return float(max(ends) - min(ends))
    if P.exact is not None:
        return _of_generators(P.exact)
    program = P.program.balanced
    body = unit_body(program.AT.T, program.rhs, program.centre)
    if body is None:
        raise UndecidedError("cannot measure the volume: the set is too thin for coordinates in which it is round.")
    size = np.prod(program.columns) * abs(np.linalg.det(body.axes))
    return float(points_volume(listed(body)) * size)


def _of_box(P: Rows, box: Box) -> float:
    """The product of its widths, of rationals where bounds were rounded."""
    lower, upper = box.corners
    widths = upper - lower
    for j in np.flatnonzero(np.isfinite(widths) & box.rounded):
        rows = zip(P.A[:, j].tolist(), P.b.tolist(), strict=True)
        ends = [(a > 0.0, Fraction(side) / Fraction(a)) for a, side in rows if a]
        widths[j] = float(min(end for above, end in ends if above) - max(end for above, end in ends if not above))
    return 0.0 if (widths == 0.0).any() else float(np.prod(widths))


def _of_simplices(P: Rows) -> float | None:
    """The volume as a sum of those of simplices, where a ball fits in that is large beside their rounding."""
    if P.prepared is None:
        return None
    return short_volume(P.in_core) if P.short else summed_volume(P.prepared)


def _of_generators(P: ExactGenerators) -> float:
    """Volume of the hull of exact vertices, in the coordinates of a large simplex of them: exact until Qhull."""
    n = P.dim
    points = [[fmpq(v, row[-1]) for v in row[:-1]] for row in P.vertices.tolist()]
    edges = [[u - v for u, v in zip(point, points[0], strict=True)] for point in points[1:]]
    simplex = _large_simplex([list(edge) for edge in edges])
    basis = fmpq_mat(n, n, [v for k in simplex for v in edges[k]])
    inside = fmpq_mat(len(edges), n, [v for edge in edges for v in edge]) * basis.inv()
    coordinates = to_floats(inside.entries()).reshape(-1, n)
    return points_volume(np.vstack([np.zeros(n), coordinates])) * abs(float(to_floats([basis.det()])[0]))


def _large_simplex(rows: list[list[fmpq]]) -> list[int]:
    """Numbers of independent rows, by elimination with the largest entry of each column as pivot."""
    chosen = []
    for j in range(len(rows[0])):
        k = max((k for k in range(len(rows)) if k not in chosen), key=lambda k: abs(rows[k][j]))
        chosen.append(k)
        for i, row in enumerate(rows):
            if i != k and row[j] != 0:
                factor = row[j] / rows[k][j]
                rows[i] = [u - factor * v for u, v in zip(row, rows[k], strict=True)]
    return chosen
