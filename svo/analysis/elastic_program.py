"""One trajectory of a model through a piece of a log, with bounds that give way at a cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.analysis.elastic_bounds import Bound, Kind, known_factors, not_linear
from svo.analysis.lifted_rows import Channel, evaluate, line_rows, set_rows
from svo.analysis.sparse_program import Columns, SparseProgram, Terms
from svo.checks import Array
from svo.logs.log import Log
from svo.models import NormalForm, UncertainModel, set_in

ROUNDING = 5e-10  # of the data: half of what `svo.analysis.explanation` allows, the other half is the solver's
_HIGH_PRICE = 1e3
_EXACT = 2.0**-10  # unit of readings without noise: the solver keeps to them a thousand times more closely
# Of the sequential program: saving and cost that count as none, share of the Deltas' ranges that is worth a step.
_WORTH_A_STEP, _NOTHING, _SHORTEST, _MOST_STEPS = 1e-2, 1e-9, 1e-2, 30
_LARGEST = 1e18  # relative to the noise, or of an input in normal form: HiGHS takes 1e20 for infinity


@dataclass(frozen=True)
class Explained:
    """A solved piece, about the normal form: relative widenings (bounds,) beyond what was allowed, states (K, n),
    disturbances (K, nw), Deltas (K, ni), and the sign of each channel's s at each sample."""

    widenings: Array
    x: Array
    w: Array
    deltas: Array
    signs: list[Array]

    @property
    def cost(self) -> float:
        return float(self.widenings.sum())


