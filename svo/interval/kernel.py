"""Recursion of the interval predictor, one sample and whole records: the face of `core/interval`."""

from __future__ import annotations

import ctypes
from typing import Any

from polytopes.native import Entries, Given, Integer, Real, floats, function
from svo.checks import Array


class _Moved(ctypes.Structure):
    _fields_ = (("center", Real), ("radius", Real), ("used", Real))


_move = function("fdi_interval_move", *[Real] * 9, returns=_Moved)
_propagate = function("fdi_interval_propagate", Integer, *[Given] * 7, *[Entries] * 3, returns=Integer)


def move(center: float, radius: float, u: float, *gains: Any) -> tuple[float, float, float]:
    """The interval after one transition, and the radius of g that it used (corrected Proposition 3).

    The gains are gc, gr, hc, hr, slope and limit, numbers each. The radius is widened by some units of rounding of what
    was added, so that it holds in spite of rounding, that of center +- radius by the caller included.
    """
    moved = _move(center, radius, u, *gains)
    return moved.center, moved.radius, moved.used


def propagate(
    u: Array, gc: Array, gr: Array, hc: Array, hr: Array, slope: Array, limit: Array, center: Array, radius: Array,
    used: Array,
) -> int:  # fmt: skip
    """Fill center, radius (K,) from their first entries, and the radius of g used at each sample (K,).

    Returns the first sample at which ``|gc| + gr < 1`` fails, or -1. The last sample's transition is not made.
    """
    given = [floats(array) for array in (u, gc, gr, hc, hr, slope, limit)]
    return int(_propagate(u.size, *given, center, radius, used))
