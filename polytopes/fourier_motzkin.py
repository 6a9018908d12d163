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
from polytopes.redundancy import irredundant

Floats = NDArray[np.float64]
# A sum this small beside its two terms is zero: rounding errors of earlier steps would make it a row of noise.
_CANCELLED = 64.0 * float(np.finfo(np.float64).eps)
_LOG = logging.getLogger("polytopes")


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
    table = _pruned(np.hstack([A, b[:, None]]), inner)
    for done in range(len(columns)):
        growths = _growths(table)
        j = min((left.index(c) for c in columns if c in left), key=growths.__getitem__)
        formed = len(table) + int(growths[j])
        if formed > max_rows:
            raise ProjectionLimitError(
                f"eliminating variable {done + 1} of {len(columns)} would form {formed} rows from {len(table)}, more "
                f"than max_rows={max_rows}; raise the limit, use outer=True for a superset, or another method."
            )
        del left[j]
        table = _pruned(_combined(table, j), inner[left])
        _LOG.info("eliminated variable %d of %d: %d rows formed, %d kept", done + 1, len(columns), formed, len(table))
    return table[:, :-1], table[:, -1]


def _growths(table: Floats) -> NDArray[np.int64]:
    """Change of the number of rows when a coordinate is eliminated, for each."""
    positive, negative = (table > 0).sum(axis=0), (table < 0).sum(axis=0)
    growths: NDArray[np.int64] = positive * negative - positive - negative
    return growths


def _combined(table: Floats, j: int) -> Floats:
    """All rows ``[A, b]`` without x_j, and all pairs in which it cancels."""
    column, rows = table[:, j], np.delete(table, j, axis=1)
    up, down = column > 0, column < 0
    # Products, not quotients: rows of small integers stay exact.
    above = rows[up][:, None, :] * -column[down][None, :, None]
    below = rows[down][None, :, :] * column[up][:, None, None]
    pairs, magnitude = above + below, np.abs(above) + np.abs(below)
    pairs[np.abs(pairs) <= _CANCELLED * magnitude] = 0.0
    return np.vstack([rows[~(up | down)], pairs.reshape(-1, rows.shape[1])])


def _pruned(table: Floats, inner: Floats) -> Floats:
    """The facets among rows ``[A, b]``, scaled by powers of two."""
    largest = np.abs(table[:, :-1]).max(axis=1)
    table, largest = table[largest > 0.0], largest[largest > 0.0]
    if not len(table):
        return table
    table = np.ldexp(table, -np.frexp(largest)[1][:, None])
    return table[irredundant(np.ascontiguousarray(table[:, :-1].T), table[:, -1], inner)]
