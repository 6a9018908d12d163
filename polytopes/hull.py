"""Convex hulls: of points, and of a set known only by its support points."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.frame import Oracle, inverted, principal_axes, unit_frame
from polytopes.general_position import rows_around, simplicial_facets
from polytopes.qhull import point_hull
from polytopes.redundancy import irredundant

Indices = NDArray[np.int64]
_FLAT = 1e-12  # relative width below which points are taken to lie in a subspace
_EPS = float(np.finfo(np.float64).eps)
_NOISE = 1e-15  # width of a coordinate, relative to the largest one, that may be rounding
_SLIVER = 1e-5  # relative volume and least edge of a simplex that fixes its hyperplane
_TOUCHING = 1e-13  # distance from a hyperplane at which a point lies on it (widths are about one)
_ALIKE = 1e-6  # distance between two rows below which they may be one facet
_REACHED = 1e-11  # a facet is final if no point of the set lies this far beyond it (widths are about one)


@dataclass(frozen=True, eq=False)
class Spread:
    """How points (k, n) are spread: `offsets` (k, n) from their mean, over powers of two `scale` (n,), and the widths
    `sizes` (n,) along the principal `axes` (n, n), widest first; all but the first `rank` are rounding.
    """

    points: Floats
    scale: Floats
    offsets: Floats
    sizes: Floats
    axes: Floats
    rank: int

    @classmethod
    def of(cls, V: Floats, ahead: Floats | None = None) -> Self:
        """The spread of points (k, n), and of further ones about their mean."""
        both = V if ahead is None else np.vstack([V, ahead])
        scale = axis_scales(both)
        offsets = (both - V.mean(axis=0)) / scale
        sizes, axes = principal_axes(offsets)
        return cls(both, scale, offsets, sizes, axes, numeric_rank(sizes))

    @property
    def across(self) -> Floats:
        """Unit normals of the subspace that the points lie in, to within 1e-12 of their spread; none in all of R^n."""
        return _unit(_divided(self.axes[self.rank :], self.scale))

    def normals(self) -> Floats:
        """Unit normals of the facets of the points' shadow on that subspace."""
        rank, sizes = self.rank, self.sizes[: self.rank]
        if rank == 0:
            return np.empty((0, self.scale.size))
        facets = _facets(self.offsets @ self.axes[:rank].T / sizes).normals()
        return _unit(_divided(facets / sizes @ self.axes[:rank], self.scale))


def outer_rows(spread: Spread, offsets: Callable[[Floats], Floats]) -> tuple[Floats, Floats]:
    """Rows A, b of a set that contains the one of which some points are all vertices, or nearly so.

    The points only tell the normals.  Where they lie within 1e-12 of their spread of a subspace, the set is held in a
    slab about it: the facets are those of the points' shadow on the subspace.

    Parameters
    ----------
    spread : Spread
        Of the points.
    offsets : callable
        Upper bounds of the set's supports along normals (m, n).
    """
    across = spread.across
    rows = np.vstack([spread.normals(), across, -across])
    return rows, offsets(rows)


def normals_around(V: Floats) -> Floats:
    """Unit normals (m, n) of the facets of the hull of points (k, n), and of a subspace that they nearly lie in."""
    known = rows_around(V)
    if known is not None:
        return known[:, :-1]
    spread = Spread.of(V)
    facets, across = spread.normals(), spread.across
    return np.vstack([facets, across, -across])


def spread_with(V: Floats, rays: Floats) -> Spread:
    """The spread of points (k, n) and of rays (r, n).

    The rays are taken to be about as long as the points are spread, or, where that is rounding, as they are large.
    """
    if not len(rays):
        return Spread.of(V)
    longest = np.abs(rays).max(axis=1, keepdims=True)
    spread, size = np.ptp(V, axis=0).max(), np.abs(V).max()
    spread = (spread if spread > _FLAT * size else size) or 1.0
    return Spread.of(V, V.mean(axis=0) + rays / np.where(longest > 0.0, longest, 1.0) * spread)


def numeric_rank(sizes: Floats) -> int:
    """How many of the sizes, widest first, are more than 1e-12 of the widest."""
    return int(np.count_nonzero(sizes > _FLAT * sizes[0]))


def point_offsets(V: Floats) -> Callable[[Floats], Floats]:
    """Upper bounds of the supports of points (k, n), rounding included."""
    size, unit = np.abs(V).max(axis=0), (V.shape[1] + 2) * _EPS

    def offsets(normals: Floats) -> Floats:
        bounds: Floats = (V @ normals.T).max(axis=0) + unit * (np.abs(normals) @ size)
        return bounds

    return offsets


def _divided(rows: Floats, scale: Floats) -> Floats:
    """The directions of rows / scale, whose largest entries stay near one where a quotient would leave the floats."""
    powers = np.frexp(scale)[1]
    sizes = np.where(rows != 0.0, np.frexp(rows)[1] - powers, np.iinfo(np.int32).min)
    divided: Floats = np.ldexp(rows / np.ldexp(scale, -powers), -powers - sizes.max(axis=1, keepdims=True))
    return divided


def _unit(rows: Floats) -> Floats:
    scaled: Floats = rows / np.linalg.norm(rows, axis=1)[:, None]
    return scaled