class ElasticProgram:
    """The samples first, ..., first + count - 1 of a log, from a set of first states.

    Log, bounds and set are as they are given; the program is about the model's normal form. A Delta whose s are known,
    as they have no x and w in them, is a variable of its own. That of another one has a value at each sample, or its
    products p = Delta s are variables, one a channel, with the sign of each s fixed.
    """

    def __init__(
        self, form: NormalForm, log: Log, chosen: Sequence[Bound], first: int, count: int, start: HPolytope
    ) -> None:
        self._form, self._model, self._log, self._first, self._count = form, form.model, log, first, count
        self._start = set_in(start, form.x)
        self._chosen = {(bound.kind, bound.index): i for i, bound in enumerate(chosen)}
        units = {"noise": form.y, "disturbance": form.w}
        self._scales = np.array([b.scale / units[b.kind][b.index] if b.kind in units else b.scale for b in chosen])
        self._samples = [_Matrices.of(self._model, log.schedule_at(first + k)) for k in range(count)]
        for k, of in enumerate(self._samples):
            if any(kind == "Delta" and not of.known[i] for kind, i in self._chosen):
                raise ValueError(not_linear("a Delta", f" at sample {first + k}"))
        self.is_exact = all(of.known.all() for of in self._samples)

    def solve(self, allowed: Array) -> Explained | None:
        """The least sum of relative widenings beyond ``allowed`` (bounds,), or None if none is found.

        With Deltas whose s are not known that is a local minimum. The first values of these Deltas come from the signs
        that their s have along the best trajectory with every Delta at its centre; where an uncertainty has several
        channels, from the least squares over their products. The steps of a sequential linear program follow.
        """
        if self.is_exact:
            return self._solve(allowed, self._at_centres())
        centred = self._solve(allowed, self._at_centres(softened=True))
        split = None if centred is None else self._solve(allowed, _Treatment(signs=centred.signs))
        best = None if split is None else self._solve(allowed, _Treatment(split.deltas))
        reach = 1.0
        for _ in range(_MOST_STEPS):
            if best is None or best.cost <= _NOTHING or reach < _SHORTEST:
                break
            moved = self._solve(allowed, _Treatment(best.deltas, about=best, reach=reach))
            found = None if moved is None else self._solve(allowed, _Treatment(moved.deltas))
            if found is not None and found.cost < (1.0 - _WORTH_A_STEP) * best.cost:
                best, reach = found, min(1.0, 2.0 * reach)
            else:
                reach /= 4.0
        return best

    def alone(self, allowed: Array, bound: int, samples: int, signs: list[Array]) -> float:
        """Least relative widening of one bound that explains the first samples, for signs; inf if none does."""
        how = self._at_centres() if self.is_exact else _Treatment(signs=signs)
        found = self._solve(allowed, how, samples, bound)
        return np.inf if found is None else float(found.widenings[bound])

    def _at_centres(self, softened: bool = False) -> _Treatment:
        centres = [sum(q.bounds) / 2 for q in self._model.uncertainties]
        return _Treatment(np.tile(centres, (self._count, 1)), softened=softened)

    def _solve(
        self, allowed: Array, how: _Treatment, samples: int | None = None, only: int | None = None
    ) -> Explained | None:
        """The program of the first samples, with only one bound that gives way if one is named."""
        program, count = SparseProgram(), self._count if samples is None else samples
        free = np.isin(np.arange(len(allowed)), np.arange(len(allowed)) if only is None else only)
        widening = program.columns(np.zeros(len(allowed)), np.where(free, np.inf, 0.0))
        one = program.columns(1.0, 1.0)
        common = program.columns(0.0, np.inf if how.softened else 0.0)
        elastic = _Elastic(program, widening, allowed, common, self._chosen, self._scales)
        lifted: list[_Sample] = []
        x = self._states(program)
        set_rows(program, x, self._start)
        for k in range(count):
            lifted.append(self._sample(elastic, k, x, one, how))
            if k + 1 < count:
                x = self._states(program)
                program.rows([*lifted[-1].terms(slice(0, len(x))), (x, -np.eye(len(x)))], 0.0, 0.0)
        cost = np.zeros(program.column_count)
        cost[widening], cost[common] = 1.0, _HIGH_PRICE
        solution = program.minimise(cost, solver="ipm")
        if solution is None:
            return None
        point = solution.point
        return Explained(
            point[widening],
            np.array([point[s.x] for s in lifted]),
            np.array([point[s.w] for s in lifted]),
            np.array([s.deltas(point) for s in lifted]),
            [s.signs(point) for s in lifted],
        )

    def _states(self, program: SparseProgram) -> Columns:
        n, within = self._model.n_states, self._model.physical_range
        if within is None:
            return program.columns(np.full(n, -np.inf), np.full(n, np.inf))
        return program.columns(within.lower, within.upper)

    def _sample(self, elastic: _Elastic, k: int, x: Columns, one: Columns, how: _Treatment) -> _Sample:
        model, program, of = self._model, elastic.program, self._samples[k]
        lower, upper, noise = model.bounds(self._log.schedule_at(self._first + k))
        now = self._inputs(self._first + k)
        u, w = program.columns(now, now), self._disturbances(elastic, lower, upper)
        known = np.concatenate([x, u, one, w])
        ranges = np.array([q.bounds for q in model.uncertainties]).reshape(-1, 2)
        channels = of.channels if how.values is None else ()
        values = ranges.mean(axis=1) if how.values is None else how.values[k]
        held = np.where(of.known | np.isin(np.arange(len(values)), [c.owner for c in channels]), 0.0, values)
        moved = of.known | (how.about is not None)
        d = program.columns(np.full(moved.sum(), -np.inf), np.full(moved.sum(), np.inf))
        for column, i in zip(d, np.flatnonzero(moved), strict=True):
            low, high = ranges[i] if of.known[i] else how.reach * (ranges[i] - held[i])
            elastic.within(("Delta", int(i)), np.array([column]), float(low), float(high))
        x_at, w_at = (np.zeros(len(x)), np.zeros(len(w))) if how.about is None else (how.about.x[k], how.about.w[k])
        on_d = of.stacks[1:][moved] @ np.concatenate([x_at, now, [1.0], w_at])
        p = program.columns(np.full(len(channels), -np.inf), np.full(len(channels), np.inf))
        for q, channel in enumerate(channels):
            positive = how.signs is None or how.signs[k][q] > 0.0
            program.rows([(known, (1.0 if positive else -1.0) * channel.functional[None, :])], 0.0, np.inf)
            line_rows(program, channel, known, p[q : q + 1], *((0.0, np.inf) if positive else (-np.inf, 0.0)))
        stack = of.stacks[0] + np.tensordot(held, of.stacks[1:], axes=1)
        sample = _Sample(x, w, known, stack, of, ranges, held, moved, d, on_d.T, p)
        self._measure(elastic, k, sample, noise)
        return sample

    def _inputs(self, sample: int) -> Array:
        given = self._log.u[sample]
        now = self._form.inputs(given)
        for j in np.flatnonzero(np.abs(now) > _LARGEST):
            raise ValueError(
                f"u of the log has the value {given[j]:g} of input {j} at sample {sample}, over {_LARGEST:g} times its "
                "unit in the model's normal form; no program can hold that: correct it, or leave these samples out"
            )
        return now

    def _measure(self, elastic: _Elastic, k: int, sample: _Sample, noise: Array) -> None:
        read, n = self._log.y[self._first + k], self._model.n_states
        y = self._form.outputs(read)
        for i in np.flatnonzero(~np.isnan(y)):
            if abs(float(y[i])) / (float(noise[i]) or 1.0) > _LARGEST:
                raise ValueError(
                    f"y of the log has the value {read[i]:g} of sensor {i}, over {_LARGEST:g} times its "
                    "noise; no program can hold that, so where it stands for a missing measurement, leave the cell "
                    "empty (NaN)"
                )
            elastic.measure(int(i), sample.terms(slice(n + i, n + i + 1)), float(y[i]), float(noise[i]))

    def _disturbances(self, elastic: _Elastic, lower: Array, upper: Array) -> Columns:
        w = elastic.program.columns(np.full_like(lower, -np.inf), np.full_like(upper, np.inf))
        for j in range(len(w)):
            elastic.within(("disturbance", j), w[j : j + 1], lower[j], upper[j])
        if self._model.disturbance_polytope is not None:
            set_rows(elastic.program, w, self._model.disturbance_polytope)
        return w


