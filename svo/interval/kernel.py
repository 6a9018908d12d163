"""Compiled recursion of the interval predictor, one sample and whole records.

All compiled functions stand in this one file: a cached machine code does not notice a change in another file.
"""

from __future__ import annotations

import numpy as np
from numba import njit

SLACK = 8 * float(np.finfo(float).eps)


@njit(cache=True)
def move(center, radius, u, gc, gr, hc, hr, slope, limit):  # type: ignore[no-untyped-def]
    """The interval after one transition, and the radius of g that it used (corrected Proposition 3).

    The radius is widened by ``SLACK`` times the size of what was added, so that it holds in spite of rounding, that
    of center +- radius by the caller included.
    """
    target = hc * u
    distance = abs(center - target)
    used = min(gr + slope * distance, limit)
    kept, driven = gc * center, (1.0 - gc) * target
    new = kept + driven
    wide = (abs(gc) + used) * radius + used * distance + (abs(1.0 - gc) + used) * hr * abs(u)
    size = abs(kept) + abs(driven) + used * (abs(center) + abs(target)) + abs(new)
    return new, wide + SLACK * (size + wide), used


@njit(cache=True)
def propagate(u, gc, gr, hc, hr, slope, limit, center, radius, used):  # type: ignore[no-untyped-def]
    """Fill center, radius (K,) from their first entries, and the radius of g used at each sample (K,).

    Returns the first sample at which ``|gc| + gr < 1`` fails, or -1. The last sample's transition is not made.
    """
    for k in range(u.size):
        new, wide, used[k] = move(center[k], radius[k], u[k], gc[k], gr[k], hc[k], hr[k], slope[k], limit[k])
        if k + 1 == u.size:
            break
        if not abs(gc[k]) + used[k] < 1.0:
            return k
        center[k + 1], radius[k + 1] = new, wide
    return -1