def axis_scales(V: Floats) -> Floats:
    """Powers of two near the widths of the points along the axes; where those are rounding, near the points' size."""
    widths, sizes = np.ptp(V, axis=0), np.abs(V).max(axis=0)
    real = (widths > _FLAT * sizes) & (widths > _NOISE * sizes.max())
    widths = np.where(real, widths, np.maximum(sizes, widths.max()))
    return np.ldexp(1.0, np.frexp(np.where(widths > 0.0, widths, 1.0))[1])


@dataclass(frozen=True, eq=False)
class _Facets:
    """Facets of the hull of full-dimensional points (k, n) of widths about one, as Qhull found them.

    `rows` are distinct outward unit normals with minus the offsets, `simplices` (f, n) numbers of points, each with its
    row in `number`, and `corners` the numbers of the points that are vertices; `proven`: no two rows are one facet.
    """

    points: Floats
    rows: Floats
    simplices: Indices
    number: Indices
    corners: Indices
    proven: bool = False

    def normals(self) -> Floats:
        """The rows' normals, without those that no facet has."""
        normals, offsets = self.rows[:, :-1], self.rows[:, -1]
        if self.certain():
            return normals
        return normals[irredundant(np.ascontiguousarray(normals.T), -offsets, np.zeros(normals.shape[1]))]

    def certain(self) -> bool:
        """Whether each row surely is a facet of its own.

        A half-space that holds all points and touches n of them that do not lie near a smaller flat is a facet; no
        other row is the same facet if none is nearly equal.
        """
        if self.proven or self.rows.shape[1] == 2:
            return True
        from scipy.spatial import cKDTree

        normals, offsets = self.rows[:, :-1], self.rows[:, -1]
        beyond = (self.points[self.corners] @ normals.T + offsets).max()
        corners = self.points[self.simplices]
        edges = corners[:, 1:] - corners[:, :1]
        lengths = np.maximum(np.linalg.norm(edges, axis=2), 1e-300)
        frames = np.concatenate([edges / lengths[:, :, None], normals[self.number, None]], axis=1)
        off = np.abs((corners @ normals[self.number, :, None])[:, :, 0] + offsets[self.number, None]).max(axis=1)
        proper = (np.abs(np.linalg.det(frames)) > _SLIVER) & (lengths.min(axis=1) > _SLIVER) & (off <= _TOUCHING)
        touched = np.unique(self.number[proper]).size == len(self.rows)
        return bool(beyond <= _TOUCHING and touched) and not cKDTree(self.rows).query_pairs(_ALIKE)


def _facets(points: Floats) -> _Facets:
    if points.shape[1] == 1:
        ends = np.array([[points.argmax()], [points.argmin()]])
        rows = np.array([[1.0, -points.max()], [-1.0, points.min()]])
        return _Facets(points, rows, ends, np.arange(2), ends[:, 0])
    proven = simplicial_facets(points)
    if proven is not None:
        return _Facets(points, *proven, np.arange(len(proven[0])), np.unique(proven[1]), True)
    equations, simplices, corners = point_hull(points)
    order = np.lexsort(equations.T[::-1])
    fresh = np.append(True, (np.diff(equations[order], axis=0) != 0.0).any(axis=1))
    number = np.empty(len(order), np.int64)
    number[order] = np.cumsum(fresh) - 1
    return _Facets(points, equations[order[fresh]], simplices, number, corners)


def normals_by_supports(oracle: Oracle, inner: Floats) -> Floats:
    """Unit normals (m, n) of the facets of a bounded, full-dimensional set from its support points.

    The hull of a few support points is refined: a support point along the normal of every facet either confirms the
    facet or lies beyond it and is added.

    Parameters
    ----------
    oracle : callable
        Directions (k, n) to a maximiser for each, (k, n).
    inner : array (n,)
        A point strictly inside.
    """
    n = inner.size
    if n == 1:
        return np.array([[1.0], [-1.0]])
    frame = unit_frame(oracle, inner)
    axes = inverted(frame)

    def scaled_oracle(directions: Floats) -> Floats:
        points: Floats = (oracle(directions @ axes) - inner) @ axes.T
        return points

    return _unit(_refined(scaled_oracle, n).normals() @ axes)


def _refined(oracle: Oracle, n: int) -> _Facets:
    """Facets of a set of widths about one.

    Each round starts Qhull afresh: its incremental mode ends the whole process on a topology error.
    """
    points = _spanning_points(oracle, n)
    final: set[bytes] = set()
    while True:
        found = _facets(points)
        fresh = found.rows[[facet.tobytes() not in final for facet in found.rows]]
        corners = oracle(fresh[:, :-1])
        beyond = (corners * fresh[:, :-1]).sum(axis=1) + fresh[:, -1] > _REACHED
        reached = {point.tobytes() for point in points}
        more = np.unique(corners[beyond], axis=0)
        more = more[[corner.tobytes() not in reached for corner in more]]
        if not len(more):  # beyond a facet only by what Qhull rounds
            return found
        final.update(facet.tobytes() for facet in fresh[~beyond])
        points = np.vstack([points, more])


def _spanning_points(oracle: Oracle, n: int) -> Floats:
    """Support points that do not lie near a hyperplane."""
    points = oracle(np.vstack([np.eye(n), -np.eye(n)]))
    for _ in range(n):
        spread, principal = principal_axes(points)
        if spread[-1] > _REACHED**0.5:
            break
        points = np.vstack([points, oracle(np.vstack([principal[-1], -principal[-1]]))])
    return points
