"""To and from the forms of other libraries; an equality becomes two rows where they know only inequalities."""

import importlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes.checks import Floats, real_array
from polytopes.fractions_given import exact_table, hold_fractions, row_of_floats
from polytopes.hpolytope import HPolytope
from polytopes.inclusion import half_spaces
from polytopes.planar import are_collinear, is_convex_ring, outline
from polytopes.rows import a_set


def to_halfspaces(P: HPolytope) -> Floats:
    """Rows ``[A, -b]`` (m + 2 q, n + 1) as in `scipy.spatial.HalfspaceIntersection`: ``A x - b <= 0``."""
    normals, sides = half_spaces(a_set(P, "P"))
    return np.hstack([normals, -sides[:, None]])


def from_halfspaces(halfspaces: ArrayLike) -> HPolytope:
    """Set of rows ``[A, -b]``, the inverse of `to_halfspaces`; also takes `ConvexHull.equations`."""
    rows = real_array("halfspaces", halfspaces, ("m", "n + 1"))
    if rows.shape[1] < 2:
        raise ValueError(f"halfspaces has shape {rows.shape}; expected (m, n + 1) with n of at least 1.")
    return HPolytope(rows[:, :-1], -rows[:, -1])


def to_cdd(P: HPolytope) -> Any:
    """An H-representation ``b - A x >= 0`` as a float matrix of pycddlib, equalities in its linearity set.

    Raises
    ------
    ImportError
        If pycddlib is not installed.
    """
    a_set(P, "P")
    rows = np.vstack([np.hstack([P.b[:, None], -P.A]), np.hstack([P.d[:, None], -P.C])])
    if not len(rows):  # a matrix without rows would lose the dimension
        rows = np.append(1.0, np.zeros(P.dim))[None]
    matrix = _cdd().matrix_from_array(rows.tolist(), rep_type=_cdd().RepType.INEQUALITY)
    matrix.lin_set = set(range(P.b.size, P.b.size + P.d.size))
    return matrix


def from_cdd(matrix: Any) -> HPolytope:
    """Set of an H-representation of pycddlib.

    Raises
    ------
    ValueError
        If the matrix holds generators instead.
    """
    if not hasattr(matrix, "rep_type"):
        raise TypeError(f"matrix is a {type(matrix).__name__}; expected a matrix of pycddlib.")
    if matrix.rep_type != _cdd().RepType.INEQUALITY:
        raise ValueError("matrix is not an H-representation; convert it with cdd.copy_inequalities first.")
    rows = real_array("matrix", _floats_of(matrix.array), ("m", "n + 1"))
    fixed = np.array([i in matrix.lin_set for i in range(len(rows))], dtype=bool)
    rows[:, 1:] = 0.0 - rows[:, 1:]  # no negative zeros
    return HPolytope(rows[~fixed, 1:], rows[~fixed, 0], rows[fixed, 1:], rows[fixed, 0])


def _floats_of(table: Any) -> Any:
    """Rows of a matrix as they are, or of one of fractions as rows of floats, each multiplied by a positive number."""
    rows = [list(row) for row in table]
    if not hold_fractions(rows):
        return rows
    return [row_of_floats(f"row {i} of matrix", row) for i, row in enumerate(exact_table("matrix", rows))]


def from_polytope(other: Any) -> HPolytope:
    """Set of a `polytope.Polytope` (attributes A and b)."""
    if not (hasattr(other, "A") and hasattr(other, "b")):
        raise TypeError(f"other is a {type(other).__name__}; expected a polytope.Polytope.")
    if hasattr(other, "C") or hasattr(other, "Ae"):
        raise TypeError(f"other is a {type(other).__name__}, which may have equalities; expected a polytope.Polytope.")
    return HPolytope(other.A, np.ravel(other.b))


def to_polytope(P: HPolytope) -> Any:
    """A `polytope.Polytope`, rows as they are (an equality as two rows; that library takes flat sets for empty).

    Raises
    ------
    ImportError
        If the library polytope is not installed.
    """
    rows = to_halfspaces(P)
    try:
        polytope = importlib.import_module("polytope")
    except ImportError as error:
        raise ImportError("to_polytope needs the library polytope: pip install polytope") from error
    return polytope.Polytope(rows[:, :-1], -rows[:, -1], normalize=False)


def to_shapely(P: HPolytope) -> Any:
    """A planar bounded set as a shapely `Polygon`, `LineString` or `Point`, an empty polygon if it is empty.

    Raises
    ------
    ValueError
        If the set is not planar.
    UnboundedError
        If it is unbounded.
    ImportError
        If shapely is not installed.
    """
    if a_set(P, "P").dim != 2:
        raise ValueError(f"P has dimension {P.dim}; expected 2: project or slice it first.")
    shapely, corners = _shapely(), outline(P.vertices())
    made = (shapely.Polygon, shapely.Point, shapely.LineString, shapely.Polygon)[min(len(corners), 3)]
    return made(corners[0] if len(corners) == 1 else corners)


def from_shapely(geometry: Any) -> HPolytope:
    """The set of a convex planar geometry of shapely: a polygon, segment or point; exact where its rows are floats.

    Raises
    ------
    ValueError
        If the geometry is not convex, decided in rationals, or has more than two coordinates.
    ImportError
        If shapely is not installed.
    """
    shapely = _shapely()
    if geometry.is_empty:
        return HPolytope.empty(2)
    points = shapely.get_coordinates(geometry, include_z=geometry.has_z)
    if points.shape[1] != 2:
        raise ValueError("geometry has a third coordinate; expected a planar one.")
    if not _is_convex(geometry, points):
        raise ValueError(f"geometry is a {geometry.geom_type} that is not convex; take its convex_hull, or its parts.")
    return HPolytope.from_vertices(np.unique(points, axis=0))


def _is_convex(geometry: Any, points: Floats) -> bool:
    """Whether a polygon without holes, a line or a point is convex, given its points (k, 2)."""
    if geometry.geom_type == "Polygon":
        return not len(geometry.interiors) and is_convex_ring(points)
    return geometry.geom_type == "Point" or (geometry.geom_type == "LineString" and are_collinear(points))


def _shapely() -> Any:
    try:
        return importlib.import_module("shapely")
    except ImportError as error:
        raise ImportError("conversions with shapely need it installed: pip install shapely") from error


def _cdd() -> Any:
    try:
        import cdd
    except ImportError as error:
        raise ImportError("conversions with cdd need the extra 'cdd': pip install 'svo-fdi[cdd]'") from error
    return cdd
