"""Sets in integers, by rows and by generators, and the way from one to the other (Minkowski 1896, Weyl 1935).

The set ``{x : a'x <= b, c'x = d}`` is the slice t = 1 of the cone ``a'x <= b t``, ``c'x = d t``, ``t >= 0``; the rows
that hold all over ``conv(vertices) + cone(rays) + span(lines)`` are a cone too.  `double_description` finds the
generators of both.
"""

from dataclasses import dataclass

import numpy as np
from flint import fmpz_mat
from numpy.typing import NDArray

from polytopes.derived import derived
from polytopes.double_description import MAX_RAYS, Integers, cone_generators, primitive

_TINY = float(np.finfo(np.float64).tiny)


@dataclass(frozen=True, eq=False)
class ExactRows:
    """``{x : a'x <= b, c'x = d}`` by primitive integers: inequalities ``[a, b]`` (m, n + 1), equalities ``[c, d]``."""

    inequalities: Integers
    equalities: Integers


@dataclass(frozen=True, eq=False)
class ExactGenerators:
    """``conv(vertices) + cone(rays) + span(lines)`` by primitive integers; no vertices: the empty set.

    A row ``[x, t]`` of `vertices` (k, n + 1) is the point x / t, with t > 0; `rays` (r, n) and `lines` (l, n).
    """

    vertices: Integers
    rays: Integers
    lines: Integers

    @property
    def dim(self) -> int:
        """Dimension n of the space."""
        return self.vertices.shape[1] - 1

    @property
    def affine_dim(self) -> int:
        """Dimension of the affine hull, -1 for the empty set."""
        return homogeneous_rank(self) - 1

    @derived
    def points(self) -> NDArray[np.float64]:
        """The vertices (k, n), each coordinate to the nearest float; NaN where that is not within half an ulp."""
        points = [[_nearest(v, row[-1]) for v in row[:-1]] for row in self.vertices.tolist()]
        return np.array(points, dtype=np.float64).reshape(len(points), self.dim)


def _nearest(numerator: int, denominator: int) -> float:
    try:
        quotient = numerator / denominator
    except OverflowError:
        return np.nan
    return quotient if abs(quotient) >= _TINY or not numerator else np.nan


def generators_of(rows: ExactRows, max_rays: int = MAX_RAYS) -> ExactGenerators:
    """Vertices, rays and lines of a set; with lines, the vertices and rays of the part where some coordinates are zero.

    Raises
    ------
    UndecidedError
        At the limit of rays.
    """
    n = rows.inequalities.shape[1] - 1
    future = np.append(np.zeros(n, dtype=np.int64), 1)[None]
    both = stacked(rows.inequalities, rows.equalities, future)
    both = np.hstack([both[:, :-1], -both[:, -1:]])
    rays, lines = cone_generators(stacked(both, -both[len(rows.inequalities) : -1]), max_rays)
    finite = rays[:, -1] > 0
    return ExactGenerators(rays[finite], rays[~finite, :-1], lines[:, :-1])


def rows_of(generators: ExactGenerators, max_rays: int = MAX_RAYS) -> ExactRows:
    """Minimal rows of a nonempty set: one for each facet, and independent equalities.

    Raises
    ------
    UndecidedError
        At the limit of rays.
    """
    holds = holding(generators)
    lines = holds[len(holds) - len(generators.lines) :]
    # columns in reverse: among rows that differ by equalities, those with zeros in front, not with b = 0
    rows, equalities = (part[:, ::-1] for part in cone_generators(stacked(holds, -lines)[:, ::-1], max_rays))
    corners = holds[: len(generators.vertices)].astype(object)
    touching = (rows.astype(object) @ corners.T == 0).any(axis=1)  # all but "0 <= 1", which touches at infinity
    return ExactRows(rows[touching], equalities)


def holding(generators: ExactGenerators) -> Integers:
    """The rows that ``[a, b]`` must be at most zero on, those of the lines last."""
    points = np.hstack([generators.vertices[:, :-1], -generators.vertices[:, -1:]])
    directions = stacked(generators.rays, generators.lines)
    return stacked(points, np.hstack([directions, np.zeros((len(directions), 1), dtype=directions.dtype)]))


def homogeneous_rank(generators: ExactGenerators) -> int:
    """Rank of the generators as vectors ``[x, t]``: one more than the dimension of a nonempty set."""
    holds = holding(generators)
    return int(fmpz_mat(len(holds), holds.shape[1], holds.ravel().tolist()).rank())


def union(sets: list[ExactGenerators]) -> ExactGenerators:
    """Generators of the closed convex hull of nonempty sets."""
    return ExactGenerators(
        stacked(*(P.vertices for P in sets)), stacked(*(P.rays for P in sets)), stacked(*(P.lines for P in sets))
    )


def total(P: ExactGenerators, Q: ExactGenerators) -> ExactGenerators:
    """Generators of the sum of two nonempty sets: all sums of vertices, and the directions of both."""
    V, W = P.vertices.astype(object)[:, None], Q.vertices.astype(object)[None]
    points = V[:, :, :-1] * W[:, :, -1:] + W[:, :, :-1] * V[:, :, -1:]
    both = np.concatenate([points, V[:, :, -1:] * W[:, :, -1:]], axis=2).reshape(-1, P.dim + 1)
    return ExactGenerators(distinct(primitive(both)), stacked(P.rays, Q.rays), stacked(P.lines, Q.lines))


def shadow(P: ExactGenerators, kept: list[int]) -> ExactGenerators:
    """Generators of the projection on some coordinates."""
    return image(P, np.eye(P.dim, dtype=np.int64)[kept], np.zeros(len(kept), dtype=np.int64), 1)


def image(P: ExactGenerators, M: Integers, shift: Integers, scale: int) -> ExactGenerators:
    """Generators of ``{(M x + shift) / scale : x in P}`` for integers M (p, n) and shift (p,)."""
    M, shift = M.astype(object), shift.astype(object)
    points = P.vertices.astype(object)
    moved = points[:, :-1] @ M.T + points[:, -1:] * shift
    vertices = primitive(np.hstack([moved, points[:, -1:] * scale]))
    return ExactGenerators(distinct(vertices), _directions(P.rays, M), _directions(P.lines, M))


def _directions(rays: Integers, M: Integers) -> Integers:
    moved = rays.astype(object) @ M.T
    return distinct(primitive(moved[moved.any(axis=1)]))


def distinct(rows: Integers) -> Integers:
    """Rows without repetitions, in the order of their first occurrence."""
    first = dict.fromkeys(map(tuple, rows.tolist()))
    return stacked(np.array(list(first), dtype=rows.dtype).reshape(len(first), rows.shape[1]))


def stacked(*tables: Integers) -> Integers:
    """Rows of all tables; Python integers if one of them holds such."""
    return np.vstack(tables)
