"""The full-information program: everything that is known since the first sample, in one linear program.

States are explicit variables, rows are written straight from the model's equations and HiGHS solves them,
so this shares neither formulation nor solver with the observers. It is exact: a channel p = Delta s of
uncertainty (one rank-one stack, one s a sample) has the rows lo s <= p <= hi s where s >= 0 and the
reversed ones where s <= 0, and every pattern of signs is a program of its own.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from svo.logs.log import Log
from svo.models.model import UncertainModel

Array = NDArray[np.float64]
Signs = tuple[int, ...]

# Exact sensors (n = 0) read a rounded value: as the observers do, leave room for that.
ROUNDING = 1e-9
# Thin programs leave HiGHS undecided now and then; the next setting decides them.
_OPTIONS = tuple(
    {"primal_feasibility_tolerance": tolerance, "dual_feasibility_tolerance": tolerance, "presolve": presolve}
    for tolerance in (1e-10, 1e-9)
    for presolve in (True, False)
)


@dataclass(frozen=True)
class Channel:
    """Stack of one uncertainty as g f': p = Delta f'(x, u, 1, w) enters [x(k+1); y(k)] with g."""

    g: Array
    f: Array
    lo: float
    hi: float


@dataclass(frozen=True)
class Box:
    """Bounds of the newest state; ``empty`` if nothing explains the data."""

    empty: bool
    lower: Array
    upper: Array


class FullInformation:
    """All data of a log from a box of first states, for one pattern of the signs of s.

    ``signs`` has an entry for each sample and channel, sample by sample: +1 or -1. A channel whose s is
    known (no x and w in it) has the sign of its s, whatever the entry. Measurement rows are widened by
    ``rounding`` (1 + |y|).
    """

    def __init__(
        self, model: UncertainModel, log: Log, lower: Array, upper: Array, signs: Signs = (), rounding: float = ROUNDING
    ) -> None:
        self.model, self.log, self.rounding = model, log, rounding
        self.samples = len(log)
        channels = [self._channels(k) for k in range(self.samples)]
        self.size = model.n_states + model.n_disturbances + len(channels[0])
        self.columns = self.samples * self.size + 1  # the last one is the margin
        self._rows: list[tuple[dict[int, float], float, float, float]] = []
        for j in range(model.n_states):
            self._add({self._x(0, j): 1.0}, lower[j], upper[j])
        pattern = iter(signs)
        for k in range(self.samples):
            self._disturbances(k)
            for q, channel in enumerate(channels[k]):
                self._channel(k, q, channel, next(pattern, 1))
            self._equations(k, channels[k])

    # -- answers -----------------------------------------------------------------------------------

    def margin(self) -> float:
        """Smallest widening of every sensor's noise that explains the data; -1 at least, below zero with room."""
        cost = np.zeros(self.columns)
        cost[-1] = 1.0
        result = self._solve(cost, margin=True)
        return np.inf if result.status == 2 else float(result.fun)

    def support(self, direction: Array) -> float:
        """max direction'x over the newest state; -inf if nothing explains the data."""
        cost = np.zeros(self.columns)
        newest = self._x(self.samples - 1, 0)
        cost[newest : newest + self.model.n_states] = -np.asarray(direction, dtype=float)
        result = self._solve(cost, margin=False)
        return -np.inf if result.status == 2 else -float(result.fun)

    # -- rows ----------------------------------------------------------------------------------------

    def _solve(self, cost: Array, margin: bool) -> Any:
        matrix = np.zeros((len(self._rows), self.columns))
        for i, (row, *_) in enumerate(self._rows):
            matrix[i, list(row)] = list(row.values())
        low, high, soft = (np.array([r[c] for r in self._rows]) for c in (1, 2, 3))
        widened = np.outer(soft, np.eye(1, self.columns, self.columns - 1)[0])
        equal = (low == high) & (soft == 0)
        above, below = np.isfinite(high) & ~equal, np.isfinite(low) & ~equal
        program: dict[str, Any] = {
            "c": cost,
            "A_ub": np.vstack([(matrix - widened)[above], (-matrix - widened)[below]]),
            "b_ub": np.concatenate([high[above], -low[below]]),
            "A_eq": matrix[equal],
            "b_eq": high[equal],
            "bounds": [(None, None)] * (self.columns - 1) + [(-1.0, None) if margin else (0.0, 0.0)],
        }
        for method in ("highs", "highs-ipm"):  # where the simplex method leaves it open, the other one
            for options in _OPTIONS:
                result = linprog(**program, method=method, options=options)
                if result.status in (0, 2):
                    return result
        raise AssertionError(f"the oracle's solver answered {result.status}: {result.message}")

    def _add(self, row: dict[int, float], low: float, high: float, soft: float = 0.0) -> None:
        self._rows.append((row, low, high, soft))

    def _x(self, k: int, j: int) -> int:
        return k * self.size + j

    def _w(self, k: int, j: int) -> int:
        return k * self.size + self.model.n_states + j

    def _p(self, k: int, q: int) -> int:
        return k * self.size + self.model.n_states + self.model.n_disturbances + q

    def _known(self, k: int, coefficients: Array) -> tuple[dict[int, float], float]:
        """A row over (x, u, 1, w) of sample k as coefficients of variables and a constant."""
        n, nu, model = self.model.n_states, self.model.n_inputs, self.model
        row = {self._x(k, j): float(coefficients[j]) for j in range(n)}
        row |= {self._w(k, j): float(coefficients[n + nu + 1 + j]) for j in range(model.n_disturbances)}
        return row, float(coefficients[n : n + nu] @ self.log.u[k] + coefficients[n + nu])

    def _disturbances(self, k: int) -> None:
        polytope, count = self.model.disturbance_polytope, self.model.n_disturbances
        if polytope is None:
            lower, upper, _ = self.model.bounds(self.log.schedule_at(k))
            for j in range(count):
                self._add({self._w(k, j): 1.0}, lower[j], upper[j])
            return
        for a, b in zip(polytope.A, polytope.b, strict=True):
            self._add({self._w(k, j): a[j] for j in range(count)}, -np.inf, b)
        for c, d in zip(polytope.C, polytope.d, strict=True):
            self._add({self._w(k, j): c[j] for j in range(count)}, d, d)

    def _channels(self, k: int) -> list[Channel]:
        stack = self.model.stack(self.log.schedule_at(k))
        return [_rank_one(item, q.bounds) for item, q in zip(stack[1:], self.model.uncertainties, strict=True)]

    def _channel(self, k: int, q: int, channel: Channel, sign: int) -> None:
        row, constant = self._known(k, channel.f)
        if not any(row.values()):
            ends = sorted((channel.lo * constant, channel.hi * constant))
            self._add({self._p(k, q): 1.0}, *ends)
            return
        self._add({j: sign * v for j, v in row.items()}, -sign * constant, np.inf)
        for delta, side in ((channel.lo, sign), (channel.hi, -sign)):
            # side (p - delta s) >= 0
            coefficients = {j: -side * delta * v for j, v in row.items()} | {self._p(k, q): float(side)}
            self._add(coefficients, side * delta * constant, np.inf)

    def _equations(self, k: int, channels: list[Channel]) -> None:
        n, ny = self.model.n_states, self.model.n_outputs
        schedule = self.log.schedule_at(k)
        nominal, noise = self.model.stack(schedule)[0], self.model.bounds(schedule)[2]
        for i in range(n + ny):
            row, constant = self._known(k, nominal[i])
            row |= {self._p(k, q): float(channel.g[i]) for q, channel in enumerate(channels)}
            if i < n and k + 1 < self.samples:
                self._add(row | {self._x(k + 1, i): -1.0}, -constant, -constant)
            elif i >= n and not np.isnan(self.log.y[k, i - n]):
                y = float(self.log.y[k, i - n])
                width = float(noise[i - n]) + self.rounding * (1 + abs(y))
                self._add(row, y - width - constant, y + width - constant, soft=1.0)


