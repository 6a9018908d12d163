"""The window observer's programs written for general solvers: HiGHS, persistent or rebuilt, and cvxpy with Clarabel.

The same window in the form that suits them: states as variables, so that the rows are sparse, and everything scaled to
the size of what is uncertain,

    x(k+1) = A x(k) + E w(k) + r,   lower <= C x(k) <= upper,   |w| <= 1,   x(base) in the arrival box.

The scaling is done before any clock starts.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import cvxpy as cp
import highspy
import numpy as np
from numpy.typing import NDArray

from svo.logs.log import Log
from svo.models.model import UncertainModel

Floats = NDArray[np.float64]
Options = dict[str, bool | int | float | str]
DEFAULT: Options = {"output_flag": False, "threads": 1}
# The fastest that were tried. Presolve and HiGHS' own scaling cost more than they save on these small programs.
PLAIN: Options = DEFAULT | {"solver": "simplex", "presolve": "off", "simplex_scale_strategy": 0}
PRIMAL: Options = PLAIN | {"simplex_strategy": 4, "primal_simplex_bound_perturbation_multiplier": 0.0}
DUAL: Options = PLAIN | {"simplex_strategy": 1, "dual_simplex_cost_perturbation_multiplier": 0.0}


@dataclass(frozen=True)
class Query:
    """What an observer solves at a sample: supports of x(target) over the window base .. time.

    ``programs`` are the numbers of the supports, two a state, its upper bound first.
    """

    base: int
    time: int
    target: int
    programs: range


@dataclass(frozen=True)
class ScaledSamples:
    """A log seen by a model without uncertainties and D, over x = centre + unit * xi and w in [-1, 1].

    Attributes
    ----------
    A, E, r : (K, n, n), (K, n, nw), (K, n) arrays
        From sample k to k + 1.
    C, lower, upper : (K, ny, n), (K, ny), (K, ny) arrays
        Rows of the measurements at k.
    """

    A: Floats
    E: Floats
    r: Floats
    C: Floats
    lower: Floats
    upper: Floats

    @classmethod
    def of(cls, model: UncertainModel, log: Log, slack: Floats, centre: Floats, unit: Floats) -> ScaledSamples:
        """Scale a log; ``slack`` (K, ny) is what the observer adds to the noise."""
        n, nu = model.n_states, model.n_inputs
        rows = []
        for k in range(len(log)):
            stack, (w_lower, w_upper, noise) = model.stack(log.schedule_at(k))[0], model.bounds(log.schedule_at(k))
            A, B, a, E = np.split(stack[:n], [n, n + nu, n + nu + 1], axis=1)
            C, c = stack[n:, :n], stack[n:, n + nu]
            drift = A @ centre + B @ log.u[k] + a[:, 0] + E @ (0.5 * (w_lower + w_upper)) - centre
            width = noise + slack[k]
            residual = (log.y[k] - c - C @ centre) / width
            spread = 0.5 * (w_upper - w_lower)
            rows.append(
                (
                    A * unit / unit[:, None],
                    E * spread / unit[:, None],
                    drift / unit,
                    C * unit / width[:, None],
                    residual - 1.0,
                    residual + 1.0,
                )
            )
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))


class HighsWindow:
    """HiGHS on a moving window.

    Samples live in ring slots: a shift writes the new sample over a dropped one and touches nothing else, so the basis
    of the last program is a warm start for the next.

    Parameters
    ----------
    samples : ScaledSamples
    steps : int
        Steps that the window holds at most.
    lower, upper : (n,) arrays
        Scaled box of the state at sample 0.
    options : dict
        Of HiGHS.
    rebuild : bool
        Pass a new model at each sample, instead of changing the coefficients and bounds of the present one.
    """

    def __init__(
        self, samples: ScaledSamples, steps: int, lower: Floats, upper: Floats, options: Options, rebuild: bool
    ) -> None:
        self._samples, self._slots, self._rebuild = samples, steps + 1, rebuild
        self._n, self._nw, self._ny = samples.A.shape[1], samples.E.shape[2], samples.C.shape[1]
        self._base = 0
        self._solver: Any = highspy.Highs()
        for name, value in options.items():
            self._solver.setOptionValue(name, value)
        self._lay_out()
        self._column_lower[: self._n], self._column_upper[: self._n] = lower, upper
        self._write_outputs(0)
        self._solver.passModel(self._model())

    def advance(self, k: int) -> None:
        """Add the transition k - 1 -> k and the measurement at k."""
        samples, slot = self._samples, (k - 1) % self._slots
        values, where = self._values, self._where[slot]
        values[where[0]] = -samples.A[k - 1][self._patterns[0]]
        values[where[1]] = -samples.E[k - 1][self._patterns[1]]
        states = self._states(slot)
        self._row_lower[states] = self._row_upper[states] = samples.r[k - 1]
        self._write_outputs(k)
        if not self._rebuild:
            new = k % self._slots
            self._send(slot, 0)
            self._send(slot, 1)
            self._send(new, 2)
            self._send_rows(np.concatenate([self._numbers[states], self._numbers[self._outputs(new)]]))

    def slide(self, base: int, lower: Floats, upper: Floats) -> None:
        """Drop the samples before ``base``, whose state lies in the scaled box."""
        for k in range(self._base, base):
            slot = k % self._slots
            for rows in (self._states(slot), self._outputs(slot)):
                self._row_lower[rows], self._row_upper[rows] = -np.inf, np.inf
            columns = self._states(slot)
            self._column_lower[columns], self._column_upper[columns] = -np.inf, np.inf
        self._base = base
        columns = self._states(base % self._slots)
        self._column_lower[columns], self._column_upper[columns] = lower, upper
        if not self._rebuild:
            self._send_rows(self._numbers)
            states = self._numbers[: self._slots * self._n]
            bounds = self._column_lower[states], self._column_upper[states]
            self._solver.changeColsBounds(states.size, states, *bounds)

    def solve(self, query: Query) -> Floats:
        """The bounds of the scaled x(target) that are asked for; NaN where HiGHS gives no optimum."""
        if self._rebuild:
            self._solver.passModel(self._model())
        first, values = self._states(query.target % self._slots).start, []
        for program in query.programs:
            sign, column = 1.0 - 2.0 * (program % 2), first + program // 2
            self._solver.changeColCost(column, sign)
            self._solver.run()
            optimal = self._solver.getModelStatus() == highspy.HighsModelStatus.kOptimal
            values.append(sign * self._solver.getObjectiveValue() if optimal else np.nan)
            self._solver.changeColCost(column, 0.0)
        return np.array(values)

    # -- inside ------------------------------------------------------------------------------------

    def _states(self, slot: int) -> slice:
        """Columns of a slot's state, and the rows of the transition that leaves it."""
        return slice(slot * self._n, (slot + 1) * self._n)

    def _outputs(self, slot: int) -> slice:
        first = self._slots * self._n
        return slice(first + slot * self._ny, first + (slot + 1) * self._ny)

    def _lay_out(self) -> None:
        """The sparsity pattern, and where each slot's A, E, C and following state stand in it."""
        n, nw, ny, S = self._n, self._nw, self._ny, self._slots
        data = (self._samples.A, self._samples.E, self._samples.C)
        self._patterns = [np.nonzero(np.any(m != 0.0, axis=0)) for m in data]
        (ar, ac), (er, ec), (cr, cc) = self._patterns
        rows, columns, self._where = [], [], []
        at = 0
        for slot in range(S):
            parts = (
                (slot * n + ar, slot * n + ac),
                (slot * n + er, S * n + slot * nw + ec),
                (S * n + slot * ny + cr, slot * n + cc),
                (slot * n + np.arange(n), (slot + 1) % S * n + np.arange(n)),
            )
            ends = at + np.cumsum([0, *(len(r) for r, _ in parts)])
            self._where.append([slice(a, b) for a, b in pairwise(ends.tolist())])
            at = int(ends[-1])
            rows += [r for r, _ in parts]
            columns += [c for _, c in parts]
        row, column = np.concatenate(rows), np.concatenate(columns)
        self._values = np.zeros(at)
        for where in self._where:
            self._values[where[3]] = 1.0
        self._positions = [[list(zip(row[w].tolist(), column[w].tolist(), strict=True)) for w in where[:3]]
                           for where in self._where]  # fmt: skip
        self._order = np.lexsort((column, row))
        self._starts = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=S * (n + ny)))])
        self._indices = column[self._order]
        self._row_lower, self._row_upper = np.full(S * (n + ny), -np.inf), np.full(S * (n + ny), np.inf)
        self._numbers = np.arange(self._row_lower.size, dtype=np.int32)
        self._column_upper = np.concatenate([np.full(S * n, np.inf), np.ones(S * nw)])
        self._column_lower = -self._column_upper

    def _model(self) -> Any:
        lp = highspy.HighsLp()
        lp.num_col_, lp.num_row_ = self._column_lower.size, self._row_lower.size
        lp.col_cost_, lp.col_lower_, lp.col_upper_ = np.zeros(lp.num_col_), self._column_lower, self._column_upper
        lp.row_lower_, lp.row_upper_ = self._row_lower, self._row_upper
        lp.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        lp.a_matrix_.start_, lp.a_matrix_.index_ = self._starts, self._indices
        lp.a_matrix_.value_ = self._values[self._order]
        lp.sense_ = highspy.ObjSense.kMaximize
        return lp

    def _write_outputs(self, k: int) -> None:
        slot = k % self._slots
        self._values[self._where[slot][2]] = self._samples.C[k][self._patterns[2]]
        rows = self._outputs(slot)
        self._row_lower[rows], self._row_upper[rows] = self._samples.lower[k], self._samples.upper[k]

    def _send(self, slot: int, part: int) -> None:
        values = self._values[self._where[slot][part]].tolist()
        for (row, column), value in zip(self._positions[slot][part], values, strict=True):
            self._solver.changeCoeff(row, column, value)

    def _send_rows(self, rows: NDArray[np.int32]) -> None:
        self._solver.changeRowsBounds(rows.size, rows, self._row_lower[rows], self._row_upper[rows])


