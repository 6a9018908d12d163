"""Units in which rows are about even: powers of two for the rows and the columns, from exponents of entries alone.

Rows and columns that are multiplied by powers of two get other exponents, and the same scaled numbers to the bit: along
a spanning tree of the nonzero pattern every exponent becomes zero, whatever it was, and all that follows sees only what
the tree leaves.  Least squares make the exponents small (Curtis and Reid 1972, rounded to integers); the right-hand
sides say how large each block of coordinates is.
"""

import math

import numpy as np
from numba import njit

from polytopes.kernel.simplex import Index, Matrix, Vector

_SWEEPS = 8  # of alternating means; a table without zeros needs one
_FARTHEST = 498  # exponent of the distance of a hyperplane whose square, and its sums, are floats
_STILL = 0.1  # change of an exponent from which another sweep is not worth it


@njit(error_model="numpy")
def _along_a_tree(e: Index, nonzero: Matrix, r: Index, s: Index) -> Index:
    """Exponents r, s that make ``e + r + s`` zero along a spanning tree of each block; the blocks of the columns."""
    m, d = e.shape
    block, seen, queue = np.full(d, -1), np.zeros(m, np.int64), np.empty(d, np.int64)
    for root in range(d):
        if block[root] >= 0:
            continue
        block[root], queue[0] = root, root
        first, last = 0, 1
        while first < last:
            j = queue[first]
            first += 1
            for i in range(m):
                if nonzero[i, j] == 0.0 or seen[i] == 1:
                    continue
                seen[i] = 1
                r[i] = -(e[i, j] + s[j])
                for k in range(d):
                    if nonzero[i, k] != 0.0 and block[k] < 0:
                        block[k], queue[last] = root, k
                        s[k] = -(e[i, k] + r[i])
                        last += 1
    return block


@njit(error_model="numpy")
def _by_least_squares(e: Index, nonzero: Matrix, r: Index, s: Index) -> None:
    """Corrects s so that the squares of ``e + r + s`` are small over the entries, for the best r."""
    m, d = e.shape
    down, along = np.zeros(m), np.zeros(d)
    counts = nonzero.sum(axis=1)
    for _ in range(_SWEEPS):
        for i in range(m):
            total = 0.0
            for j in range(d):
                total += nonzero[i, j] * (e[i, j] + r[i] + s[j] + along[j])
            down[i] = -total / max(counts[i], 1.0)
        change = 0.0
        for j in range(d):
            total, weight = 0.0, 0.0
            for i in range(m):
                if counts[i] > 1.0 and nonzero[i, j] != 0.0:
                    total += e[i, j] + r[i] + s[j] + down[i]
                    weight += 1.0
            if weight > 0.0:
                change = max(change, abs(along[j] + total / weight))
                along[j] = -total / weight
        if change < _STILL:
            break
    for j in range(d):
        s[j] += math.floor(along[j] + 0.5)


@njit(error_model="numpy")
def exponents(rows: Matrix, rhs: Vector) -> tuple[Index, Index]:
    """Exponents r (m,) and s (d,): ``2^(r_i + s_j) rows[i, j]`` has rows whose largest entry is in [1/2, 1).

    ``2^r_i rhs[i]`` is at most one, and about one somewhere in each block of coordinates that rows join, and in rows of
    zeros.

    Parameters
    ----------
    rows, rhs : arrays (m, d) and (m,)
    """
    m, d = rows.shape
    e, nonzero = np.zeros((m, d), np.int64), np.zeros((m, d))
    for i in range(m):
        for j in range(d):
            if rows[i, j] != 0.0:
                e[i, j] = math.frexp(rows[i, j])[1]
                nonzero[i, j] = 1.0
    r, s = np.zeros(m, np.int64), np.zeros(d, np.int64)
    block = _along_a_tree(e, nonzero, r, s)
    _by_least_squares(e, nonzero, r, s)
    none = np.int64(-1) << 40
    home, top = np.full(m, -1), np.full(d, none)
    for i in range(m):
        largest = none
        for j in range(d):
            if nonzero[i, j] != 0.0:
                largest = max(largest, e[i, j] + s[j])
                home[i] = block[j]
        r[i] = -largest if home[i] >= 0 else -math.frexp(rhs[i])[1]
        if home[i] >= 0 and rhs[i] != 0.0:
            top[home[i]] = max(top[home[i]], math.frexp(rhs[i])[1] + r[i])
    for j in range(d):
        if top[block[j]] > none:
            s[j] += top[block[j]]
    for i in range(m):
        if home[i] >= 0 and top[home[i]] > none:
            r[i] -= top[home[i]]
    return r, s


@njit(error_model="numpy")
def scaled(rows: Matrix, rhs: Vector) -> tuple[Matrix, Vector, Vector, Index, Index, Index, int, int]:
    """The rows that are not zero in even units, transposed, with norms in [1/2, 1).

    Parameters
    ----------
    rows, rhs : arrays (m, d) and (m,)

    Returns
    -------
    AT, b, norms : arrays (d, k), (k,) and (k,)
    r, s : arrays (k,) and (d,) of int
        The exponents.
    kept : array (k,) of int
        The rows that are not zero.
    far, lost : int
        A row whose hyperplane is more than 1e150 from the origin, and one whose scaled numbers are no floats; -1 if
        there is none.
    """
    m, d = rows.shape
    kept = np.empty(m, np.int64)
    k = 0
    for i in range(m):
        for j in range(d):
            if rows[i, j] != 0.0:
                kept[k] = i
                k += 1
                break
    kept = kept[:k].copy()
    r, s = exponents(rows, rhs) if k == m else exponents(rows[kept], rhs[kept])
    AT, b, norms, far, lost = np.zeros((d, k)), np.zeros(k), np.zeros(k), -1, -1
    for q in range(k):
        i = kept[q]
        square, largest = 0.0, 0.0
        for j in range(d):
            largest = max(largest, abs(rows[i, j]))
            value = math.ldexp(rows[i, j], r[q] + s[j])
            square += value * value
        if rhs[i] != 0.0 and math.frexp(rhs[i])[1] - math.frexp(largest)[1] > _FARTHEST:
            far = i
        shift = math.frexp(math.sqrt(square))[1]
        r[q] -= shift
        norms[q] = math.ldexp(math.sqrt(square), -shift)
        for j in range(d):
            AT[j, q] = math.ldexp(rows[i, j], r[q] + s[j])
            if rows[i, j] != 0.0 and abs(AT[j, q]) < 1e-300:
                lost = i
        b[q] = math.ldexp(rhs[i], r[q])
        if rhs[i] != 0.0 and not 1e-300 < abs(b[q]) < 1e300:
            lost = i
    for j in range(d):
        if abs(s[j]) > 1000:
            lost = max(lost, 0)
    return AT, b, norms, r, s, kept, far, lost
