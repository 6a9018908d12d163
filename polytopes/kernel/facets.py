"""Which rows of a full-dimensional set are facets: one program per row, or Clarkson's method.

The set is looked at from a point strictly inside: the origin moves there (slacks in twice the working precision), rows
are scaled so that the origin's slack is about one, and coordinates so that the steepest entry is.  All of it by powers
of two, so a set with axes of different scales needs no tolerance of its own.  A row is redundant if the others keep it
below ``1 + 1e-12`` times its slack: what is dropped lets the set grow by a factor of ``1 + 1e-12`` about that point,
whatever its shape.  Each optimum comes with a bound of its rounding error; rows that it leaves open are doubtful.
"""

import math

import numpy as np
from numba import njit

from polytopes.kernel.simplex import (
    EPS,
    FAST,
    OPTIMAL,
    STOPPED,
    UNBOUNDED,
    Index,
    Matrix,
    Vector,
    ascend,
    repair,
    start,
)

_TOLERANCE = 1e-12  # of a row's slack at the inner point: growth that counts as none
_CLEAR = 1e-9  # of the slack: beyond, no vertex need be found (Harris' tolerance is 1e-11)
_BELOW = 1e-10  # violation, of the slack, that a point clearly outside a row may have of the others
_FLAT_ROW = 1e-6  # steepest entry of a row, of one elsewhere, below which a ray may be an effect of rounding
_CLARKSON_FROM = 24  # rows; below, one program per row is faster
_WALK_UP_TO = 64  # rows; beyond, the programs over facets alone cost less than further steps among all rows
_SPLIT = 134217729.0  # 2^27 + 1, halves a float (Dekker 1971)
_NO, _YES, _DOUBT = 0, 1, 2


@njit(error_model="numpy")  # no reordering: the errors of the operations are computed
def _precise_slack(AT: Matrix, b: Vector, x: Vector, i: int) -> float:
    """``b_i - a_i'x`` as if in twice the precision (Ogita, Rump and Oishi 2005)."""
    total, lost = b[i], 0.0
    for j in range(x.shape[0]):
        u, v = -AT[j, i], x[j]
        product = u * v
        big = _SPLIT * u
        u1 = big - (big - u)
        big = _SPLIT * v
        v1 = big - (big - v)
        u2, v2 = u - u1, v - v1
        lost += u2 * v2 - (((product - u1 * v1) - u2 * v1) - u1 * v2)
        moved = total + product
        part = moved - total
        lost += (total - (moved - part)) + (product - part)
        total = moved
    return total + lost


@njit(error_model="numpy", fastmath=FAST)
def centred(AT: Matrix, b: Vector, x0: Vector) -> tuple[Matrix, Vector, bool]:
    """The rows seen from x0, both scaled as above; False if x0 is not strictly inside."""
    d, m = AT.shape
    rows, rhs = np.empty((d, m)), np.empty(m)
    for i in range(m):
        value, terms = b[i], abs(b[i])
        for j in range(d):
            value -= AT[j, i] * x0[j]
            terms += abs(AT[j, i] * x0[j])
        if (d + 2) * EPS * terms > 1e-14 * value:
            value = _precise_slack(AT, b, x0, i)
        if value <= 0.0:
            return rows, rhs, False
        slack, exponent = math.frexp(value)
        rhs[i] = slack
        factor = math.ldexp(1.0, -exponent)
        for j in range(d):
            rows[j, i] = AT[j, i] * factor
    for j in range(d):
        steepest = 0.0
        for i in range(m):
            steepest = max(steepest, abs(rows[j, i]))
        if steepest > 0.0:
            factor = math.ldexp(1.0, -math.frexp(steepest)[1])
            for i in range(m):
                rows[j, i] *= factor
    return rows, rhs, True


@njit(error_model="numpy", fastmath=FAST)
def _rounding(AT: Matrix, b: Vector, c: Vector, x: Vector, W: Index, y: Vector) -> float:
    """Bound of the rounding error of the optimum ``c'x``: that of each active row times its multiplier, and its own."""
    d = x.shape[0]
    total = 0.0
    for j in range(d):
        total += abs(c[j] * x[j])
    for k in range(d):
        if W[k] >= 0:
            terms = b[W[k]]
            for j in range(d):
                terms += abs(AT[j, W[k]] * x[j])
            total += abs(y[k]) * terms
    return 4.0 * (d + 2) * EPS * total


@njit(error_model="numpy", fastmath=FAST)
def _even(AT: Matrix) -> bool:
    """Whether no row of the centred set is much flatter than others: no set far longer than it is wide."""
    for i in range(AT.shape[1]):
        steepest = 0.0
        for j in range(AT.shape[0]):
            steepest = max(steepest, abs(AT[j, i]))
        if steepest < _FLAT_ROW:
            return False
    return True