def box(
    model: UncertainModel,
    log: Log,
    lower: Array,
    upper: Array,
    signs: list[Signs] | None = None,
    rounding: float = ROUNDING,
) -> Box:
    """Exact bounds of the newest state of ``log``, the union over the patterns of signs (all, by default)."""
    n = model.n_states
    patterns = all_signs(model, log) if signs is None else signs
    low, high = np.full(n, np.inf), np.full(n, -np.inf)
    for pattern in patterns:
        program = FullInformation(model, log, lower, upper, pattern, rounding)
        for j, axis in enumerate(np.eye(n)):
            high[j] = max(high[j], program.support(axis))
            low[j] = min(low[j], -program.support(-axis))
    return Box(empty=bool((high == -np.inf).any()), lower=low, upper=high)


def margin(model: UncertainModel, log: Log, lower: Array, upper: Array, signs: list[Signs] | None = None) -> float:
    """Smallest widening of all noise bounds that explains ``log``: above zero, no observer may call it consistent
    with all data; below zero, none may call it falsified."""
    patterns = all_signs(model, log) if signs is None else signs
    return min(FullInformation(model, log, lower, upper, pattern).margin() for pattern in patterns)


def all_signs(model: UncertainModel, log: Log) -> list[Signs]:
    """Every pattern of signs over the samples and channels; one pattern if every s is known."""
    n, nu = model.n_states, model.n_inputs
    free = [
        np.any(np.delete(_rank_one(item, (0, 0)).f, np.s_[n : n + nu + 1]))
        for k in range(len(log))
        for item in model.stack(log.schedule_at(k))[1:]
    ]
    if sum(free) > 12:
        raise AssertionError(f"2^{sum(free)} patterns of signs; give the oracle a shorter log, or the signs")
    return list(itertools.product(*[(1, -1) if f else (1,) for f in free]))


def signs_along(model: UncertainModel, log: Log) -> Signs:
    """The pattern of signs of s along the true states, with w at the centre of its bounds."""
    signs = []
    for k in range(len(log)):
        schedule = log.schedule_at(k)
        lower, upper, _ = model.bounds(schedule)
        assert log.x is not None
        known = np.concatenate([log.x[k], log.u[k], [1.0], (lower + upper) / 2])
        channels = [_rank_one(item, (0.0, 0.0)) for item in model.stack(schedule)[1:]]
        signs += [1 if channel.f @ known >= 0 else -1 for channel in channels]
    return tuple(signs)


def prefix(log: Log, samples: int) -> Log:
    """The first samples of a log."""
    parts = {name: getattr(log, name) for name in ("x", "schedule")}
    cut = {name: None if value is None else value[:samples] for name, value in parts.items()}
    return Log(time=log.time[:samples], u=log.u[:samples], y=log.y[:samples], **cut)


def _rank_one(item: Array, bounds: tuple[float, float]) -> Channel:
    if not item.any():
        return Channel(np.zeros(item.shape[0]), np.zeros(item.shape[1]), *bounds)
    row = int(np.argmax(np.abs(item).max(axis=1)))
    column = int(np.argmax(np.abs(item[row])))
    g, f = item[:, column] / item[row, column], item[row]
    if not np.allclose(np.outer(g, f), item, rtol=1e-12, atol=1e-12 * np.abs(item).max()):
        raise AssertionError("an uncertainty of higher rank than one has no exact program here")
    return Channel(g, f, *bounds)
