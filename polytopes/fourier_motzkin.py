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

from polytopes import kernel
from polytopes.errors import ProjectionLimitError
from polytopes.linear_program import warm_up
from polytopes.redundancy import settle

Floats = NDArray[np.float64]
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
    warm_up()
    left = list(range(A.shape[1]))
    table = np.hstack([A, b[:, None]])[A.any(axis=1)]
    table = _settled(kernel.pruned(table, inner), inner)
    for done in range(len(columns)):
        candidates = np.array([k for k, j in enumerate(left) if j in columns])
        j, formed = kernel.cheapest(table, candidates)
        if formed > max_rows:
            raise ProjectionLimitError(
                f"eliminating variable {done + 1} of {len(columns)} would form {formed} rows from {len(table)}, more "
                f"than max_rows={max_rows}; raise the limit, use outer=True for a superset, or another method."
            )
        del left[j]
        inner = np.delete(inner, j)
        table = _settled(kernel.step(table, j, formed, inner), inner)
        _LOG.info("eliminated variable %d of %d: %d rows formed, %d kept", done + 1, len(columns), formed, len(table))
    return table[:, :-1], table[:, -1]


def _settled(answer: tuple[Floats, NDArray[np.int64]], inner: Floats) -> Floats:
    """The facets among rows ``[A, b]``, some of which the kernel may have left open."""
    table, doubtful = answer
    if doubtful.any():
        table = table[settle(table[:, :-1], table[:, -1], inner, doubtful)]
    return table
