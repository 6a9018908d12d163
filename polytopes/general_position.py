"""Vertices, volumes and hulls in floats by the compiled core, where it is certain which rows meet where.

In general position (n rows in each vertex, n points in each facet) all are proven (`core/polytopes/cone.c`).  Elsewhere
the double description goes by floats of which every sign is told by a bound (`core/polytopes/near_cone.c`).  Sets that
are nearly one thing and nearly another are left to other methods.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from polytopes import kernel
from polytopes.checks import Floats
from polytopes.kernel import Indices
from polytopes.native import Address, Entries, Given, Integer, Real, address, function, scratch
from polytopes.prepared import PreparedRows

WIDE = 1e-6
"""Radius of a largest ball, relative to the size of b, from which rounding is small beside it."""

_MOST = 100_000  # vertices or facets
_APART = 1e-9  # distance of a vertex from a row, or of a facet from a point, below which it counts as nearly on it
_ROOM = 120  # vertices or facets for which there is room from the start
_NO_ROOM = -3  # why there is no answer yet

_vertices = function(
    "fdi_prepared_vertices", *[Integer] * 2, Address, *[Real] * 2, Integer, Entries, *[Address] * 2, returns=Integer
)
_hull = function("fdi_point_hull", *[Integer] * 2, Given, Real, Integer, Entries, Address, returns=Integer)
_vertices_room, _hull_room = (
    lru_cache(1024)(function(f"fdi_{name}_room", *[Integer] * 3, returns=Integer))
    for name in ("prepared_vertices", "point_hull")
)


def listed_vertices(rows: PreparedRows) -> Floats | None:
    """Vertices (k, n) of a set, in lexicographic order; None where it is not certain that it is bounded by them."""
    return _listed(rows, None)


def summed_volume(rows: PreparedRows) -> float | None:
    """The volume of a set, of simplices between its vertices; None if it is not bounded for sure, or they are many."""
    volume = np.empty(1)
    return volume.item() if _listed(rows, address(volume)) is not None and volume.item() >= 0.0 else None


def _listed(rows: PreparedRows, volume: int | None) -> Floats | None:
    n, m = rows.rows[:2]

    def call(room: int, points: Floats) -> int:
        block = scratch(_vertices_room(n, m, room))
        count: int = _vertices(n, m, rows.at, WIDE, _APART, room, points, volume, block)
        return count

    return _with_room(call, n)


def rows_around(V: Floats) -> Floats | None:
    """Rows ``[A, b]`` (f, n + 1) of the hull of points (k, n), outward; None where its facets are not certain."""
    k, n = V.shape
    if k <= n:
        return None
    return _with_room(lambda room, rows: _hull(n, k, V, _APART, room, rows, scratch(_hull_room(n, k, room))), n + 1)


def _with_room(call: Callable[[int, Any], int], width: int) -> Floats | None:
    """What a call finds, given room for as much as it needs."""
    room = _ROOM
    while True:
        found = np.empty((room, width))
        count = call(room, found)
        if count >= 0:
            return found[:count]
        if count != _NO_ROOM or room >= _MOST:
            return None
        room = min(4 * room, _MOST)


def simplicial_facets(points: Floats) -> tuple[Floats, Indices] | None:
    """Facets of the hull of points (k, n) of widths about one: unit normals with minus the offsets, numbers of points.

    Returns
    -------
    rows, simplices : arrays (f, n + 1) and (f, n), or None if they are not proven to be all
    """
    k, n = points.shape
    middle = points.mean(axis=0)
    offsets = points - middle
    G = np.vstack([offsets.T, np.full((1, k), -1.0)])
    found = kernel.cone_rays(G, np.append(np.zeros(n), 1.0), False, _MOST)
    if found is None or not found[2] > _APART:
        return None
    rays, simplices, _ = found
    rows = rays / np.linalg.norm(rays[:, :-1], axis=1, keepdims=True)
    rows[:, -1] = -rows[:, -1] - rows[:, :-1] @ middle
    return rows, simplices
