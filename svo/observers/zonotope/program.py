"""Linear programs over a constrained zonotope: a point or multipliers that say there is none, supports."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.observers.zonotope.zonotope import ConstrainedZonotope, unit

_INSIDE = 1e-9  # how far inside the unit ball a point must be to count without a program
_MISFIT = 1e-12  # of the constraints, up to which it satisfies them
_PLAIN = {"output_flag": False, "threads": 1, "solver": "simplex", "presolve": "off", "simplex_scale_strategy": 0}


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
        self._solver: Any = None

    def feasibility(self) -> Feasibility:
        """A point by least squares, else by the simplex method, else by the interior-point method."""
        nothing = np.zeros(self._set.offset.size)
        if self._least_squares_point():
            return Feasibility("nonempty", nothing)
        import highspy

        self._open()
        for method in ("simplex", "ipm"):  # the simplex method leaves a few programs undecided
            self._solver.setOptionValue("solver", method)
            self._solver.run()
            status = self._solver.getModelStatus()
            if status == highspy.HighsModelStatus.kOptimal:
                return Feasibility("nonempty", nothing)
            if status == highspy.HighsModelStatus.kInfeasible:
                _, known, ray = self._solver.getDualRay()
                if known:
                    return Feasibility("empty", self._scale * np.asarray(ray, dtype=float))
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
        import highspy

        nothing, columns = np.zeros(self._set.offset.size), np.arange(self._set.generators.shape[1], dtype=np.int32)
        if not nothing.size:
            yield from (nothing for _ in costs)
            return
        self._open()
        self._solver.setOptionValue("solver", "simplex")
        for cost in costs:
            size = np.abs(cost).max(initial=0.0)
            if size == 0.0:
                yield nothing
                continue
            self._solver.changeColsCost(columns.size, columns, cost / size)
            self._solver.run()
            if self._solver.getModelStatus() == highspy.HighsModelStatus.kOptimal:
                yield self._scale * np.array(self._solver.getSolution().row_dual) * size
            else:
                yield nothing

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

    def _open(self) -> None:
        if self._solver is not None:
            return
        import highspy  # imported here: slow to load

        Z, rows, columns = self._set, len(self._set.offset), self._set.generators.shape[1]
        bound = np.ones(columns)
        bound[self._free] = np.inf
        A = Z.constraints * self._scale[:, None]
        lp = highspy.HighsLp()
        lp.num_col_, lp.num_row_ = columns, rows
        lp.col_cost_, lp.col_lower_, lp.col_upper_ = np.zeros(columns), -bound, bound
        lp.row_lower_, lp.row_upper_ = (Z.offset - Z.slack) * self._scale, (Z.offset + Z.slack) * self._scale
        where = A != 0.0
        lp.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        lp.a_matrix_.start_ = np.concatenate([[0], np.cumsum(where.sum(axis=1))])
        lp.a_matrix_.index_, lp.a_matrix_.value_ = np.nonzero(where)[1], A[where]
        lp.sense_ = highspy.ObjSense.kMaximize
        self._solver = highspy.Highs()
        for name, value in _PLAIN.items():
            self._solver.setOptionValue(name, value)
        self._solver.passModel(lp)
