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
from polytopes.native import Address, Entries, Given, InCore, Integer, function, scratch

SHORT_RAYS = 2_000
"""Rays of the double description beyond which a set of short rows is left to floats, if they can decide."""

_COORDINATES = 16
_ROOM = 250  # rays for which there is room from the start
_NO_ROOM = -3  # why there is no answer yet

_short = function("fdi_short", *[Integer] * 2, *[Address] * 3, returns=Integer)
_short_unit = function("fdi_short_unit", Integer, Address, returns=Integer)
_vertices = function(
    "fdi_exact_vertices", *[Integer] * 2, *[Address] * 2, *[Integer] * 2, *[Entries] * 2, Address, returns=Integer
)
_hull = function("fdi_exact_hull", *[Integer] * 2, Given, *[Integer] * 2, Entries, Address, returns=Integer)
_vertices_room, _hull_room = (
    lru_cache(1024)(function(f"fdi_exact_{name}_room", *[Integer] * 3, returns=Integer)) for name in ("vertices", "set")
)


class Corners(NamedTuple):
    """Vertices (k, n) to the nearest floats, in lexicographic order, and whether none was rounded."""

    points: Floats
    exact: bool


def has_short_rows(rows: InCore) -> bool:
    """Whether all rows ``[A, b]`` are integers below 2^32, up to a factor."""
    return bool(_short(*rows, scratch(rows[0] + 1)))


def are_short(V: Floats) -> bool:
    """Whether all points (k, n), as rows ``[x, 1]``, are such."""
    k, n = V.shape
    return bool(_short(n, k, V.tobytes(), None, scratch(n + 1)))


def short_unit(V: Floats) -> int:
    """The exponent of a power of two of which points V are short multiples; 0 where they are short as they are."""
    return int(_short_unit(V.size, V.tobytes()))


def short_vertices(rows: InCore) -> Corners | None:
    """The vertices of ``A x <= b``; None if the set is not such."""
    said = np.zeros(2)
    points = _listed(rows, said)
    return None if points is None else Corners(points, bool(said[0]))


def short_volume(rows: InCore) -> float | None:
    """The volume of such a set, of simplices between its vertices; None if it is not one, or they are many."""
    said = np.ones(2)
    return said.item(1) if _listed(rows, said) is not None and said[1] >= 0.0 else None


def _listed(rows: InCore, said: Floats) -> Floats | None:
    n, m = rows[:2]
    if n > _COORDINATES or m <= n:
        return None

    def call(room: int, points: Floats) -> int:
        count: int = _vertices(*rows, SHORT_RAYS, room, points, said, scratch(_vertices_room(n, m, room)))
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
