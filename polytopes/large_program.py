"""Programs over rows that are too many for the core: by HiGHS, with multipliers that are refined and what they prove.

Rows ``x'AT <= rhs`` are in even units, transposed as the core has them.
"""

import numpy as np

from polytopes.checks import Floats
from polytopes.duality import Bounds, multiplier_bounds
from polytopes.highs import HighsProgram

_USED = 1e-9  # of the largest multiplier: smaller ones are rounding


def largest_ball(AT: Floats, rhs: Floats, norms: Floats, widest: float) -> tuple[Floats, float, Floats, bool]:
    """Centre (free,), radius, multipliers (kept,) of a largest ball, and whether HiGHS finished.

    The radius is inf where it comes near ``widest``, beyond which only a ball can be that grows without end.
    """
    free, kept = AT.shape
    rows = np.vstack([np.hstack([AT.T, norms[:, None]]), np.append(np.zeros(free), 1.0)])
    answer = HighsProgram(rows, np.append(rhs, widest)).maximise(np.append(np.zeros(free), 1.0))
    point = answer.point if answer.point.size == free + 1 else np.zeros(free + 1)
    weights = answer.multipliers[:kept] if answer.multipliers.size == kept + 1 else np.zeros(kept)
    radius = float(point[-1]) if point[-1] < 0.99 * widest else np.inf
    return point[:-1].copy(), radius, np.maximum(weights, 0.0), answer.status == "optimal"


def support(program: HighsProgram, AT: Floats, rhs: Floats, form: Floats) -> tuple[Floats, Floats, Bounds, str]:
    """Point, multipliers, bounds and HiGHS' status of one form; the multipliers are refined on the rows in use."""
    free, kept = AT.shape
    answer = program.maximise(form)
    if answer.status != "optimal":
        nothing = Bounds(np.full(1, np.inf), np.zeros(1), np.zeros((1, free)))
        return np.zeros(free), np.zeros(kept), nothing, answer.status
    y = np.maximum(answer.multipliers, 0.0)
    used = np.flatnonzero(y > _USED * y.max(initial=0.0))
    refined = np.zeros(kept)
    refined[used] = np.maximum(y[used] + _least_squares(AT[:, used], form - AT[:, used] @ y[used]), 0.0)
    return answer.point, refined, multiplier_bounds(AT, rhs, form, refined), answer.status


def _least_squares(A: Floats, b: Floats) -> Floats:
    """A least-squares solution, zero if it is not found."""
    try:
        return np.asarray(np.linalg.lstsq(A, b, rcond=None)[0])
    except np.linalg.LinAlgError:
        return np.zeros(A.shape[1])
