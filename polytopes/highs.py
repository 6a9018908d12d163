"""HiGHS, for programs that are large or sparse and for those on which the core gives up; only here by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes.checks import Floats

_CLOSE: Mapping[str, Any] = {
    "threads": 1,
    "primal_feasibility_tolerance": 1e-10,
    "dual_feasibility_tolerance": 1e-10,
    "small_matrix_value": 1e-12,
}


@dataclass(frozen=True)
class HighsOutcome:
    """Answer of HiGHS: "optimal", "unbounded", "infeasible" or "unknown", with point (n,) and multipliers (m,)."""

    status: str
    value: float
    point: Floats
    multipliers: Floats


class HighsProgram:
    """Programs over ``row_lower <= A x <= b`` and ``lower <= x <= upper``, each solved from the basis of the last.

    Nothing is written to standard output (highspy 1.16 prints a banner all the same, so it is excluded).

    Parameters
    ----------
    A : (m, n) array or scipy.sparse.csr_matrix
    b : (m,) array
    row_lower : float or (m,) array
    lower, upper : float or (n,) arrays
    options : mapping
        Of HiGHS, by its names.
    """

    def __init__(
        self,
        A: Any,
        b: Floats,
        *,
        row_lower: ArrayLike = -np.inf,
        lower: ArrayLike = -np.inf,
        upper: ArrayLike = np.inf,
        options: Mapping[str, Any] = _CLOSE,
    ) -> None:
        import highspy  # imported here: not every program needs it, and it takes time to load

        known = highspy.HighsModelStatus
        self._names: dict[Any, str] = {
            known.kOptimal: "optimal",
            known.kUnbounded: "unbounded",
            known.kInfeasible: "infeasible",
        }
        self._least, self._most = highspy.ObjSense.kMinimize, highspy.ObjSense.kMaximize
        m, n = A.shape
        self._columns = np.arange(n, dtype=np.int32)
        program = highspy.HighsLp()
        program.num_col_, program.num_row_, program.col_cost_ = n, m, np.zeros(n)
        program.col_lower_, program.col_upper_ = _filled(lower, n), _filled(upper, n)
        program.row_lower_, program.row_upper_ = _filled(row_lower, m), b
        program.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        program.a_matrix_.start_, program.a_matrix_.index_, program.a_matrix_.value_ = _by_rows(A)
        self._highs: Any = highspy.Highs()
        self._set({"output_flag": False, **options})
        self._highs.passModel(program)

    def maximise(self, c: Floats, **options: Any) -> HighsOutcome:
        """The largest c'x for c (n,), with options of HiGHS that hold from now on."""
        return self._solve(c, self._most, options)

    def minimise(self, c: Floats, **options: Any) -> HighsOutcome:
        """The least c'x for c (n,), with options of HiGHS that hold from now on."""
        return self._solve(c, self._least, options)

    def dual_ray(self) -> Floats | None:
        """After "infeasible": multipliers (m,) of either sign that may prove it; None if none are known."""
        _, known, ray = self._highs.getDualRay()
        return np.asarray(ray, dtype=float) if known else None

    def _solve(self, c: Floats, sense: Any, options: Mapping[str, Any]) -> HighsOutcome:
        self._set(options)
        self._highs.changeObjectiveSense(sense)
        self._highs.changeColsCost(c.size, self._columns, c)
        self._highs.run()
        status = self._names.get(self._highs.getModelStatus(), "unknown")
        solution = self._highs.getSolution()
        point, multipliers = np.array(solution.col_value), np.array(solution.row_dual)
        value = float(c @ point) if status == "optimal" else float("nan")
        return HighsOutcome(status, value, point, multipliers)

    def _set(self, options: Mapping[str, Any]) -> None:
        for name, value in options.items():
            self._highs.setOptionValue(name, value)


def _filled(bound: ArrayLike, size: int) -> Floats:
    return np.broadcast_to(np.asarray(bound, dtype=float), (size,)).copy()


def _by_rows(A: Any) -> tuple[Any, Any, Any]:
    """Where rows start, columns and values of the entries that are not zero."""
    if hasattr(A, "indptr"):
        return A.indptr, A.indices, A.data
    counts = np.count_nonzero(A, axis=1)
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    return starts, np.nonzero(A)[1].astype(np.int32), A[A != 0]
