"""One step of Fourier-Motzkin elimination: the pairs in which a coordinate cancels, and the facets among them."""

import math

import numpy as np
from numba import njit

from polytopes.kernel.facets import irredundant
from polytopes.kernel.simplex import EPS, FAST, Index, Matrix, Vector

# A sum this small beside its two terms is zero: rounding errors of earlier steps would make it a row of noise.
_CANCELLED = 64.0 * EPS


@njit(error_model="numpy")
def cheapest(table: Matrix, columns: Index) -> tuple[int, int]:
    """Which of the columns makes the fewest rows when it is eliminated (the first of several), and how many."""
    best, rows = -1, 1 << 62
    for j in columns:
        up, down = 0, 0
        for i in range(table.shape[0]):
            if table[i, j] > 0.0:
                up += 1
            elif table[i, j] < 0.0:
                down += 1
        formed = table.shape[0] - up - down + up * down
        if formed < rows:
            best, rows = j, formed
    return best, rows


@njit(error_model="numpy")  # products and sums as written: rows of small integers stay exact
def _combined(table: Matrix, j: int, formed: int) -> Matrix:
    """All rows ``[A, b]`` without x_j and all pairs in which it cancels, scaled by powers of two; no zero rows."""
    m, width = table.shape
    rows = np.empty((formed, width - 1))
    count = 0
    for first in range(m):
        for second in range(m):
            up, down = table[first, j], table[second, j]
            if not ((up > 0.0 and down < 0.0) or (up == 0.0 and first == second)):
                continue
            largest, k = 0.0, 0
            for q in range(width):
                if q == j:
                    continue
                if up == 0.0:
                    value = table[first, q]
                else:
                    above, below = table[first, q] * -down, table[second, q] * up
                    value = above + below
                    if abs(value) <= _CANCELLED * (abs(above) + abs(below)):
                        value = 0.0
                rows[count, k] = value
                if q < width - 1:
                    largest = max(largest, abs(value))
                k += 1
            if largest > 0.0:
                factor = math.ldexp(1.0, -math.frexp(largest)[1])
                for k in range(width - 1):
                    rows[count, k] *= factor
                count += 1
    return rows[:count]


@njit(error_model="numpy", fastmath=FAST)
def pruned(table: Matrix, inner: Vector) -> tuple[Matrix, Index]:
    """The facets among rows ``[A, b]`` that are not zero, and for each whether it is doubtful."""
    if table.shape[0] == 0:
        return table, np.empty(0, np.int64)
    rows, doubtful = irredundant(np.ascontiguousarray(table[:, :-1].T), table[:, -1].copy(), inner)
    return table[rows], doubtful


@njit(error_model="numpy", fastmath=FAST)
def step(table: Matrix, j: int, formed: int, inner: Vector) -> tuple[Matrix, Index]:
    """Eliminate x_j: the facets of the projection among the rows formed, and for each whether it is doubtful."""
    return pruned(_combined(table, j, formed), inner)
