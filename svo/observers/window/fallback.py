"""HiGHS on a window that the compiled simplex left undecided."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polytopes.silent_highs import new_highs
from svo.checks import Array


def is_feasible(G: Array, lower: Array, upper: Array) -> tuple[bool | None, Array]:
    """Whether {z in [-1, 1]^Z : lower <= G z <= upper} has a point, as far as HiGHS can tell.

    Returns
    -------
    feasible : bool or None
        None where HiGHS does not know either.
    ray : (R,) array
        If not feasible, row multipliers of its dual ray (sign by HiGHS' convention), to be proven; else zeros.
    """
    import highspy  # imported here: rarely needed, and slow to load

    solver = new_highs()
    solver.setOptionValue("presolve", "off")  # with it, an infeasible model leaves no dual ray
    rows, columns = G.shape
    lp = highspy.HighsLp()
    lp.num_col_, lp.num_row_ = columns, rows
    lp.col_cost_, lp.col_lower_, lp.col_upper_ = np.zeros(columns), -np.ones(columns), np.ones(columns)
    lp.row_lower_, lp.row_upper_ = lower, upper
    where = G != 0.0
    lp.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    lp.a_matrix_.start_ = np.concatenate([[0], np.cumsum(where.sum(axis=1))])
    lp.a_matrix_.index_ = np.nonzero(where)[1]
    lp.a_matrix_.value_ = G[where]
    solver.passModel(lp)
    solver.run()
    status = solver.getModelStatus()
    if status == highspy.HighsModelStatus.kOptimal:
        return True, np.zeros(rows)
    if status == highspy.HighsModelStatus.kInfeasible:
        _, known, ray = solver.getDualRay()
        return False, np.asarray(ray, dtype=float) if known else np.zeros(rows)
    return None, np.zeros(rows)


def candidates(ray: Array) -> Iterator[Array]:
    """The multipliers that a ray may mean: either sign."""
    yield ray
    yield -ray