@njit(error_model="numpy", fastmath=FAST)
def _exceeds(AT: Matrix, b: Vector, c: Vector, slack: float, x: Vector, origin: Vector) -> int:
    """Whether ``c'x`` exceeds ``(1 + 1e-12) slack`` in the centred set; x is such a point unless it is unbounded."""
    d, m = AT.shape
    s, y, W, Q = np.empty(m), np.empty(d), np.empty(d, np.int64), np.empty((d, d))
    start(AT, b, origin, x, s, W, Q)
    status = ascend(AT, b, c, x, s, W, Q, y, 1.0, slack * (1.0 + _CLEAR))
    if status == STOPPED:
        return _YES if s.min() > -_BELOW else _DOUBT  # a row whose rate was masked may lie behind
    if status == UNBOUNDED:
        for j in range(d):
            x[j] = c[j]
        return _YES if _even(AT) else _DOUBT
    if status != OPTIMAL:
        return _DOUBT
    bound = 0.0
    for k in range(d):
        if W[k] >= 0:
            bound += y[k] * b[W[k]]
    if bound + _rounding(AT, b, c, x, W, y) < slack * (1.0 - _CLEAR):  # by duality
        return _NO
    if repair(AT, b, x, s, W, Q, y, 1.0) != OPTIMAL:
        return _DOUBT
    over = -slack * (1.0 + _TOLERANCE)
    for j in range(d):
        over += c[j] * x[j]
    error = _rounding(AT, b, c, x, W, y) + (d + 2) * EPS * slack
    return _YES if over > error else (_NO if over < -error else _DOUBT)


@njit(error_model="numpy", fastmath=FAST)
def _one_by_one(AT: Matrix, b: Vector, asked: Index) -> tuple[Index, Index]:
    """One program per row that is asked for, against all rows still kept, that row relaxed."""
    d, m = AT.shape
    keep, doubtful = np.ones(m, np.int64), np.zeros(m, np.int64)
    relaxed, x, c, origin = b.copy(), np.empty(d), np.empty(d), np.zeros(d)
    for i in np.flatnonzero(asked):
        relaxed[i] = b[i] + 1.0
        for j in range(d):
            c[j] = AT[j, i]
        answer = _exceeds(AT, relaxed, c, b[i], x, origin)
        relaxed[i] = b[i]
        if answer == _NO:
            keep[i] = 0
            relaxed[i] = 1e3
        elif answer == _DOUBT:
            doubtful[i] = 1
    return keep, doubtful


@njit(error_model="numpy", fastmath=FAST)
def _first_hit(AT: Matrix, b: Vector, p: Vector) -> tuple[int, bool]:
    """Row that the ray from the origin along p meets first (-1: none), and whether another is met about there."""
    d, m = AT.shape
    row, first, second = -1, np.inf, np.inf
    for i in range(m):
        rate = 0.0
        for j in range(d):
            rate += AT[j, i] * p[j]
        if rate * first > b[i]:
            row, first, second = i, b[i] / rate, first
        elif rate * second > b[i]:
            second = b[i] / rate
    return row, second <= first * (1.0 + 1e-9)


@njit(error_model="numpy", fastmath=FAST)
def _walk(AT: Matrix, b: Vector, i: int, state: Index, basis: Matrix, s: Vector) -> None:
    """Mark as kept the rows that a walk from the origin towards row i meets, each alone: they are facets.

    It goes along the row's normal, then within the facets it has met, as long as the next one is met by itself.
    """
    d, m = AT.shape
    p = np.empty(d)
    for q in range(m):
        s[q] = b[q]
    for met in range(d if m <= _WALK_UP_TO else 1):
        length = 0.0
        for j in range(d):
            p[j] = AT[j, i]
            length += p[j] * p[j]
        for k in range(met):
            along = 0.0
            for j in range(d):
                along += p[j] * basis[k, j]
            for j in range(d):
                p[j] -= along * basis[k, j]
        square = 0.0
        for j in range(d):
            square += p[j] * p[j]
        if square <= 1e-6 * length:
            return
        row, step, second = -1, np.inf, np.inf
        for q in range(m):
            rate = 0.0
            for j in range(d):
                rate += AT[j, q] * p[j]
            if rate * step > s[q]:
                row, step, second = q, s[q] / rate, step
            elif rate * second > s[q]:
                second = s[q] / rate
        if row < 0 or second <= step * (1.0 + 1e-6) or step <= 0.0:
            return
        state[row] = 1
        if row == i:
            return
        for q in range(m):
            rate = 0.0
            for j in range(d):
                rate += AT[j, q] * p[j]
            s[q] -= step * rate
        s[row] = np.inf  # the walk stays on it
        square = 0.0
        for j in range(d):
            basis[met, j] = AT[j, row]
        for k in range(met):
            along = 0.0
            for j in range(d):
                along += basis[met, j] * basis[k, j]
            for j in range(d):
                basis[met, j] -= along * basis[k, j]
        for j in range(d):
            square += basis[met, j] * basis[met, j]
        if square <= 1e-6:
            return
        inverse = 1.0 / np.sqrt(square)
        for j in range(d):
            basis[met, j] *= inverse


