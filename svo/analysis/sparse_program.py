"""Sparse linear programs, written block by block and solved by HiGHS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix

from polytopes.highs import HighsProgram
from svo.checks import Array

Columns = NDArray[np.int64]
Terms = Sequence[tuple[Columns, Array]]

FEASIBILITY = 1e-9  # HiGHS, absolute, of a row and of a reduced cost
_STEPS = {"ipm_iteration_limit": 1_000, "simplex_iteration_limit": 1_000_000}  # far more than any that ended


@dataclass(frozen=True)
class Solution:
    """An optimum: value, point (columns,) and multipliers (rows,), positive on lower bounds of the rows."""

    value: float
    point: Array
    multipliers: Array


class SparseProgram:
    """min cost'z subject to row_lower <= A z <= row_upper and lower <= z <= upper, built by blocks."""

    def __init__(self) -> None:
        self._columns: list[tuple[Array, Array, bool]] = []
        self._rows: list[tuple[Array, Array]] = []
        self._entries: list[tuple[Columns, Columns, Array]] = []
        self._column_count = self._row_count = 0

    @property
    def column_count(self) -> int:
        return self._column_count

    def columns(self, lower: ArrayLike, upper: ArrayLike, implied: bool = False) -> Columns:
        """New variables within bounds (m,), and their indices (m,).

        ``implied`` bounds follow from the rows: they are kept from the solver and serve `weak_dual_bound` only.
        """
        low, high = np.atleast_1d(np.asarray(lower, dtype=float)), np.atleast_1d(np.asarray(upper, dtype=float))
        first = self._column_count
        self._columns.append((low, high, implied))
        self._column_count += len(low)
        return np.arange(first, self._column_count)

    def rows(self, terms: Terms, lower: ArrayLike, upper: ArrayLike) -> None:
        """Rows lower <= sum of matrix @ z[columns] <= upper, for terms (columns (m,), matrix (rows, m))."""
        count = len(terms[0][1])
        for columns, matrix in terms:
            i, j = np.nonzero(matrix)
            self._entries.append((i + self._row_count, columns[j], matrix[i, j]))
        low, high = (np.broadcast_to(np.asarray(b, dtype=float), (count,)) for b in (lower, upper))
        self._rows.append((low, high))
        self._row_count += count

    def minimise(self, cost: Array, solver: Literal["simplex", "ipm"] = "simplex") -> Solution | None:
        """The optimum for a cost (columns,); None if no point satisfies the rows.

        The interior-point method ("ipm", with crossover) is the faster one for programs of hundreds of samples.

        Raises
        ------
        RuntimeError
            If HiGHS cannot decide.
        """
        (lower, upper), (row_lower, row_upper) = self._column_bounds(for_solver=True), self._row_bounds()
        matrix, status = self._matrix(), ""
        for method, presolve in ((solver, "on"), ("simplex", "off")):  # thin programs leave one of them undecided
            options = {"threads": 1, "small_matrix_value": 1e-12, "solver": method, "presolve": presolve}
            options |= _STEPS | {f"{side}_feasibility_tolerance": FEASIBILITY for side in ("primal", "dual")}
            program = HighsProgram(matrix, row_upper, row_lower=row_lower, lower=lower, upper=upper, options=options)
            found = program.minimise(cost)
            status = found.status
            if status == "infeasible":
                return None
            if status == "optimal":
                return Solution(found.value, found.point, found.multipliers)
        raise RuntimeError(f"HiGHS left a program of {self._row_count} rows undecided ({status}); take fewer samples")

    def weak_dual_bound(self, cost: Array, multipliers: Array) -> float:
        """A lower bound of every point's cost, whatever the multipliers (rows,): weak duality over the bounds."""
        row_lower, row_upper = self._row_bounds()
        lower, upper = self._column_bounds(for_solver=False)
        up, down = self._usable(multipliers)
        reduced = self.reduced_costs(cost, multipliers)
        return _least(up, row_lower, row_upper) + _least(down, row_lower, row_upper) + _least(reduced, lower, upper)

    def reduced_costs(self, cost: Array, multipliers: Array) -> Array:
        """What each column (columns,) adds to the weak dual bound per unit of its value."""
        up, down = self._usable(multipliers)
        return cost - self._matrix().T @ (up + down)

    def _usable(self, multipliers: Array) -> tuple[Array, Array]:
        """Multipliers of lower and of upper bounds of the rows, without those of infinite ones."""
        row_lower, row_upper = self._row_bounds()
        up = np.where(np.isfinite(row_lower), np.maximum(multipliers, 0.0), 0.0)
        return up, np.where(np.isfinite(row_upper), np.minimum(multipliers, 0.0), 0.0)

    def _matrix(self) -> csr_matrix:
        i, j, values = (np.concatenate(parts) for parts in zip(*self._entries, strict=True))
        return csr_matrix((values, (i, j)), shape=(self._row_count, self._column_count))

    def _row_bounds(self) -> tuple[Array, Array]:
        return np.concatenate([r[0] for r in self._rows]), np.concatenate([r[1] for r in self._rows])

    def _column_bounds(self, for_solver: bool) -> tuple[Array, Array]:
        hidden = [implied and for_solver for *_, implied in self._columns]
        lower = [np.full_like(c[0], -np.inf) if h else c[0] for c, h in zip(self._columns, hidden, strict=True)]
        upper = [np.full_like(c[1], np.inf) if h else c[1] for c, h in zip(self._columns, hidden, strict=True)]
        return np.concatenate(lower), np.concatenate(upper)


def _least(coefficients: Array, lower: Array, upper: Array) -> float:
    """min coefficients'z over lower <= z <= upper; a zero coefficient meets an infinite bound without harm."""
    used = coefficients != 0.0
    c = coefficients[used]
    return float(np.sum(c * np.where(c > 0.0, lower[used], upper[used])))
