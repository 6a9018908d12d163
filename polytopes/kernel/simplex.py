"""Compiled dense primal simplex for many small programs over one polytope.

The program is ``max c'x`` subject to ``A x <= b`` with x free (the inequality form), for few variables and many rows.
A basis is a set of d active rows; a slot of the basis may instead hold an *artificial* row ``x_j`` free, which leaves
as soon as it has a price.  The inverse of the active rows is kept as a dense d x d array whose k-th row is the edge
that opens when the k-th active row is released.

Pricing is exact steepest edge; the ratio test is Harris' (two passes, largest pivot), with Bland's rule after a run of
degenerate steps.  A finished vertex is recomputed from its active rows, and small infeasibilities left by the Harris
tolerance are removed by dual simplex steps, so that an optimum is a true vertex, not one displaced by a tolerance.

Rows arrive scaled by powers of two, with Euclidean norms in [1/2, 2), and transposed: ``AT`` is (d, m), so that the
loops over rows are contiguous.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Index = NDArray[np.int64]

OPTIMAL, STOPPED, UNBOUNDED, AMBIGUOUS, LIMIT = 0, 1, 2, 3, 4

_PIVOT = 1e-9  # rates below are masked before the ratio test
_RAY = 1e-13  # no rate above this: the edge is a ray
_PRICE = 1e-14  # relative reduced cost that still counts as zero
_CERTAIN = 1e-11  # relative reduced cost below which a ray may be an effect of rounding
_HARRIS = 1e-11  # ratio-test tolerance, relative to the size of b
_REFACTOR = 40  # pivots between two fresh inverses
EPS = 2.220446049250313e-16
FAST = {"nnan", "nsz", "reassoc", "contract"}


@njit(error_model="numpy", fastmath=FAST)
def slacks(AT: Matrix, b: Vector, x: Vector, s: Vector) -> None:
    """s = b - A x."""
    d, m = AT.shape
    for i in range(m):  # an assignment of arrays would cost more than the rest
        s[i] = b[i]
    for j in range(d):
        xj = x[j]
        for i in range(m):
            s[i] -= AT[j, i] * xj


@njit(error_model="numpy", fastmath=FAST)
def _settle(AT: Matrix, b: Vector, x: Vector, s: Vector, W: Index, Q: Matrix) -> None:
    """One Newton step of x onto its active rows, then fresh slacks."""
    d = x.shape[0]
    for k in range(d):
        i = W[k]
        if i >= 0:
            residual = b[i]
            for j in range(d):
                residual -= AT[j, i] * x[j]
            for j in range(d):
                x[j] += Q[k, j] * residual
    slacks(AT, b, x, s)
    for k in range(d):
        if W[k] >= 0:
            s[W[k]] = 0.0


@njit(error_model="numpy", fastmath=FAST)
def invert_basis(AT: Matrix, W: Index, Q: Matrix, work: Matrix) -> bool:
    """Q = inverse of the active rows, transposed (Gauss-Jordan, partial pivoting); False if singular."""
    d = W.shape[0]
    for k in range(d):
        for j in range(d):
            work[k, j] = AT[j, W[k]] if W[k] >= 0 else (1.0 if j == -1 - W[k] else 0.0)
            work[k, d + j] = 1.0 if j == k else 0.0
    for c in range(d):
        best = c
        for k in range(c + 1, d):
            if abs(work[k, c]) > abs(work[best, c]):
                best = k
        if abs(work[best, c]) < _RAY:
            return False
        if best != c:
            for j in range(2 * d):
                work[c, j], work[best, j] = work[best, j], work[c, j]
        inverse = 1.0 / work[c, c]
        for j in range(c, 2 * d):
            work[c, j] *= inverse
        for k in range(d):
            factor = work[k, c]
            if k != c and factor != 0.0:
                for j in range(c, 2 * d):
                    work[k, j] -= factor * work[c, j]
    for j in range(d):
        for k in range(d):
            Q[k, j] = work[j, d + k]
    return True


@njit(error_model="numpy", fastmath=FAST)
def _exchange(Q: Matrix, alpha: Vector, k: int) -> None:
    """Update the edges after the row with coordinates alpha (in the old basis) took slot k."""
    d = Q.shape[0]
    inverse = 1.0 / alpha[k]
    for j in range(d):
        Q[k, j] *= inverse
    for q in range(d):
        if q != k and alpha[q] != 0.0:
            factor = alpha[q]
            for j in range(d):
                Q[q, j] -= factor * Q[k, j]


@njit(error_model="numpy", fastmath=FAST)
def _coordinates(AT: Matrix, i: int, Q: Matrix, alpha: Vector) -> None:
    """alpha: row i as a combination of the active rows."""
    d = Q.shape[0]
    for k in range(d):
        total = 0.0
        for j in range(d):
            total += AT[j, i] * Q[k, j]
        alpha[k] = total


@njit(error_model="numpy", fastmath=FAST)
def _price(c: Vector, size: float, W: Index, Q: Matrix, y: Vector, bland: bool) -> int:
    """Multipliers y of the active rows and the slot to release (-1: optimal)."""
    d = W.shape[0]
    slot, best, first = -1, 0.0, np.int64(1) << 60
    for k in range(d):
        yk, square = 0.0, 0.0
        for j in range(d):
            yk += c[j] * Q[k, j]
            square += Q[k, j] * Q[k, j]
        y[k] = yk
        gain = abs(yk) if W[k] < 0 else -yk
        if gain > _PRICE * size * np.sqrt(square):
            if bland:
                if W[k] < first:
                    first, slot = W[k], k
            else:
                merit = gain * gain / square * (1e6 if W[k] < 0 else 1.0)
                if merit > best:
                    best, slot = merit, k
    return slot


@njit(error_model="numpy", fastmath=FAST)
def _blocking_row(s: Vector, rate: Vector, tolerance: float, bland: bool) -> int:
    """Row that stops a move of rates `rate` (-1: none with a pivot above the mask)."""
    m = s.shape[0]
    steepest = 0.0
    for i in range(m):
        a = rate[i] if rate[i] > _PIVOT else 0.0
        steepest = max(steepest, a / (max(s[i], 0.0) + tolerance))
    if steepest <= 0.0:
        return -1
    step = 1.0 / steepest
    if bland:
        for i in range(m):
            if rate[i] > _PIVOT and s[i] <= step * rate[i]:
                return i
    pivot = 0.0
    for i in range(m):
        pivot = max(pivot, rate[i] if s[i] <= step * rate[i] else 0.0)
    for i in range(m):
        if rate[i] == pivot and s[i] <= step * rate[i]:
            return i
    return -1


@njit(error_model="numpy", fastmath=FAST)
def ascend(
    AT: Matrix, b: Vector, c: Vector, x: Vector, s: Vector, W: Index, Q: Matrix, y: Vector, scale: float, stop: float
) -> int:
    """Primal simplex from the feasible state (x, s, W, Q); leaves the multipliers in y."""
    d, m = AT.shape
    p, alpha, rate = np.empty(d), np.empty(d), np.empty(m)
    size = 0.0
    for j in range(d):
        size += c[j] * c[j]
    size = np.sqrt(size)
    degenerate, age = 0, 0
    for _ in range(50 * (d + 1) + m):
        value = 0.0
        for j in range(d):
            value += c[j] * x[j]
        if value > stop:
            return STOPPED
        bland = degenerate > 3 * d
        slot = _price(c, size, W, Q, y, bland)
        if slot < 0:
            return OPTIMAL
        sign = 1.0 if W[slot] < 0 and y[slot] > 0.0 else -1.0
        length = 0.0
        for j in range(d):
            length += Q[slot, j] * Q[slot, j]
        sign /= np.sqrt(length)
        for j in range(d):
            p[j] = sign * Q[slot, j]
        for i in range(m):
            rate[i] = AT[0, i] * p[0]
        for j in range(1, d):
            pj = p[j]
            for i in range(m):
                rate[i] += AT[j, i] * pj
        for k in range(d):
            if W[k] >= 0:
                rate[W[k]] = 0.0
        row = _blocking_row(s, rate, _HARRIS * scale, bland)
        if row < 0:
            largest = 0.0
            for i in range(m):
                largest = max(largest, rate[i])
            certain = abs(y[slot]) > _CERTAIN * size * np.sqrt(length)
            return UNBOUNDED if largest <= _RAY and certain else AMBIGUOUS
        step = max(s[row], 0.0) / rate[row]
        degenerate = degenerate + 1 if step <= 1e-13 * scale else 0
        for j in range(d):
            x[j] += step * p[j]
        for i in range(m):
            s[i] -= step * rate[i]
        s[row] = 0.0
        _coordinates(AT, row, Q, alpha)
        _exchange(Q, alpha, slot)
        left = W[slot]
        W[slot] = row
        if left >= 0:
            slack = b[left]
            for j in range(d):
                slack -= AT[j, left] * x[j]
            s[left] = max(slack, 0.0)
        age += 1
        if age >= _REFACTOR:
            age = 0
            if not invert_basis(AT, W, Q, np.empty((d, 2 * d))):
                return LIMIT
            _settle(AT, b, x, s, W, Q)
    return LIMIT


@njit(error_model="numpy", fastmath=FAST)
def repair(AT: Matrix, b: Vector, x: Vector, s: Vector, W: Index, Q: Matrix, y: Vector, scale: float) -> int:
    """Dual simplex steps from an optimal basis whose vertex is infeasible by about the Harris tolerance."""
    d, m = AT.shape
    alpha = np.empty(d)
    for attempt in range(2 * d + 10):
        _settle(AT, b, x, s, W, Q)
        reach = scale
        for j in range(d):
            reach = max(reach, abs(x[j]))
        worst = 0.0
        for i in range(m):
            worst = min(worst, s[i])
        if worst >= -64.0 * EPS * reach:
            return OPTIMAL
        if attempt == d and not invert_basis(AT, W, Q, np.empty((d, 2 * d))):
            return LIMIT
        row = 0
        while s[row] != worst:
            row += 1
        _coordinates(AT, row, Q, alpha)
        slot, ratio = -1, np.inf
        for k in range(d):
            if W[k] < 0:
                if abs(alpha[k]) > _PIVOT:
                    slot, ratio = k, -1.0
            elif alpha[k] > _PIVOT and max(y[k], 0.0) < ratio * alpha[k]:
                slot, ratio = k, max(y[k], 0.0) / alpha[k]
        if slot < 0:
            return AMBIGUOUS
        theta = y[slot] / alpha[slot]
        for k in range(d):
            y[k] -= theta * alpha[k]
        y[slot] = theta
        _exchange(Q, alpha, slot)
        W[slot] = row
    return LIMIT


@njit(error_model="numpy", fastmath=FAST)
def optimise(
    AT: Matrix, b: Vector, c: Vector, x: Vector, s: Vector, W: Index, Q: Matrix, y: Vector, scale: float
) -> int:
    """Ascend, put the vertex exactly on its rows, remove the Harris slack."""
    status = ascend(AT, b, c, x, s, W, Q, y, scale, np.inf)
    if status == OPTIMAL:
        status = repair(AT, b, x, s, W, Q, y, scale)
    return status


@njit(error_model="numpy", fastmath=FAST)
def at_origin(x: Vector, W: Index, Q: Matrix) -> None:
    """Point and basis at the origin: every slot artificial."""
    d = x.shape[0]
    for j in range(d):
        x[j] = 0.0
        W[j] = -1 - j
        for k in range(d):
            Q[j, k] = 1.0 if j == k else 0.0


@njit(error_model="numpy", fastmath=FAST)
def start(AT: Matrix, b: Vector, x0: Vector, x: Vector, s: Vector, W: Index, Q: Matrix) -> None:
    """State at the feasible point x0: every slot artificial."""
    at_origin(x, W, Q)
    x[:] = x0
    slacks(AT, b, x, s)


@njit
def scale_of(b: Vector) -> float:
    """Size that tolerances refer to: the largest entry of b (1 for a cone)."""
    largest = 0.0
    for i in range(b.shape[0]):
        largest = max(largest, abs(b[i]))
    return largest if largest > 0.0 else 1.0