@njit(error_model="numpy", fastmath=FAST)
def _clarkson(AT: Matrix, b: Vector) -> tuple[Index, Index]:
    """Programs only over rows already known to be facets; a violation finds a new facet by a ray (Clarkson 1994).

    Doubtful rows were not proved to be facets: a ray met several rows at once, or a program did not settle it.
    """
    d, m = AT.shape
    state = np.zeros(m, np.int64)  # 0 open, 1 kept, 2 redundant
    doubtful = np.zeros(m, np.int64)
    c, x, origin = np.empty(d), np.empty(d), np.zeros(d)
    basis, s = np.empty((d, d)), np.empty(m)
    for i in range(m):
        if state[i] == 0:
            _walk(AT, b, i, state, basis, s)
    facets, values = np.empty((d, m)), np.empty(m)
    n = 0
    for i in range(m):
        if state[i] == 1:
            facets[:, n] = AT[:, i]
            values[n] = b[i]
            n += 1
    system, rhs = np.ascontiguousarray(facets[:, :n]), values[:n].copy()
    for i in range(m):
        for j in range(d):
            c[j] = AT[j, i]
        while state[i] == 0:
            answer = _exceeds(system, rhs, c, b[i], x, origin)
            if answer == _NO:
                state[i] = 2
                continue
            row, tie = i, True
            if answer == _YES:
                row, tie = _first_hit(AT, b, x)
            if tie or row < 0 or state[row] != 0:
                row = i
                doubtful[i] = 1
            state[row] = 1
            facets[:, n] = AT[:, row]
            values[n] = b[row]
            n += 1
            system, rhs = np.ascontiguousarray(facets[:, :n]), values[:n].copy()
    keep = np.zeros(m, np.int64)
    for i in range(m):
        keep[i] = 1 if state[i] == 1 else 0
    return keep, doubtful


@njit(error_model="numpy")  # no reordering: equal rows must have equal keys
def _distinct(AT: Matrix, b: Vector) -> Index:
    """Of rows whose normals are the same up to a power of two, the tightest."""
    d, m = AT.shape
    key, normals, rhs = np.empty(m), np.empty((m, d)), np.empty(m)
    for i in range(m):
        largest = 0.0
        for j in range(d):
            largest = max(largest, abs(AT[j, i]))
        factor = math.ldexp(1.0, -math.frexp(largest)[1])
        rhs[i] = b[i] * factor
        key[i] = 0.0
        for j in range(d):
            normals[i, j] = AT[j, i] * factor
            key[i] += normals[i, j] * math.sqrt(j + 2.0)
    order = np.argsort(key)
    keep = np.ones(m, np.int64)
    for k in range(m):
        i, q = order[k], k - 1
        while q >= 0 and key[order[q]] == key[i]:
            other = order[q]
            if keep[other] == 1 and (normals[i] == normals[other]).all():
                keep[other if (rhs[i], i) < (rhs[other], other) else i] = 0
                break
            q -= 1
    return np.flatnonzero(keep)


@njit(error_model="numpy", fastmath=FAST)
def irredundant(AT: Matrix, b: Vector, x0: Vector) -> tuple[Index, Index]:
    """Numbers of a minimal set of rows, and for each whether it is doubtful; Clarkson's method if there are many rows.

    Parameters
    ----------
    AT, b : arrays (d, m) and (m,)
        Rows without zero rows, transposed.
    x0 : array (d,)
        A point strictly inside; if rounding cannot tell that it is, every row is doubtful.

    Returns
    -------
    rows, doubtful : arrays (k,) and (k,) of int
        A doubtful row is kept, and may be redundant.
    """
    chosen = _distinct(AT, b)
    rows, rhs, inside = centred(AT[:, chosen], b[chosen], x0)
    if not inside:
        return chosen, np.ones(chosen.size, np.int64)
    asked = np.ones(chosen.size, np.int64)
    if chosen.size >= _CLARKSON_FROM:
        keep, doubtful = _clarkson(rows, rhs)
        kept = np.flatnonzero(keep)
        if not doubtful.any():
            return chosen[kept], doubtful[kept]
        chosen, rows, rhs, asked = chosen[kept], np.ascontiguousarray(rows[:, kept]), rhs[kept], doubtful[kept]
    keep, doubtful = _one_by_one(rows, rhs, asked)
    kept = np.flatnonzero(keep)
    return chosen[kept], doubtful[kept]
