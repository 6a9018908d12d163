"""Bounded full-dimensional sets of few bits, from floats to floats in one call of the core, exact throughout.

Where they are unbounded, flat or empty, or a number in between does not fit, there is no answer, and the general way
through integers of any size is taken (`minkowski_weyl`, `outward`).  See `core/polytopes/exact_sets.c`.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from polytopes.checks import Floats
from polytopes.double_description import MAX_RAYS
from polytopes.native import Address, Entries, Given, Integer, function, scratch

SHORT_RAYS = 2_000
"""Rays of the double description beyond which a set of short rows is left to floats, if they can decide."""

_COORDINATES = 16
_ROOM = 250  # rays for which there is room from the start
_NO_ROOM = -3  # why there is no answer yet

_vertices = function(
    "fdi_exact_vertices", *[Integer] * 2, *[Given] * 2, *[Integer] * 2, *[Entries] * 2, Address, returns=Integer
)
_hull = function("fdi_exact_hull", *[Integer] * 2, Given, *[Integer] * 2, Entries, Address, returns=Integer)
_vertices_room, _hull_room = (
    lru_cache(1024)(function(f"fdi_exact_{name}_room", *[Integer] * 3, returns=Integer)) for name in ("vertices", "set")
)


class Corners(NamedTuple):
    """Vertices (k, n) to the nearest floats, in lexicographic order, and whether none was rounded."""

    points: Floats
    exact: bool


def short_vertices(A: Floats, b: Floats) -> Corners | None:
    """The vertices of ``A x <= b``; None if the set is not such."""
    said = np.zeros(2)
    points = _listed(A, b, said)
    return None if points is None else Corners(points[np.lexsort(points.T[::-1])], bool(said[0]))


def short_volume(A: Floats, b: Floats) -> float | None:
    """The volume of such a set, of simplices between its vertices; None if it is not one, or they are many."""
    said = np.ones(2)
    return said.item(1) if _listed(A, b, said) is not None and said[1] >= 0.0 else None


def _listed(A: Floats, b: Floats, said: Floats) -> Floats | None:
    m, n = A.shape
    if n > _COORDINATES or m <= n:
        return None

    def call(room: int, points: Floats) -> int:
        block = scratch(_vertices_room(n, m, room))
        count: int = _vertices(n, m, A, b, SHORT_RAYS, room, points, said, block)
        return count

    return _with_room(call, n)


def short_hull(V: Floats) -> Floats | None:
    """Minimal rows ``[A, b]`` (f, n + 1) of the hull of points (k, n), exact; None if the points are not such."""
    k, n = V.shape
    if k <= n:
        return None
    block = _hull_room
    return _with_room(lambda room, rows: _hull(n, k, V, MAX_RAYS, room, rows, scratch(block(n, k, room))), n + 1)


def _with_room(call: Callable[[int, Any], int], width: int) -> Floats | None:
    """What a call finds, given room for as many rays as it needs."""
    room = _ROOM
    while True:
        found: Any = np.empty((room, width))
        count = call(room, found)
        if count != _NO_ROOM:
            return found[:count] if count >= 0 else None
        room *= 4
