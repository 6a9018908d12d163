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
    at_origin,
    invert_basis,
    repair,
    slacks,
)

_TOLERANCE = 1e-12  # of a row's slack at the inner point: growth that counts as none
_CLEAR = 1e-9  # of the slack: beyond, no vertex need be found (Harris' tolerance is 1e-11)
_BELOW = 1e-10  # violation, of the slack, that a point clearly outside a row may have of the others
_FLAT_ROW = 1e-6  # steepest entry of a row, of one elsewhere, below which a ray may be an effect of rounding
_CLARKSON_FROM = 24  # rows; below, one program per row is faster
_TOGETHER = 1e-9  # of the distance along a ray: two rows met this near each other
_CORNERS = 256  # vertices at which later programs may begin; a longer list costs more than it saves
_FRESH = 4  # programs that may pass a basis on before its inverse is computed anew
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


@njit(error_model="numpy")  # no reordering: it would reach into the precise slacks, once they are inlined
def centred(AT: Matrix, b: Vector, x0: Vector) -> tuple[Matrix, Vector, bool]:
    """The rows seen from x0, both scaled as above; False if x0 is not strictly inside."""
    d, m = AT.shape
    rows, rhs, value, terms = np.empty((d, m)), np.empty(m), b.copy(), np.abs(b)
    for j in range(d):
        for i in range(m):
            part = AT[j, i] * x0[j]
            value[i] -= part
            terms[i] += abs(part)
    for i in range(m):
        if (d + 2) * EPS * terms[i] > 1e-14 * value[i]:
            value[i] = _precise_slack(AT, b, x0, i)
        if value[i] <= 0.0:
            return rows, rhs, False
        rhs[i], exponent = math.frexp(value[i])
        value[i] = math.ldexp(1.0, -exponent)
    for j in range(d):
        steepest = 0.0
        for i in range(m):
            rows[j, i] = AT[j, i] * value[i]
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
def _exceeds(AT: Matrix, b: Vector, c: Vector, slack: float, x: Vector, W: Index, Q: Matrix) -> int:
    """Whether ``c'x`` exceeds ``(1 + 1e-12) slack`` in the centred set.

    The ascent begins at the basis W with inverse Q and its point x, and leaves those where it ended: a point that does
    exceed it, or an optimum.
    """
    d, m = AT.shape
    s, y = np.empty(m), np.empty(d)
    slacks(AT, b, x, s)
    for k in range(d):
        if W[k] >= 0:
            s[W[k]] = 0.0
    status = ascend(AT, b, c, x, s, W, Q, y, 1.0, slack * (1.0 + _CLEAR))
    if status == STOPPED:
        return _YES if s.min() > -_BELOW else _DOUBT  # a row whose rate was masked may lie behind
    if status == UNBOUNDED:
        for j in range(d):
            x[j] = c[j]
        return _YES if _even(AT) else _DOUBT
    if status != OPTIMAL:
        return _DOUBT
    bound, value = 0.0, 0.0
    for k in range(d):
        value += c[k] * x[k]
        if W[k] >= 0:
            bound += y[k] * b[W[k]]
    if abs(bound - value) < _CLEAR * slack and bound + _rounding(AT, b, c, x, W, y) < slack * (1.0 - 2.0 * _CLEAR):
        return _NO  # by duality
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
    relaxed, x, c = b.copy(), np.empty(d), np.empty(d)
    W, Q = np.empty(d, np.int64), np.empty((d, d))
    for i in np.flatnonzero(asked):
        relaxed[i] = b[i] + 1.0
        for j in range(d):
            c[j] = AT[j, i]
        at_origin(x, W, Q)
        answer = _exceeds(AT, relaxed, c, b[i], x, W, Q)
        relaxed[i] = b[i]
        if answer == _NO:
            keep[i] = 0
            relaxed[i] = 1e3
        elif answer == _DOUBT:
            doubtful[i] = 1
    return keep, doubtful


@njit(error_model="numpy", fastmath=FAST)
def _first_hit(AT: Matrix, reach: Vector, p: Vector, rate: Vector) -> tuple[int, bool]:
    """Row that the ray from the origin along p meets first (-1: none), and whether another is met about there.

    `reach` holds the reciprocals of the slacks; `rate` is overwritten.
    """
    d, m = AT.shape
    for i in range(m):
        rate[i] = AT[0, i] * p[0]
    for j in range(1, d):
        pj = p[j]
        for i in range(m):
            rate[i] += AT[j, i] * pj
    steepest = 0.0
    for i in range(m):
        rate[i] *= reach[i]
        steepest = max(steepest, rate[i])
    if steepest <= 0.0:
        return -1, True
    row, met, least = -1, 0, steepest * (1.0 - _TOGETHER)
    for i in range(m):
        met += 1 if rate[i] >= least else 0
    for i in range(m):
        if rate[i] == steepest:
            row = i
            break
    return row, met > 1


@njit(error_model="numpy", fastmath=FAST)
def _best_corner(corners: Matrix, count: int, c: Vector) -> int:
    """The stored vertex that is farthest along c (-1: none is farther than the origin)."""
    best, farthest = -1, 0.0
    for k in range(count):
        value = 0.0
        for j in range(c.shape[0]):
            value += corners[k, j] * c[j]
        if value > farthest:
            best, farthest = k, value
    return best


