"""The dead-zone residual and its first-order filter (paper 001, equations (18), (8) and (9))."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array, expect, finite_array, is_finite_number, readings


def dead_zone(y: ArrayLike, lower: ArrayLike, upper: ArrayLike) -> Array:
    """What of y lies outside [lower, upper] (18): y - upper above it, y - lower below it, zero inside.

    Arrays broadcast; NaN in y stays NaN.
    """
    values = readings("y", y)
    return values - np.clip(values, finite_array("lower", lower), finite_array("upper", upper))


def first_order_filter(signal: ArrayLike, pole: float) -> Array:
    """e_k = a e_(k-1) + (1 - a) r_k with e_0 = r_0 (the start that Corollary 2 needs).

    Parameters
    ----------
    signal : (K,) array
        r. Where it is NaN (no measurement) the filter keeps its value; NaN before the first number.
    pole : float
        a, 0 <= a < 1; zero is no filter.

    Returns
    -------
    (K,) array
    """
    from scipy.signal import lfilter

    values = readings("signal", signal, ("K",))
    check_pole(pole)
    known = ~np.isnan(values)
    r = values[known]
    if not r.size:
        return values.copy()
    rest = lfilter([1 - pole], [1.0, -pole], r[1:], zi=[pole * r[0]])[0]  # the recursion's own operations, to the bit
    filtered = np.append(r[0], rest)
    count = np.cumsum(known)
    return np.where(count > 0, filtered[np.maximum(count - 1, 0)], np.nan)


def check_pole(pole: float) -> None:
    """Raise a ValueError for a pole outside [0, 1)."""
    expect(is_finite_number(pole) and 0 <= pole < 1, "pole", pole, "0 <= pole < 1")
