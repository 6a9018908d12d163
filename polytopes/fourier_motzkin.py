"""Fourier-Motzkin elimination with redundancy removal.

To eliminate x_j from ``A x <= b``, rows without x_j stay, and every row with a positive coefficient is added to every
row with a negative one so that x_j cancels (Fourier 1826; Motzkin 1936).  Linear programs prune the rows before every
step that would form many more than the last pruning left, and at the end: a step that forms many starts from a minimal
description, and where rows are sparse several cheap steps share one pruning.

Chernikov's rule, which skips rows made of too many original ones, is exact on its own but not together with pruning by
linear programs (a pruned row takes its history with it), so it is not used.
"""

import logging

import numpy as np

from polytopes import kernel
from polytopes.checks import Floats
from polytopes.errors import ProjectionLimitError
from polytopes.redundancy import settle

_LOG = logging.getLogger("polytopes")


def eliminate(
    A: Floats, b: Floats, columns: list[int], inner: Floats, max_rows: int, cautious: bool = False
) -> tuple[Floats, Floats]:
    """Rows of the projection of a full-dimensional set along some coordinates.

    The logger ``polytopes`` reports each step at level INFO, a long one as soon as it is done.

    Parameters
    ----------
    A, b : arrays (m, n) and (m,)
        No zero rows.
    columns : list of int
        Coordinates to eliminate; the one that makes the fewest pairs goes first.
    inner : array (n,)
        A point strictly inside.
    max_rows : int
        Limit on the rows of one step, before pruning.
    cautious : bool
        Whether to give up already where dense rows would reach the limit in the step after the next.

    Returns
    -------
    A, b : arrays (k, n - len(columns)) and (k,)
        Minimal rows over the other coordinates, in their order.

    Raises
    ------
    ProjectionLimitError
        If one step would form more than `max_rows` rows.
    """
    inner, left, rest = np.ascontiguousarray(inner), np.arange(A.shape[1]), np.array(columns, dtype=np.int64)
    table, known = np.concatenate([A, b[:, None]], axis=1), np.zeros(b.size, np.int64)
    done, state = 0, kernel.PAUSED
    while state != kernel.FINISHED:
        table, left, rest, inner, doubtful, trace, formed, state = kernel.eliminate(
            table, known, left, rest, inner, max_rows, cautious
        )
        if _LOG.isEnabledFor(logging.INFO):
            for made, kept in trace:
                done += 1
                _LOG.info("eliminated variable %d of %d: %d rows formed, %d kept", done, len(columns), made, kept)
        if state == kernel.TOO_MANY:
            raise ProjectionLimitError(
                f"eliminating variable {len(columns) - rest.size + 1} of {len(columns)} would form {formed} rows from "
                f"{len(table)}, more than max_rows={max_rows}; raise the limit, use outer=True for a superset, or "
                "another method."
            )
        if state == kernel.OPEN:
            facets = settle(table[:, :-1], table[:, -1], inner, doubtful)
            table = np.ascontiguousarray(table[facets])
        known = np.ones(len(table), np.int64)
    return table[:, :-1], table[:, -1]
