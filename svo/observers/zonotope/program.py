"""Linear programs over a constrained zonotope: a point or multipliers that say there is none, supports."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polytopes.highs import HighsProgram
from svo.checks import Array
from svo.observers.zonotope.zonotope import ConstrainedZonotope, unit

_INSIDE = 1e-9  # how far inside the unit ball a point must be to count without a program
_MISFIT = 1e-12  # of the constraints, up to which it satisfies them
_PLAIN = {"threads": 1, "solver": "simplex", "presolve": "off", "simplex_scale_strategy": 0}


class Feasibility(NamedTuple):
    """Whether a set has a point; ``ray`` (nc,) are multipliers of the constraints that may prove that it has none."""

    status: Literal["nonempty", "empty", "undecided"]
    ray: Array


class ZonotopeProgram:
    """Programs over one set, solved by HiGHS from the last basis.

    Parameters
    ----------
    Z : ConstrainedZonotope
    free : (k,) array of int
        Generators whose |xi| <= 1 is left out, since constraints bound them.
    """

    def __init__(self, Z: ConstrainedZonotope, free: NDArray[np.int64] | tuple[int, ...] = ()) -> None:
        self._set, self._free = Z, np.array(free, dtype=np.int64)
        # Rows of the same size, by powers of two so that nothing is rounded.
        sizes = np.abs(Z.constraints).sum(axis=1) + Z.slack
        self._scale = np.ldexp(1.0, -np.frexp(np.where(sizes > 0.0, sizes, 1.0))[1])

    def feasibility(self) -> Feasibility:
        """A point by least squares, else by the simplex method, else by the interior-point method."""
        nothing = np.zeros(self._set.offset.size)
        if self._least_squares_point():
            return Feasibility("nonempty", nothing)
        for method in ("simplex", "ipm"):  # the simplex method leaves a few programs undecided
            status = self._program.maximise(np.zeros(self._set.generators.shape[1]), solver=method).status
            if status == "optimal":
                return Feasibility("nonempty", nothing)
            ray = self._program.dual_ray() if status == "infeasible" else None
            if ray is not None:
                return Feasibility("empty", self._scale * ray)
        return Feasibility("undecided", nothing)

    def support(self, directions: Array) -> Array:
        """Outer bounds of the support in directions (k, n), by weak duality with its rounding."""
        Z = self._set
        costs = directions @ Z.generators
        multipliers = np.array(list(self._multipliers(costs))).reshape(len(costs), Z.offset.size)
        left = np.abs(costs - multipliers @ Z.constraints).sum(axis=1)
        value = directions @ Z.center + np.abs(directions) @ Z.room + multipliers @ Z.offset
        value += np.abs(multipliers) @ Z.slack + left
        reach = np.abs(Z.center) + np.abs(Z.generators).sum(axis=1) + Z.room
        terms = np.abs(directions) @ reach
        terms += np.abs(multipliers) @ (np.abs(Z.offset) + Z.slack + np.abs(Z.constraints).sum(axis=1))
        return value + unit(Z.dim + Z.offset.size + Z.generators.shape[1]) * terms

    def _multipliers(self, costs: Array) -> Iterator[Array]:
        """Of the constraints, for each cost (ng,); zeros where there is no optimum."""
        nothing = np.zeros(self._set.offset.size)
        for cost in costs:
            size = np.abs(cost).max(initial=0.0)
            if size == 0.0 or not nothing.size:
                yield nothing
                continue
            found = self._program.maximise(cost / size, solver="simplex")
            yield self._scale * found.multipliers * size if found.status == "optimal" else nothing

    def _least_squares_point(self) -> bool:
        """Whether the point of least norm in (xi, slack) lies inside the unit ball, and satisfies the constraints."""
        Z = self._set
        if not Z.offset.size:
            return True
        A = np.hstack([Z.constraints, np.diag(Z.slack)]) * self._scale[:, None]
        target = Z.offset * self._scale
        try:
            point = A.T @ np.linalg.solve(A @ A.T, target)
        except np.linalg.LinAlgError:
            return False
        exact = np.abs(A @ point - target).max() <= _MISFIT * max(1.0, float(np.abs(target).max()))
        return bool(np.abs(point).max() <= 1.0 - _INSIDE and exact)

    @cached_property
    def _program(self) -> HighsProgram:
        Z, bound = self._set, np.ones(self._set.generators.shape[1])
        bound[self._free] = np.inf
        lower, upper = (Z.offset - Z.slack) * self._scale, (Z.offset + Z.slack) * self._scale
        A = Z.constraints * self._scale[:, None]
        return HighsProgram(A, upper, row_lower=lower, lower=-bound, upper=bound, options=_PLAIN)
