"""Vertices, rays and lines of any set, and rows from them: both are the generators of a cone.

The cone ``{y : G y <= 0}`` is the sum of its lines (the null space of G, exact) and a pointed cone, whose rays are the
vertices of a bounded slice ``w'y = 1`` with ``w = -sum g_i``, positive all over the pointed cone.  A set
``{x : A x <= b, C x = d}`` is the slice t = 1 of the cone ``A x <= b t``, ``C x = d t``, ``t >= 0`` (Minkowski-Weyl).
"""

from dataclasses import dataclass

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from polytopes.affine import AffineSet, affine_set
from polytopes.errors import EmptySetError, UnboundedError, UndecidedError
from polytopes.exact import row_to_floats
from polytopes.hull import axis_scales, normals_of_span
from polytopes.rows import Rows
from polytopes.support import known_nonempty
from polytopes.vertices import vertices

Floats = NDArray[np.float64]
_AT_INFINITY = 1e-11  # a generator whose t is this small beside its x is a direction


@dataclass(frozen=True, eq=False)
class Generators:
    """``conv(vertices) + cone(rays) + span(lines)``: arrays (k, n), (r, n) and (l, n).

    With lines, the vertices and rays are those of the part of the set across the lines (some coordinates zero).
    """

    vertices: Floats
    rays: Floats
    lines: Floats


def generators(P: Rows) -> Generators:
    """Vertices, rays and lines of a nonempty set.

    Raises
    ------
    EmptySetError
        If P is empty.
    """
    if not known_nonempty(P):
        raise EmptySetError("the empty set has no generators; ask emptiness() first.")
    size = float(np.ldexp(1.0, np.frexp(P.program.size)[1] - 1))  # a power of two: what is flat stays flat
    equalities = np.hstack([P.C, -P.d[:, None] / size])
    last = np.append(np.zeros(P.dim), -1.0)
    rays, lines = _cone(np.vstack([np.hstack([P.A, -P.b[:, None] / size]), last, equalities, -equalities]))
    directions, t = rays[:, :-1], rays[:, -1] / size
    finite = rays[:, -1] > _AT_INFINITY * np.abs(directions).max(axis=1, initial=0.0)
    corners = directions[finite] / t[finite, None]
    if not len(corners):
        corners = P.program.interior.point[None].copy()
    return Generators(corners, directions[~finite], lines[:, :-1])


def rows_of_generators(V: Floats, rays: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Rows A, b, C, d of ``conv(V) + cone(rays)``, found in coordinates scaled by powers of two, which is exact."""
    scale, lengths = _scales(V, rays)
    A, b, C, d = _scaled_rows(V / scale, rays / scale / lengths[:, None])
    return A / scale, b, C / scale, d


def _scales(V: Floats, rays: Floats) -> tuple[Floats, Floats]:
    """Powers of two near the widths along the axes, the rays taken to be about as long as the points are spread, and
    near the lengths of the rays in such coordinates.
    """
    longest = np.abs(rays).max(axis=1, keepdims=True)
    reach = rays / np.where(longest > 0.0, longest, 1.0) * (np.ptp(V, axis=0).max() or 1.0)
    scale = axis_scales(np.vstack([V, V[0] + reach, V[0] - reach]))
    lengths = np.abs(rays / scale).max(axis=1)
    return scale, np.ldexp(1.0, np.frexp(np.where(lengths > 0.0, lengths, 1.0))[1])


def _scaled_rows(V: Floats, rays: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """The generators of the cone of all rows that hold.

    Points and rays within 1e-12 of their spread of a subspace give explicit equalities, exact ones if they lie in it
    exactly; the rows are found in as many of the coordinates as the subspace has dimensions.
    """
    n = V.shape[1]
    points, cone = np.hstack([V, -np.ones((len(V), 1))]), np.hstack([rays, np.zeros((len(rays), 1))])
    holds = np.vstack([points, cone])
    C = _normals(V, rays)
    d = C @ V.mean(axis=0)
    exact = _lines(affine_set(holds, np.zeros(len(holds))))
    if len(exact) == len(C):
        C, d = exact[:, :-1], exact[:, -1]
    free = [*affine_set(C, d).free, n]
    reduced, _ = _cone(holds[:, free])
    found = np.zeros((len(reduced), n + 1))
    found[:, free] = reduced
    proper = np.abs(found[:, :-1]).max(axis=1, initial=0.0) > _AT_INFINITY * np.abs(found[:, -1])
    return found[proper, :-1], found[proper, -1], C, d


def _normals(V: Floats, rays: Floats) -> Floats:
    """Unit normals of the affine hull of points and rays, all taken to be about as long."""
    longest = np.abs(rays).max(axis=1, keepdims=True)
    offsets = V - V.mean(axis=0)
    directions = rays / np.where(longest > 0.0, longest, 1.0) * (np.abs(offsets).max() or 1.0)
    return normals_of_span(np.vstack([offsets, directions]))


def _cone(G: Floats) -> tuple[Floats, Floats]:
    """Extreme rays and lines of ``{y : G y <= 0}``."""
    n = G.shape[1]
    largest = np.abs(G).max(axis=1)
    G = np.ldexp(G, -np.frexp(np.where(largest > 0.0, largest, 0.5))[1][:, None])  # rows whose squares are floats
    null = affine_set(G, np.zeros(len(G)))
    across = G[:, null.pivots]
    lengths = np.linalg.norm(across, axis=1)
    slicing = -(across[lengths > 0] / lengths[lengths > 0, None]).sum(axis=0)
    rays = np.zeros((0, n))
    if slicing.any():
        try:
            corners = vertices(Rows(across, np.zeros(len(G)), slicing[None], [1.0]))
        except UnboundedError:  # in floats only: two generators whose difference is rounding
            raise UndecidedError("rounding hides which generators are extreme and which cancel.") from None
        rays = np.zeros((len(corners), n))
        rays[:, null.pivots] = corners
    return rays, _lines(null)


def _lines(null: AffineSet) -> Floats:
    """Directions (l, n) of a linear subspace, exact where integers are."""
    lines = np.zeros((len(null.free), null.dim))
    for q in range(len(null.free)):
        line = null.lift_exactly([fmpq(int(q == k)) for k in range(len(null.free))])
        lines[q] = row_to_floats(line[:-1], line[-1])
    return lines