@dataclass(frozen=True)
class _Treatment:
    """How Deltas enter a program where their s are not known: at ``values`` (K, ni), or if there are none, by products
    p of s with ``signs`` (of each channel at each sample).

    ``about`` a trajectory with these values, the Deltas move within ``reach`` of their range, times the s that it has.
    ``softened``, all noise gives way at a high price: at these values the chosen bounds may not suffice.
    """

    values: Array | None = None
    signs: list[Array] | None = None
    about: Explained | None = None
    reach: float = 0.0
    softened: bool = False


@dataclass(frozen=True)
class _Matrices:
    """Those of a sample: stacks (1 + ni, n + ny, n + nu + 1 + nw), whether the s of each Delta are known (ni,), and
    the channels of the others that have a range."""

    stacks: Array
    known: NDArray[np.bool_]
    channels: tuple[Channel, ...]

    @classmethod
    def of(cls, model: UncertainModel, schedule: Any) -> _Matrices:
        stacks = model.stack(schedule)
        known = known_factors(model, stacks)
        # What they leave out is far below the solver's tolerance, and nothing is concluded from them alone.
        channels = tuple(c for c in evaluate(model, schedule)[1] if not known[c.owner])
        return cls(stacks, known, channels)


@dataclass(frozen=True)
class _Sample:
    """A sample in a program: Deltas (ni,) are ``held`` in the stack, and those that are ``moved`` add d to that; the
    products p of the others are variables."""

    x: Columns
    w: Columns
    known: Columns
    stack: Array
    of: _Matrices
    ranges: Array
    held: Array
    moved: NDArray[np.bool_]
    d: Columns
    on_d: Array
    p: Columns

    def terms(self, rows: slice) -> Terms:
        """The rows of [x(k+1); y(k)] as terms of a program."""
        gains = np.array([c.gain for c in self.of.channels[: len(self.p)]]).reshape(-1, len(self.stack)).T
        return [(self.known, self.stack[rows]), (self.d, self.on_d[rows]), (self.p, gains[rows])]

    def signs(self, point: Array) -> Array:
        """Of the s of each channel."""
        return np.array([1.0 if c.functional @ point[self.known] >= 0.0 else -1.0 for c in self.of.channels])

    def deltas(self, point: Array) -> Array:
        """Each Delta (ni,): where its products are variables, the one that fits them best."""
        found, over = self.held.copy(), np.zeros((2, len(self.held)))
        found[self.moved] += point[self.d]
        for channel, p in zip(self.of.channels, point[self.p], strict=False):
            s, weight = float(channel.functional @ point[self.known]), float(channel.gain @ channel.gain)
            over[:, channel.owner] += weight * p * s, weight * s * s
        split = np.isin(np.arange(len(found)), [c.owner for c in self.of.channels[: len(self.p)]])
        fit = np.divide(over[0], over[1], out=np.zeros(len(found)), where=over[1] > 0.0)
        found[split] = np.clip(fit, *self.ranges.T)[split]
        return found


@dataclass(frozen=True)
class _Elastic:
    """Rows of a program whose bounds give way: ``widening`` and ``allowed`` have one entry a chosen bound."""

    program: SparseProgram
    widening: Columns
    allowed: Array
    common: Columns
    chosen: dict[tuple[Kind, int], int]
    scales: Array

    def within(self, key: tuple[Kind, int], column: Columns, lower: float, upper: float) -> None:
        """A variable between two bounds, each of which moves by the widening."""
        variable = (column, np.ones((1, 1)))
        if key not in self.chosen:
            self.program.rows([variable], lower, upper)
            return
        i = self.chosen[key]
        step = self.scales[i]
        more, less = self._widening(i, step)
        self.program.rows([variable, more], lower - step * self.allowed[i], np.inf)
        self.program.rows([variable, less], -np.inf, upper + step * self.allowed[i])

    def measure(self, sensor: int, terms: Terms, y: float, noise: float) -> None:
        """A noise-free output (terms) within the sensor's noise of what was read."""
        width = noise + ROUNDING * (abs(y) + noise)
        i = self.chosen.get(("noise", sensor))
        if i is not None:
            width += self.scales[i] * self.allowed[i]
        unit = noise or _EXACT  # rows of about size one, for the solver's absolute tolerance
        row = [(columns, matrix / unit) for columns, matrix in terms]
        above, below = [*row, (self.common, np.ones((1, 1)))], [*row, (self.common, -np.ones((1, 1)))]
        if i is not None:
            more, less = self._widening(i, self.scales[i] / unit)
            above, below = [*above, more], [*below, less]
        self.program.rows(above, (y - width) / unit, np.inf)
        self.program.rows(below, -np.inf, (y + width) / unit)

    def _widening(self, i: int, step: float) -> tuple[tuple[Columns, Array], tuple[Columns, Array]]:
        column = self.widening[i : i + 1]
        return (column, np.full((1, 1), step)), (column, np.full((1, 1), -step))