class CvxpyWindow:
    """A window as a cvxpy problem with parameters (DPP), compiled for its steps and programs, solved by Clarabel.

    All programs of a sample are copies in one problem, its columns: faster than a problem a program.
    """

    def __init__(self, samples: ScaledSamples, steps: int, programs: range, target: int) -> None:
        n, nw, ny = samples.A.shape[1], samples.E.shape[2], samples.C.shape[1]
        self._samples, self._steps = samples, steps
        self._A, self._E = cp.Parameter((steps * n, n)), cp.Parameter((steps * n, nw))
        self._C = cp.Parameter(((steps + 1) * ny, n))
        self._r = cp.Parameter((steps * n, 1))
        self._lower, self._upper = cp.Parameter(((steps + 1) * ny, 1)), cp.Parameter(((steps + 1) * ny, 1))
        self._box = cp.Parameter((n, 1)), cp.Parameter((n, 1))
        count = len(programs)
        self._cost = (np.repeat(np.eye(n), 2, axis=1) * np.tile([1.0, -1.0], n))[:, programs]
        one = np.ones((1, count))
        x = [cp.Variable((n, count)) for _ in range(steps + 1)]
        w = [cp.Variable((nw, count)) for _ in range(steps)]
        constraints = [x[0] >= self._box[0] @ one, x[0] <= self._box[1] @ one]
        for k in range(steps):
            part = slice(k * n, (k + 1) * n)
            constraints += [w[k] <= 1.0, w[k] >= -1.0]
            constraints.append(x[k + 1] == self._A[part] @ x[k] + self._E[part] @ w[k] + self._r[part] @ one)
        for k in range(steps + 1):
            part = slice(k * ny, (k + 1) * ny)
            y = self._C[part] @ x[k]
            constraints += [y >= self._lower[part] @ one, y <= self._upper[part] @ one]
        self._target = x[target]
        self._problem = cp.Problem(cp.Maximize(cp.sum(cp.multiply(self._cost, self._target))), constraints)
        assert self._problem.is_dpp()

    def solve(self, query: Query, lower: Floats, upper: Floats) -> Floats:
        """The bounds of the scaled x(target) that were compiled, from the scaled box at the base."""
        s, inside, all_samples = self._samples, slice(query.base, query.time), slice(query.base, query.time + 1)
        self._A.value = s.A[inside].reshape(self._A.shape)
        self._E.value = s.E[inside].reshape(self._E.shape)
        self._r.value = s.r[inside].reshape(self._r.shape)
        self._C.value = s.C[all_samples].reshape(self._C.shape)
        self._lower.value = s.lower[all_samples].reshape(self._lower.shape)
        self._upper.value = s.upper[all_samples].reshape(self._upper.shape)
        self._box[0].value, self._box[1].value = lower[:, None], upper[:, None]
        self._problem.solve(solver=cp.CLARABEL)
        return (self._target.value * self._cost).sum(axis=0) * self._cost.sum(axis=0)
