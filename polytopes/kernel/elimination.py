"""Fourier-Motzkin elimination: the pairs in which a coordinate cancels, and the facets among them, step by step."""

import math

import numpy as np
from numba import njit

from polytopes.kernel.facets import irredundant
from polytopes.kernel.simplex import EPS, FAST, Index, Matrix, Vector

FINISHED, TOO_MANY, OPEN, PAUSED = range(4)

_LONG = 1000  # rows formed: such a step takes milliseconds, and Python hears of it at once
# A step that forms at most so many times the rows that the last pruning left needs no pruning first: programs after
# several such steps are fewer, and have fewer variables (3 to 30 % less time on sparse rows, nothing on dense ones).
_GROWTH = 1.5
# A sum this small beside its two terms is zero: rounding errors of earlier steps would make it a row of noise.
_CANCELLED = 64.0 * EPS


@njit(error_model="numpy")
def _cheapest(table: Matrix, left: Index, columns: Index) -> tuple[int, int]:
    """Which of the columns makes the fewest rows when it is eliminated (the first of several), and how many."""
    best, rows = -1, 1 << 62
    for j in range(left.size):
        if not (columns == left[j]).any():
            continue
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


@njit(error_model="numpy")
def _foreseen(formed: int, dimension: int) -> float:
    """Rows that the step after the next will form, if the rows are dense: half of those that stay go with the others.

    The share that stays was measured on random rows; it grows with the dimension that is left.
    """
    share = 0.65 if dimension > 4 else (0.45 if dimension == 4 else 0.2)
    return (0.5 * share * formed) ** 2


@njit(error_model="numpy")
def _scaled(table: Matrix) -> Matrix:
    """Rows ``[A, b]`` over powers of two, so that no product of two coefficients leaves the range of floats."""
    scaled = table.copy()
    for i in range(table.shape[0]):
        largest = 0.0
        for j in range(table.shape[1] - 1):
            largest = max(largest, abs(table[i, j]))
        factor = math.ldexp(1.0, min(-math.frexp(largest)[1], 1000))
        for j in range(table.shape[1]):
            scaled[i, j] *= factor
    return scaled


@njit(error_model="numpy")  # products and sums as written: rows of small integers stay exact
def _combined(table: Matrix, known: Index, j: int, formed: int) -> tuple[Matrix, Index]:
    """All rows ``[A, b]`` without x_j and all pairs in which it cancels, scaled by powers of two; no zero rows.

    With them, whether they are known to be facets.  A facet parallel to x_j stays one: a point that violates it alone
    does so in the shadow too.
    """
    m, width = table.shape
    rows, facet = np.empty((formed, width - 1)), np.empty(formed, np.int64)
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
                facet[count] = known[first] if up == 0.0 else 0
                count += 1
    return rows[:count], facet[:count]


@njit(error_model="numpy", fastmath=FAST)
def pruned(table: Matrix, inner: Vector, known: Index) -> tuple[Matrix, Index]:
    """The facets among rows ``[A, b]`` that are not zero, some known to be facets; for each whether it is doubtful."""
    rows, doubtful = irredundant(np.ascontiguousarray(table[:, :-1].T), table[:, -1].copy(), inner, known)
    return table[rows], doubtful


@njit(error_model="numpy", fastmath=FAST)
def eliminate(
    table: Matrix, known: Index, left: Index, columns: Index, inner: Vector, max_rows: int, cautious: bool
) -> tuple[Matrix, Index, Index, Vector, Index, Index, int, int]:
    """Eliminate coordinates, the one that makes the fewest pairs first, until Python has to decide.

    Rows are pruned at the end, and before a step whenever it would form many more than the last pruning left.

    Parameters
    ----------
    table : array (m, d + 1)
        Rows ``[A, b]`` without zero rows.
    known : array (m,) of int
        1 for rows that are facets for sure.
    left : array (d,) of int
        Names of the columns of A.
    columns : array of int
        Those to eliminate.
    inner : array (d,)
        A point strictly inside.
    max_rows : int
        Limit on the rows that a step forms.
    cautious : bool
        Whether to stop already where the step after the next is foreseen to form more.

    Returns
    -------
    table, left, columns, inner
        What is left.
    doubtful : array of int
        Whether a row of the table may be redundant.
    trace : array (steps, 2) of int
        Rows formed and kept by each step that was done.
    formed : int
        Rows that the next step would form, if they are too many.
    state : int
        `FINISHED`, `TOO_MANY`, `OPEN` (rows are doubtful) or `PAUSED` (after a long step).
    """
    table = _scaled(table)
    trace, steps, long = np.zeros((columns.size, 2), np.int64), 0, False
    doubtful, least = np.zeros(table.shape[0], np.int64), table.shape[0]
    while True:
        j, formed, over = -1, 0, False
        if columns.size > 0:
            j, formed = _cheapest(table, left, columns)
            more = columns.size > 1 and cautious
            over = formed > max_rows or (more and _foreseen(formed, left.size - 1) > max_rows)
        if not known.all() and (j < 0 or over or formed > _GROWTH * least):
            table, doubtful = pruned(table, inner, known)
            known, least = np.ones(table.shape[0], np.int64), table.shape[0]
            if steps > 0:
                trace[steps - 1, 1] = least
            if doubtful.any():
                return table, left, columns, inner, doubtful, trace[:steps], 0, OPEN
            if long:
                return table, left, columns, inner, doubtful, trace[:steps], 0, PAUSED
            continue
        if j < 0:
            return table, left, columns, inner, doubtful, trace[:steps], 0, FINISHED
        if over:
            return table, left, columns, inner, doubtful, trace[:steps], formed, TOO_MANY
        columns = columns[columns != left[j]]
        rest = np.arange(left.size) != j
        left, inner = left[rest], inner[rest]
        table, known = _combined(table, known, j, formed)
        trace[steps, 0], trace[steps, 1] = formed, table.shape[0]
        steps, long = steps + 1, formed > _LONG
