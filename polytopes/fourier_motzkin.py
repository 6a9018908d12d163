"""Fourier-Motzkin elimination with redundancy removal after every variable.

To eliminate x_j from ``A x <= b``, rows without x_j stay, and every row with a positive coefficient is added to every
row with a negative one so that x_j cancels (Fourier 1826; Motzkin 1936).  The pairs are pruned by linear programs at
once, so each step starts from a minimal description.

Chernikov's rule, which skips rows made of too many original ones, is exact on its own but not together with pruning by
linear programs (a pruned row takes its history with it), so it is not used.
"""

import logging

import numpy as np
from numpy.typing import NDArray

from polytopes.errors import ProjectionLimitError
from polytopes.linear_program import prepare
from polytopes.redundancy import irredundant

Floats = NDArray[np.float64]
_EPS = float(np.finfo(np.float64).eps)


def eliminate(A: Floats, b: Floats, columns: list[int], inner: Floats, max_rows: int) -> tuple[Floats, Floats]:
    """Rows of the projection of a full-dimensional set along some coordinates.

    Parameters
    ----------
    A, b : arrays (m, n) and (m,)
    columns : list of int
        Coordinates to eliminate; the one that makes the fewest pairs goes first.
    inner : array (n,)
        A point strictly inside.
    max_rows : int
        Limit on the rows of one step, before pruning.

    Returns
    -------
    A, b : arrays (k, n - len(columns)) and (k,)
        Minimal rows over the other coordinates, in their order.

    Raises
    ------
    ProjectionLimitError
        If one step would form more than `max_rows` rows.
    """
    left = list(range(A.shape[1]))
    A, b = _pruned(A, b, inner)
    for done in range(len(columns)):
        j = min((left.index(c) for c in columns if c in left), key=lambda q: _growth(A[:, q]))
        expected = _growth(A[:, j]) + b.size
        if expected > max_rows:
            raise ProjectionLimitError(
                f"eliminating variable {done + 1} of {len(columns)} would form {expected} rows from {b.size}, more "
                f"than max_rows={max_rows}; raise the limit, use outer=True for a superset, or another method."
            )
        A, b = _combined(A, b, j)
        del left[j]
        A, b = _pruned(A, b, inner[left])
        logging.getLogger("polytopes").info(
            "eliminated variable %d of %d: %d rows formed, %d kept", done + 1, len(columns), expected, b.size
        )
    return A, b


def _growth(column: Floats) -> int:
    """Change of the number of rows when this coordinate is eliminated."""
    positive, negative = int(np.count_nonzero(column > 0)), int(np.count_nonzero(column < 0))
    return positive * negative - positive - negative


def _combined(A: Floats, b: Floats, j: int) -> tuple[Floats, Floats]:
    """All rows without x_j, and all pairs in which it cancels."""
    rows = np.hstack([np.delete(A, j, axis=1), b[:, None]])
    up, down = A[:, j] > 0, A[:, j] < 0
    # Products, not quotients: rows of small integers stay exact.
    above = rows[up][:, None, :] * -A[down, j][None, :, None]
    below = rows[down][None, :, :] * A[up, j][:, None, None]
    pairs, magnitude = above + below, np.abs(above) + np.abs(below)
    # A sum of two terms below the rounding error of those terms is zero: kept, it would be a row of noise.
    pairs[np.abs(pairs) <= 2.0 * _EPS * magnitude] = 0.0
    table = np.vstack([rows[~(up | down)], pairs.reshape(-1, rows.shape[1])])
    table = np.ldexp(table, -np.frexp(np.abs(table).max(axis=1, keepdims=True))[1])
    return table[:, :-1], table[:, -1]


def _pruned(A: Floats, b: Floats, inner: Floats) -> tuple[Floats, Floats]:
    n = A.shape[1]
    program = prepare(A, b, np.empty((0, n)), np.empty(0))
    rows = program.kept[irredundant(program, inner)]
    return A[rows], b[rows]
