"""HiGHS as the solver of large programs and of those on which the compiled kernel gives up."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes.silent_highs import new_highs

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class HighsOutcome:
    """Answer of HiGHS: "optimal", "unbounded", "infeasible" or "unknown", with point and multipliers (m,)."""

    status: str
    value: float
    point: Floats
    multipliers: Floats


class HighsProgram:
    """``max c'x`` subject to ``A x <= b`` for many c, warm-started; x is free.

    Parameters
    ----------
    A, b : arrays (m, n) and (m,)
    """

    def __init__(self, A: Floats, b: Floats) -> None:
        import highspy  # imported here: not every program needs it, and it takes time to load

        self._names: dict[Any, str] = {
            highspy.HighsModelStatus.kOptimal: "optimal",
            highspy.HighsModelStatus.kUnbounded: "unbounded",
            highspy.HighsModelStatus.kInfeasible: "infeasible",
        }
        m, n = A.shape
        self._columns = np.arange(n, dtype=np.int32)
        program = highspy.HighsLp()
        program.num_col_, program.num_row_ = n, m
        program.col_cost_ = np.zeros(n)
        program.col_lower_, program.col_upper_ = np.full(n, -highspy.kHighsInf), np.full(n, highspy.kHighsInf)
        program.row_lower_, program.row_upper_ = np.full(m, -highspy.kHighsInf), b
        counts = np.count_nonzero(A, axis=1)
        program.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        program.a_matrix_.start_ = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        program.a_matrix_.index_ = np.nonzero(A)[1].astype(np.int32)
        program.a_matrix_.value_ = A[A != 0]
        program.sense_ = highspy.ObjSense.kMaximize
        self._highs = new_highs()
        for option, value in {
            "threads": 1,
            "primal_feasibility_tolerance": 1e-10,
            "dual_feasibility_tolerance": 1e-10,
            "small_matrix_value": 1e-12,
        }.items():
            self._highs.setOptionValue(option, value)
        self._highs.passModel(program)

    def maximise(self, c: Floats) -> HighsOutcome:
        """Solve for one objective c (n,)."""
        self._highs.changeColsCost(c.size, self._columns, c)
        self._highs.run()
        status = self._names.get(self._highs.getModelStatus(), "unknown")
        solution = self._highs.getSolution()
        point, multipliers = np.array(solution.col_value), np.array(solution.row_dual)
        value = float(c @ point) if status == "optimal" else float("nan")
        return HighsOutcome(status, value, point, multipliers)
