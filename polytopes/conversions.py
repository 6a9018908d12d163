"""To and from the forms of other libraries; an equality becomes two rows where they know only inequalities."""

import importlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes.checks import Floats, real_array
from polytopes.hpolytope import HPolytope


def to_halfspaces(P: HPolytope) -> Floats:
    """Rows ``[A, -b]`` (m + 2 q, n + 1) as in `scipy.spatial.HalfspaceIntersection`: ``A x - b <= 0``."""
    A, b = np.vstack([P.A, P.C, -P.C]), np.concatenate([P.b, P.d, -P.d])
    return np.hstack([A, -b[:, None]])


def from_halfspaces(halfspaces: ArrayLike) -> HPolytope:
    """Set of rows ``[A, -b]``, the inverse of `to_halfspaces`; also takes `ConvexHull.equations`."""
    rows = real_array("halfspaces", halfspaces, ("m", "n + 1"))
    return HPolytope(rows[:, :-1], -rows[:, -1])


def to_cdd(P: HPolytope) -> Any:
    """An H-representation ``b - A x >= 0`` as a float matrix of pycddlib, equalities in its linearity set.

    Raises
    ------
    ImportError
        If pycddlib is not installed.
    """
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
    if matrix.rep_type != _cdd().RepType.INEQUALITY:
        raise ValueError("matrix is not an H-representation; convert it with cdd.copy_inequalities first.")
    rows = np.array(matrix.array, dtype=np.float64)
    fixed = np.array([i in matrix.lin_set for i in range(len(rows))], dtype=bool)
    return HPolytope(-rows[~fixed, 1:], rows[~fixed, 0], -rows[fixed, 1:], rows[fixed, 0])


def from_polytope(other: Any) -> HPolytope:
    """Set of a `polytope.Polytope` (attributes A and b)."""
    return HPolytope(other.A, np.ravel(other.b))


def to_polytope(P: HPolytope) -> Any:
    """A `polytope.Polytope`, rows as they are (an equality as two rows; that library takes flat sets for empty).

    Raises
    ------
    ImportError
        If the library polytope is not installed.
    """
    try:
        polytope = importlib.import_module("polytope")
    except ImportError as error:
        raise ImportError("to_polytope needs the library polytope: pip install polytope") from error
    rows = to_halfspaces(P)
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
    shapely = _shapely()
    if P.dim != 2:
        raise ValueError(f"P has dimension {P.dim}; expected 2: project or slice it first.")
    corners = P.vertices()
    if len(corners) < 3:
        made = (shapely.Polygon, shapely.Point, shapely.LineString)[len(corners)]
        return made(corners[0] if len(corners) == 1 else corners)
    offsets = corners - corners.mean(axis=0)
    return shapely.Polygon(corners[np.argsort(np.arctan2(offsets[:, 1], offsets[:, 0]))])


def from_shapely(geometry: Any) -> HPolytope:
    """The set of a convex planar geometry of shapely: a polygon, segment or point; exact where its rows are floats.

    Raises
    ------
    ValueError
        If the geometry is not convex (it then differs from its hull), or has more than two coordinates.
    ImportError
        If shapely is not installed.
    """
    shapely = _shapely()
    if geometry.is_empty:
        return HPolytope.empty(2)
    points = shapely.get_coordinates(geometry, include_z=geometry.has_z)
    if points.shape[1] != 2:
        raise ValueError("geometry has a third coordinate; expected a planar one.")
    hull = geometry.convex_hull
    if hull.geom_type != geometry.geom_type or not hull.equals(geometry):
        raise ValueError(f"geometry is a {geometry.geom_type} that is not convex; take its convex_hull, or its parts.")
    return HPolytope.from_vertices(np.unique(points, axis=0))


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
