"""HiGHS on a window that the simplex left undecided."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polytopes.highs import HighsProgram
from svo.checks import Array

_PLAIN = {"presolve": "off"}  # with it, an infeasible model leaves no dual ray


def is_feasible(G: Array, lower: Array, upper: Array) -> tuple[bool | None, Array]:
    """Whether {z in [-1, 1]^Z : lower <= G z <= upper} has a point, as far as HiGHS can tell.

    Returns
    -------
    feasible : bool or None
        None where HiGHS does not know either.
    ray : (R,) array
        If not feasible, row multipliers of its dual ray (sign by HiGHS' convention), to be proven; else zeros.
    """
    rows, columns = G.shape
    program = HighsProgram(G, upper, row_lower=lower, lower=-1.0, upper=1.0, options=_PLAIN)
    status = program.minimise(np.zeros(columns)).status
    ray = program.dual_ray() if status == "infeasible" else None
    feasible = {"optimal": True, "infeasible": False}.get(status)
    return feasible, np.zeros(rows) if ray is None else ray


def candidates(ray: Array) -> Iterator[Array]:
    """The multipliers that a ray may mean: either sign."""
    yield ray
    yield -ray
