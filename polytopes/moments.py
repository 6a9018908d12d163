"""Volume, centroid and covariance of bounded sets, flat ones in their own dimension, by a triangulation.

A simplex with vertices v_0, ..., v_d has the volume ``|det(v_i - v_0)| / d!``, its centroid is the mean of them, and
the second moments of its points are ``(sum v_i v_i' + s s') / ((d + 1) (d + 2))`` with s the sum of the vertices.  All
are taken in the coordinates of one large simplex of vertices, formed in rationals, so that no thin set is lost to
rounding.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import factorial, inf, isqrt

import numpy as np
from flint import fmpq, fmpq_mat

from polytopes.affine_hull import affine_dim
from polytopes.checks import Floats
from polytopes.derived import derived
from polytopes.exact import ZERO, quotient, to_floats
from polytopes.incidence import incidence, sorted_vertices
from polytopes.rows import Rows
from polytopes.support import is_bounded, known_nonempty


@dataclass(frozen=True, eq=False)
class Triangulated:
    """A bounded set in simplices: corners in rationals, and the numbers (s, d + 1) of those of each simplex."""

    corners: list[list[fmpq]]
    simplices: np.ndarray[tuple[int, int], np.dtype[np.int64]]

    @classmethod
    def of(cls, P: Rows) -> "Triangulated":
        """Errors as of `incidence`."""
        found = sorted_vertices(P)
        corners = [[fmpq(v, row[-1]) for v in row[:-1]] for row in found.vertices.tolist()]
        return cls(corners, incidence(P).simplices())

    @derived
    def _edges(self) -> list[list[fmpq]]:
        """The vectors from the first corner to the others."""
        return [[u - v for u, v in zip(corner, self.corners[0], strict=True)] for corner in self.corners[1:]]

    @derived
    def basis(self) -> fmpq_mat:
        """Independent edges (d, n) of a large simplex, which span the set."""
        chosen = large_simplex(self._edges, self.simplices.shape[1] - 1)
        return fmpq_mat(len(chosen), len(self.corners[0]), [v for k in chosen for v in self._edges[k]])

    @derived
    def coordinates(self) -> fmpq_mat:
        """The corners (k, d) in the basis, from the first corner."""
        B = self.basis
        edges = [[ZERO] * B.ncols(), *self._edges]
        table = fmpq_mat(len(edges), B.ncols(), [v for edge in edges for v in edge])
        return table * B.transpose() * (B * B.transpose()).inv()

    @derived
    def squared_scale(self) -> fmpq:
        """The square of the volume of the box that the basis spans."""
        return (self.basis * self.basis.transpose()).det()

    @derived
    def z(self) -> Floats:
        """The same coordinates (k, d) in floats."""
        return to_floats(self.coordinates.entries()).reshape(len(self.corners), -1)

    @derived
    def shares(self) -> Floats:
        """Volumes (s,) of the simplices in the coordinates z, times d!."""
        corners = self.z[self.simplices]
        return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])), dtype=np.float64)

    def exact_share(self) -> Fraction:
        """The volume of all simplices in the coordinates z."""
        d, table = self.simplices.shape[1] - 1, self.coordinates
        total = ZERO
        for first, *others in self.simplices.tolist():
            edges = [table[i, j] - table[first, j] for i in others for j in range(d)]
            total += abs(fmpq_mat(d, d, edges).det())
        return Fraction(int(total.p), int(total.q)) / factorial(d)

    def lifted(self, z: Floats) -> Floats:
        """A point of the set from its coordinates z (d,)."""
        B = to_floats(self.basis.entries()).reshape(-1, len(self.corners[0]))
        return np.asarray(to_floats(self.corners[0]) + z @ B)


def large_simplex(edges: list[list[fmpq]], rank: int) -> list[int]:
    """Numbers of `rank` independent vectors, by elimination with the largest entry of all that are left as pivot."""
    rows, chosen = [list(edge) for edge in edges], list[int]()
    for _ in range(rank):
        _, k, j = max((abs(v), k, j) for k, row in enumerate(rows) if k not in chosen for j, v in enumerate(row))
        chosen.append(k)
        for i, row in enumerate(rows):
            if i not in chosen and row[j] != 0:
                factor = row[j] / rows[k][j]
                rows[i] = [u - factor * v for u, v in zip(row, rows[k], strict=True)]
    return chosen


def relative_volume(P: Rows) -> float:
    """The volume in the dimension of the affine hull: 1 for a point, the length of a segment; 0 if P is empty."""
    if not known_nonempty(P):
        return 0.0
    if not is_bounded(P):
        return inf
    body = Triangulated.of(P)
    d = body.simplices.shape[1] - 1
    return float(body.shares.sum()) / factorial(d) * _root(body.squared_scale)


def _root(squared: fmpq) -> float:
    """The root of a rational, nearly to the nearest float."""
    p, q = int(squared.p), int(squared.q)
    shift = max(0, 128 - p.bit_length() + q.bit_length())
    shift += shift % 2
    return quotient(isqrt((p << shift) // q), 1 << (shift // 2))


def exact_volume(P: Rows) -> Fraction | float:
    """The n-dimensional volume as a fraction: 0 for flat and empty sets, inf for unbounded full-dimensional ones."""
    if affine_dim(P) < P.dim:
        return Fraction(0)
    if not is_bounded(P):
        return inf
    body = Triangulated.of(P)
    squared = body.squared_scale
    return body.exact_share() * Fraction(isqrt(int(squared.p)), isqrt(int(squared.q)))  # a square: the basis is square


def centroid(P: Rows) -> Floats:
    """The centre of mass (n,) of a bounded set, of a flat one in its own dimension.

    Raises
    ------
    EmptySetError, UnboundedError
        If there is none.
    """
    body = Triangulated.of(P)
    return body.lifted(_mean(body))


def covariance(P: Rows) -> Floats:
    """The covariance (n, n) of the uniform distribution on a bounded set, a flat one in its own dimension.

    Raises
    ------
    EmptySetError, UnboundedError
        If there is none.
    """
    body = Triangulated.of(P)
    d = body.simplices.shape[1] - 1
    corners = (body.z - _mean(body))[body.simplices]
    sums = corners.sum(axis=1)
    second = np.einsum("kij,kil->kjl", corners, corners) + sums[:, :, None] * sums[:, None, :]
    moments = np.tensordot(body.shares, second, 1) / (body.shares.sum() * (d + 1) * (d + 2))
    B = to_floats(body.basis.entries()).reshape(d, P.dim)
    return np.asarray(B.T @ moments @ B)


def _mean(body: Triangulated) -> Floats:
    means = body.z[body.simplices].mean(axis=1)
    return np.asarray(body.shares @ means / body.shares.sum())