@njit(error_model="numpy")
def _copy(x: Vector, W: Index, Q: Matrix, to_x: Vector, to_W: Index, to_Q: Matrix) -> None:
    """A vertex, its basis and the inverse, entry by entry: assignments of arrays would cost more than a pivot."""
    d = x.shape[0]
    for j in range(d):
        to_x[j], to_W[j] = x[j], W[j]
        for k in range(d):
            to_Q[j, k] = Q[j, k]


@njit(error_model="numpy")
def _same(V: Index, W: Index) -> bool:
    """Whether two bases hold the same rows in the same slots."""
    same = True
    for k in range(W.shape[0]):
        same &= V[k] == W[k]
    return same


@njit(error_model="numpy", fastmath=FAST)
def _clarkson(AT: Matrix, b: Vector, known: Index) -> tuple[Index, Index]:
    """Programs only over rows already known to be facets; a violation finds a new facet by a ray (Clarkson 1994).

    Each program begins at the vertex, of those where earlier ones ended, that is farthest along its row.  Doubtful rows
    were not proved to be facets: a ray met several rows at once, or a program did not settle it.
    """
    d, m = AT.shape
    state = known.copy()  # 0 open, 1 kept, 2 redundant
    doubtful = np.zeros(m, np.int64)
    c, x, W, Q = np.empty(d), np.empty(d), np.empty(d, np.int64), np.empty((d, d))
    reach, rate, work = 1.0 / b, np.empty(m), np.empty((d, 2 * d))
    tries = 2 * d  # rays are worth their while as long as most of them find a facet
    for i in range(m):
        if state[i] == 0 and tries > 0:
            for j in range(d):
                c[j] = AT[j, i]
            row, tie = _first_hit(AT, reach, c, rate)
            if tie or state[row] != 0:
                tries -= 1
            else:
                state[row] = 1
                tries += 1
    facets, values = np.empty((d, m)), np.empty(m)
    n = 0
    for i in range(m):
        if state[i] == 1:
            for j in range(d):
                facets[j, n] = AT[j, i]
            values[n] = b[i]
            n += 1
    system, rhs = np.ascontiguousarray(facets[:, :n]), values[:n].copy()
    room = min(m, _CORNERS)
    corners, bases, inverses = np.empty((room, d)), np.empty((room, d), np.int64), np.empty((room, d, d))
    ages, count = np.zeros(room, np.int64), 0
    for i in range(m):
        if state[i] != 0:
            continue
        for j in range(d):
            c[j] = AT[j, i]
        while state[i] == 0:
            begin, age = _best_corner(corners, count, c), 0
            if begin < 0:
                at_origin(x, W, Q)
            else:
                _copy(corners[begin], bases[begin], inverses[begin], x, W, Q)
                age = ages[begin]
            answer = _exceeds(system, rhs, c, b[i], x, W, Q)
            if answer == _NO:
                state[i] = 2
                new = count < room and (begin < 0 or not _same(bases[begin], W))
                if new and (age < _FRESH or invert_basis(system, W, Q, work)):
                    _copy(x, W, Q, corners[count], bases[count], inverses[count])
                    ages[count] = age + 1 if age < _FRESH else 0
                    count += 1
                continue
            row, tie = i, True
            if answer == _YES:
                row, tie = _first_hit(AT, reach, x, rate)
            if tie or row < 0 or state[row] != 0:
                row = i
                doubtful[i] = 1
            state[row] = 1
            for j in range(d):
                facets[j, n] = AT[j, row]
            values[n] = b[row]
            n += 1
            system, rhs = np.ascontiguousarray(facets[:, :n]), values[:n].copy()
            for k in range(count - 1, -1, -1):  # vertices beyond the new facet are none
                value = 0.0
                for j in range(d):
                    value += corners[k, j] * AT[j, row]
                if value > b[row]:
                    count -= 1
                    _copy(corners[count], bases[count], inverses[count], corners[k], bases[k], inverses[k])
                    ages[k] = ages[count]
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
def irredundant(AT: Matrix, b: Vector, x0: Vector, known: Index) -> tuple[Index, Index]:
    """Numbers of a minimal set of rows, and for each whether it is doubtful; Clarkson's method if there are many rows.

    Parameters
    ----------
    AT, b : arrays (d, m) and (m,)
        Rows without zero rows, transposed.
    x0 : array (d,)
        A point strictly inside; if rounding cannot tell that it is, every row is doubtful.
    known : array (m,) of int
        1 for rows that are facets for sure.

    Returns
    -------
    rows, doubtful : arrays (k,) and (k,) of int
        A doubtful row is kept, and may be redundant.
    """
    chosen = _distinct(AT, b)
    rows, rhs, inside = centred(AT[:, chosen], b[chosen], x0)
    if not inside:
        return chosen, np.ones(chosen.size, np.int64)
    asked = 1 - known[chosen]
    if chosen.size >= _CLARKSON_FROM:
        keep, doubtful = _clarkson(rows, rhs, known[chosen])
        kept = np.flatnonzero(keep)
        if not doubtful.any():
            return chosen[kept], doubtful[kept]
        chosen, rows, rhs, asked = chosen[kept], np.ascontiguousarray(rows[:, kept]), rhs[kept], doubtful[kept]
    keep, doubtful = _one_by_one(rows, rhs, asked)
    kept = np.flatnonzero(keep)
    return chosen[kept], doubtful[kept]
