"""Bounds of the optima of linear programs that hold whatever was rounded: weak duality in twice the working precision.

For x with ``A x <= b`` and multipliers y >= 0, ``c'x <= y'b + |c - A'y|'|x|``.  The multipliers of a basis are refined
by one Newton step and kept as sums of two floats; both terms come as upper bounds of their exact values.  Where nothing
is rounded on the way (integers, short fractions) nothing is added: the bound is the optimum.
"""

import numpy as np
from numba import njit

from polytopes.kernel.simplex import EPS, Index, Matrix, Vector

_SPLIT = 134217729.0  # 2^27 + 1, halves a float (Dekker 1971)
_UNDERFLOW = 1e-290  # products below may lose what rounding left; numbers come scaled to about one
_TINY = 1e-300


@njit(error_model="numpy")
def _two_sum(u: float, v: float) -> tuple[float, float]:
    """The sum as a float, and what was rounded off (Knuth)."""
    total = u + v
    part = total - u
    return total, (u - (total - part)) + (v - part)


@njit(error_model="numpy")
def _two_product(u: float, v: float) -> tuple[float, float]:
    """The product as a float, and what was rounded off (Dekker)."""
    product = u * v
    big = _SPLIT * u
    u1 = big - (big - u)
    big = _SPLIT * v
    v1 = big - (big - v)
    u2, v2 = u - u1, v - v1
    return product, u2 * v2 - (((product - u1 * v1) - u2 * v1) - u1 * v2)


@njit(error_model="numpy")
def _add_product(total: float, lost: float, error: float, u: float, v: float) -> tuple[float, float, float]:
    """Adds ``u v`` to ``total + lost``; `error` bounds what even that sum leaves out (Ogita, Rump and Oishi 2005)."""
    if u == 0.0 or v == 0.0:
        return total, lost, error
    product, rest = _two_product(u, v)
    total, off = _two_sum(total, product)
    rest += off
    if rest != 0.0:
        lost += rest
        error += 2.0 * EPS * (abs(rest) + abs(lost))
    if abs(product) < _UNDERFLOW:
        error += _TINY
    return total, lost, error


@njit(error_model="numpy")
def _upper(total: float, lost: float, error: float) -> tuple[float, float]:
    """A float that is at least ``total + lost + error``, `total` where nothing was lost, and by how much at least."""
    if lost == 0.0 and error == 0.0:
        return total, 0.0
    value, rest = _two_sum(total, lost)
    over = rest + error * (1.0 + 4.0 * EPS)
    if over <= 0.0:
        return value, -over
    return np.nextafter(value + over, np.inf), 0.0


@njit(error_model="numpy")
def dual_bound(AT: Matrix, b: Vector, c: Vector, W: Index, Q: Matrix, y: Vector, beside: Vector) -> tuple[float, float]:
    """Upper bound of ``y'b`` with refined multipliers, and by how much at least it is one.

    Leaves upper bounds of ``|c - A'y|`` in `beside` (d,).

    Parameters
    ----------
    W, Q, y : arrays (d,), (d, d) and (d,)
        Active rows, the inverse of their matrix, and their multipliers; these are refined.
    """
    d = c.shape[0]
    high, low, off = np.zeros(d), np.zeros(d), np.zeros(d)
    for k in range(d):
        high[k] = y[k] if W[k] >= 0 and y[k] > 0.0 else 0.0
    for j in range(d):
        total, lost, error = c[j], 0.0, 0.0
        for k in range(d):
            if W[k] >= 0:
                total, lost, error = _add_product(total, lost, error, -high[k], AT[j, W[k]])
        off[j] = total + lost
    for k in range(d):
        if W[k] >= 0:
            for j in range(d):
                low[k] += Q[k, j] * off[j]
            if high[k] + low[k] <= 0.0:
                high[k], low[k] = 0.0, 0.0
            high[k], low[k] = _two_sum(high[k], low[k])
        y[k] = high[k]
    total, lost, error = 0.0, 0.0, 0.0
    for k in range(d):
        if W[k] >= 0:
            total, lost, error = _add_product(total, lost, error, high[k], b[W[k]])
            total, lost, error = _add_product(total, lost, error, low[k], b[W[k]])
    value, spare = _upper(total, lost, error)
    for j in range(d):
        total, lost, error = c[j], 0.0, 0.0
        for k in range(d):
            if W[k] >= 0:
                total, lost, error = _add_product(total, lost, error, -high[k], AT[j, W[k]])
                total, lost, error = _add_product(total, lost, error, -low[k], AT[j, W[k]])
        beside[j] = max(_upper(total, lost, error)[0], _upper(-total, -lost, error)[0], 0.0)
    return value, spare
