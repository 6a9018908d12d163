"""The two programs of one set of rows: a largest ball, and support points in many directions."""

import numpy as np
from numba import njit

from polytopes.kernel.duality import dual_bound
from polytopes.kernel.simplex import AMBIGUOUS, FAST, LIMIT, OPTIMAL, Index, Matrix, Vector, optimise, scale_of, start


@njit(error_model="numpy", fastmath=FAST)
def interior(AT: Matrix, b: Vector, norms: Vector, x0: Vector, cap: float) -> tuple[Vector, float, int, Vector]:
    """Largest ball ``a_i'x + |a_i| r <= b_i`` with ``r <= cap``.

    Parameters
    ----------
    AT, b : arrays (d, m) and (m,)
        Scaled rows, transposed.
    norms : array (m,)
        Euclidean norms of the rows.
    x0 : array (d,)
        Any starting point; it need not be feasible.
    cap : float
        Upper limit of the radius; keeps the program bounded on unbounded sets.

    Returns
    -------
    x, r, status, multipliers
        Centre (d,), radius (negative if the rows have no common point), status, and multipliers of the rows (m,).
        With r < 0 they combine the rows to ``0'x <= r``: Farkas' multipliers.
    """
    d, m = AT.shape
    lifted = np.empty((d + 1, m + 1))
    lifted[:d, :m] = AT
    lifted[d, :m] = norms
    lifted[:d, m] = 0.0
    lifted[d, m] = 1.0
    rhs = np.empty(m + 1)
    rhs[:m] = b
    rhs[m] = cap
    x, s, y = np.empty(d + 1), np.empty(m + 1), np.zeros(d + 1)
    W, Q = np.empty(d + 1, np.int64), np.empty((d + 1, d + 1))
    origin = np.zeros(d + 1)
    origin[:d] = x0
    start(lifted, rhs, origin, x, s, W, Q)
    radius = cap
    for i in range(m):
        radius = min(radius, s[i] / norms[i])
    origin[d] = radius
    start(lifted, rhs, origin, x, s, W, Q)
    c = np.zeros(d + 1)
    c[d] = 1.0
    status = optimise(lifted, rhs, c, x, s, W, Q, y, scale_of(b))
    weights = np.zeros(m)
    for k in range(d + 1):
        if 0 <= W[k] < m:
            weights[W[k]] = y[k]
    return x[:d].copy(), float(x[d]), status, weights


@njit(error_model="numpy", fastmath=FAST)
def _nearest_order(directions: Matrix) -> Index:
    """Greedy chain through the directions by angle, so that neighbours share most of their basis."""
    k, d = directions.shape
    order = np.arange(k)
    if k > 128:
        return order
    units = np.empty((k, d))
    for i in range(k):
        square = 0.0
        for j in range(d):
            square += directions[i, j] * directions[i, j]
        inverse = 1.0 / np.sqrt(square) if square > 0.0 else 0.0
        for j in range(d):
            units[i, j] = directions[i, j] * inverse
    for i in range(1, k):
        best, cosine = i, -2.0
        for q in range(i, k):
            total = 0.0
            for j in range(d):
                total += units[order[i - 1], j] * units[order[q], j]
            if total > cosine:
                best, cosine = q, total
        order[i], order[best] = order[best], order[i]
    return order


@njit(error_model="numpy")  # no reordering: it would reach into the bounds, whose rounding errors are computed
def supports(
    AT: Matrix, b: Vector, x0: Vector, directions: Matrix
) -> tuple[Matrix, Index, Matrix, Vector, Vector, Matrix, Index]:
    """Support points in k directions, each program started from the vertex of its neighbour.

    Parameters
    ----------
    AT, b : arrays (d, m) and (m,)
        Scaled rows, transposed.
    x0 : array (d,)
        A feasible point.
    directions : array (k, d)

    Returns
    -------
    points, active, multipliers, bounds, spare, beside, status
        Arrays (k, d), (k, d), (k, d), (k,), (k,), (k, d), (k,).  All but the last mean something only where the status
        is `OPTIMAL`: then ``c'x <= bounds - spare + beside'|x|`` for all x of the set (see `dual_bound`).
    """
    d, m = AT.shape
    k = directions.shape[0]
    points = np.empty((k, d))
    active, multipliers, status = np.empty((k, d), np.int64), np.zeros((k, d)), np.empty(k, np.int64)
    bounds, spare, beside = np.zeros(k), np.zeros(k), np.zeros((k, d))
    x, s, W, Q = np.empty(d), np.empty(m), np.empty(d, np.int64), np.empty((d, d))
    start(AT, b, x0, x, s, W, Q)
    scale = scale_of(b)
    for q in _nearest_order(directions):
        c, y = directions[q], multipliers[q]
        status[q] = optimise(AT, b, c, x, s, W, Q, y, scale)
        points[q] = x
        active[q] = W
        if status[q] == OPTIMAL:
            bounds[q], spare[q] = dual_bound(AT, b, c, W, Q, y, beside[q])
        if status[q] in (LIMIT, AMBIGUOUS):
            start(AT, b, x0, x, s, W, Q)
    return points, active, multipliers, bounds, spare, beside, status
