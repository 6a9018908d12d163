"""Two models with common inputs and outputs, as one sparse program: is there an output that both can give?"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from svo.analysis.lifted_rows import LiftedSample, evaluate, line_rows, set_rows
from svo.analysis.reachable_set import ReachableSet, product_bounds
from svo.analysis.sparse_program import Columns, Solution, SparseProgram
from svo.checks import Array, bounded_box, expect, finite_array, is_count
from svo.models import NormalForm, UncertainModel, expect_model, set_in
from svo.models.normal_form import Integers, exponents_of

# In noise widths (for exact sensors: in units of the output). Above what an observer's rounding slack can explain.
LEAST_SEPARATION = 1e-6
_DELTA_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Explanation:
    """One trajectory of a model: states (K, n), disturbances (K, nw), noise (K, ny), each Delta (K, nd)."""

    x: Array
    w: Array
    noise: Array
    delta: Array


@dataclass(frozen=True)
class Witness:
    """Two trajectories with the same inputs (K, nu) and outputs (K, ny): of the plant and of the observer's model.

    Both hold to the solver's tolerance, about 1e-6 of the noise bounds.
    """

    u: Array
    y: Array
    plant: Explanation
    observer: Explanation


def check_comparable(plant: Any, observer: Any) -> None:
    """Raise ValueError unless two models have as many inputs and outputs, and one sampling time."""
    if (plant.n_inputs, plant.n_outputs) != (observer.n_inputs, observer.n_outputs):
        raise ValueError(
            f"observer_model has {observer.n_inputs} inputs and {observer.n_outputs} outputs; expected "
            f"{plant.n_inputs} and {plant.n_outputs}, as plant_model has"
        )
    if plant.Ts != observer.Ts:
        raise ValueError(f"observer_model has Ts = {observer.Ts} s; expected {plant.Ts} s, as plant_model has")


class ModelPair:
    """A plant's and an observer's model with all that is known of the samples, and the program of the first N of them.

    Parameters
    ----------
    plant, observer, horizon, initial, observer_initial, u, schedule
        As for `svo.distinguishability`.
    """

    def __init__(
        self,
        plant: UncertainModel,
        observer: UncertainModel,
        horizon: int,
        initial: HPolytope,
        observer_initial: HPolytope,
        u: ArrayLike | HPolytope | None,
        schedule: ArrayLike | None,
    ) -> None:
        expect_model("plant_model", plant)
        expect_model("observer_model", observer)
        expect(is_count(horizon, 1), "horizon", horizon, "a number of samples >= 1")
        check_comparable(plant, observer)
        boxes = [
            bounded_box(name, P, m.n_states)
            for name, P, m in (("initial", initial, plant), ("observer_initial", observer_initial, observer))
        ]
        shared = exponents_of(plant, *boxes[0])
        alone = exponents_of(observer, *boxes[1])
        own = replace(alone, inputs=shared.inputs, outputs=shared.outputs)
        # An uncertainty of rank two comes apart as in the observer, whatever units the two models share.
        self._shifts = None, (alone.rows - own.rows, alone.columns - own.columns)
        self._forms = NormalForm(plant, shared), NormalForm(observer, own)
        self._models = tuple(form.model for form in self._forms)
        self._initial = tuple(
            set_in(P, form.x) for P, form in zip((initial, observer_initial), self._forms, strict=True)
        )
        self._boxes = [(low / form.x, high / form.x) for (low, high), form in zip(boxes, self._forms, strict=True)]
        self._schedule = _schedules(schedule, horizon, any(m.is_scheduled for m in self._models))
        unit = self._forms[0].u
        self._input_set = set_in(u, unit) if isinstance(u, HPolytope) else None
        low, high = _inputs(u, horizon, plant.n_inputs)
        self._inputs = low / unit, high / unit

    def with_inputs(self, u: Array) -> ModelPair:
        """The same pair under other inputs (horizon, nu)."""
        other = copy(self)
        normal = u / self._forms[0].u
        other._input_set, other._inputs = None, (normal, normal)
        return other

    def solve(self, samples: int, least: float = 0.0) -> PairSolution:
        """The least widening of both noises that gives a common output over the first samples.

        From 0 on, or from ``least`` = -1 on: a negative one tells how much narrower the noises could be.
        """
        program = SparseProgram()
        widening, one = program.columns(least, np.inf), program.columns(1.0, 1.0)
        u = [self._input_columns(program, k) for k in range(samples)]
        each = zip(self._models, self._initial, self._boxes, self._shifts, strict=True)
        sides = [_Side(program, *of) for of in each]
        for k in range(samples):
            for side in sides:
                side.add(u[k], (self._inputs[0][k], self._inputs[1][k]), one, self._schedule[k], k + 1 == samples)
            _common_output(program, sides[0].samples[k], sides[1].samples[k], widening)
        cost = np.zeros(program.column_count)
        cost[widening] = 1.0
        solution = program.minimise(cost)
        if solution is None:  # widening explains anything, so only contradictory sets get here
            raise ValueError("initial, u or w has no point; expected nonempty sets")
        return PairSolution(program, cost, solution, np.array(u), sides[0], sides[1], least, self._forms)

    def _input_columns(self, program: SparseProgram, k: int) -> Columns:
        columns = program.columns(self._inputs[0][k], self._inputs[1][k])
        if self._input_set is not None:
            set_rows(program, columns, self._input_set)
        return columns


class _Side:
    """Variables and rows of one of the two models, sample by sample."""

    def __init__(
        self,
        program: SparseProgram,
        model: UncertainModel,
        initial: HPolytope,
        box: tuple[Array, Array],
        shift: tuple[Integers, Integers] | None,
    ) -> None:
        self.model, self.exact, self.samples = model, True, list[LiftedSample]()
        self._program, self._reachable, self._shift = program, ReachableSet(*box), shift
        self._x = program.columns(*self._reachable.box(), implied=True)
        set_rows(program, self._x, initial)

    def add(self, u: Columns, u_box: tuple[Array, Array], one: Columns, schedule: Any, last: bool) -> None:
        model, program = self.model, self._program
        lower, upper, noise = model.bounds(schedule)
        stack, channels, left = evaluate(model, schedule, self._shift)
        w = program.columns(lower, upper)
        if model.disturbance_polytope is not None:
            set_rows(program, w, model.disturbance_polytope)
        known = np.concatenate([self._x, u, one, w])
        others = (np.concatenate([u_box[0], [1.0], lower]), np.concatenate([u_box[1], [1.0], upper]))
        s = [self._reachable.bounds(c.functional, others) for c in channels]
        corners = [product_bounds(c, *ends) for c, ends in zip(channels, s, strict=True)]
        p_lower, p_upper = np.array(corners).reshape(-1, 2).T
        p = program.columns(p_lower, p_upper, implied=True)
        for c, (low, high), column in zip(channels, s, p, strict=True):
            self.exact &= line_rows(program, c, known, np.array([column]), low, high)
        self.exact &= len({c.owner for c in channels}) == len(channels)
        boxes = zip(*(self._reachable.box(), others), strict=True)
        reach = np.max(np.abs([np.concatenate(ends) for ends in boxes]), axis=0)
        rest, used = left @ reach, left.any(axis=1)
        d, on_d = program.columns(-rest[used], rest[used]), np.eye(len(rest))[:, used]
        self.samples.append(LiftedSample(self._x, w, known, stack, channels, p, noise, d, on_d))
        if not last:
            self._reachable.move(stack, channels, others, (p_lower, p_upper), rest[: model.n_states])
            self._x = program.columns(*self._reachable.box(), implied=True)
            n = model.n_states
            program.rows([*self.samples[-1].terms(slice(0, n)), (self._x, -np.eye(n))], 0.0, 0.0)


@dataclass(frozen=True)
class PairSolution:
    """The program of some number of samples, solved."""

    program: SparseProgram
    cost: Array
    solution: Solution
    u: Columns
    plant: _Side
    observer: _Side
    least: float
    forms: tuple[NormalForm, NormalForm]

    @property
    def _multipliers(self) -> Array:
        # The widening has no upper bound, so its reduced cost must not fall below zero by rounding.
        return (1.0 - 1e-7) * self.solution.multipliers

    @cached_property
    def separation(self) -> float:
        """The widening, proven from below by weak duality."""
        return max(self.least, self.program.weak_dual_bound(self.cost, self._multipliers))

    @property
    def input_slope(self) -> Array:
        """How `separation` grows with the inputs (samples, nu), the multipliers kept.

        For inputs that leave every row as it is (no s = f'(u, 1) changes its sign) the line through this separation
        lies below that of all other inputs: by weak duality, up to the bounds that the solver does not see.
        """
        return self.program.reduced_costs(self.cost, self._multipliers)[self.u] / self.forms[0].u

    @property
    def separated(self) -> bool:
        return self.separation > LEAST_SEPARATION

    @property
    def has_common_output(self) -> bool:
        """Whether the point found is one, as far as the solver's tolerance can tell."""
        return self.solution.value <= 2 * LEAST_SEPARATION

    @property
    def exact(self) -> bool:
        return self.plant.exact and self.observer.exact and (self.separated or self.has_common_output)

    def witness(self) -> Witness | None:
        if not self.has_common_output:
            return None
        point, sides = self.solution.point, (self.plant, self.observer)
        outputs = [_noise_free(side, point) for side in sides]
        noise = [np.array([s.noise for s in side.samples]) for side in sides]
        total = noise[0] + noise[1]
        y = outputs[0] + (outputs[1] - outputs[0]) * noise[0] / np.where(total > 0.0, total, 1.0)
        found = [_explanation(side, point, y - z) for side, z in zip(sides, outputs, strict=True)]
        if found[0] is None or found[1] is None:
            return None
        plant, observer = (_given(e, form) for e, form in zip(found, self.forms, strict=True) if e is not None)
        return Witness(point[self.u] * self.forms[0].u, y * self.forms[0].y, plant, observer)


def _given(e: Explanation, form: NormalForm) -> Explanation:
    """A trajectory in the units of the model as it is given."""
    return Explanation(e.x * form.x, e.w * form.w, e.noise * form.y, e.delta)


def _common_output(program: SparseProgram, a: LiftedSample, b: LiftedSample, widening: Columns) -> None:
    """Rows |output of a - output of b| <= (1 + widening) (sum of noises), in units of that sum."""
    n_a, n_b = len(a.x), len(b.x)
    ny = len(a.noise)
    total = a.noise + b.noise
    scale = np.where(total > 0.0, total, 1.0)[:, None]
    terms = [(columns, matrix / scale) for columns, matrix in a.terms(slice(n_a, n_a + ny))]
    terms += [(columns, -matrix / scale) for columns, matrix in b.terms(slice(n_b, n_b + ny))]
    limit = total / scale[:, 0]
    program.rows([*terms, (widening, -np.ones((ny, 1)))], -np.inf, limit)
    program.rows([*terms, (widening, np.ones((ny, 1)))], -limit, np.inf)


def _noise_free(side: _Side, point: Array) -> Array:
    n = side.model.n_states
    return np.array([sum(m @ point[c] for c, m in s.terms(slice(n, len(s.stack)))) for s in side.samples])


def _deltas(side: _Side, point: Array) -> Array | None:
    """The Delta of each uncertainty that makes the trajectory real (K, nd), or None if there is none."""
    bounds = np.array([q.bounds for q in side.model.uncertainties]).reshape(-1, 2)
    deltas = np.tile(bounds[:, 0], (len(side.samples), 1))
    for k, sample in enumerate(side.samples):
        owners = [c.owner for c in sample.channels]
        if len(set(owners)) < len(owners):
            return None
        for channel, column in zip(sample.channels, sample.p, strict=True):
            s, p = float(channel.functional @ point[sample.known]), float(point[column])
            delta = float(np.clip(p / s, channel.lo, channel.hi)) if s != 0.0 else channel.lo
            if abs(delta * s - p) > _DELTA_TOLERANCE * (channel.hi - channel.lo) * max(1.0, abs(s)):
                return None
            deltas[k, channel.owner] = delta
    return deltas


def _explanation(side: _Side, point: Array, noise: Array) -> Explanation | None:
    """The trajectory of one side, or None if it is one of the relaxed program only."""
    delta = _deltas(side, point)
    if delta is None:
        return None
    x, w = (np.array([point[getattr(s, name)] for s in side.samples]) for name in ("x", "w"))
    return Explanation(x, w, noise, delta)


def _schedules(schedule: ArrayLike | None, horizon: int, needed: bool) -> list[Any]:
    if schedule is None:
        if needed:
            raise ValueError("schedule is missing: a model has arrays that are functions of it; give one a sample")
        return [None] * horizon
    values = finite_array("schedule", schedule)
    if values.ndim < 1 or len(values) < horizon:
        raise ValueError(f"schedule has shape {values.shape}; expected at least {horizon} samples, the horizon")
    return [float(v) if v.ndim == 0 else v for v in values[:horizon]]


def _inputs(u: ArrayLike | HPolytope | None, horizon: int, count: int) -> tuple[Array, Array]:
    """Lower and upper bounds (horizon, nu) of the inputs."""
    if isinstance(u, HPolytope):
        lower, upper = bounded_box("u", u, count)
        return np.tile(lower, (horizon, 1)), np.tile(upper, (horizon, 1))
    if u is None:
        if count:
            raise ValueError(f"u is missing; expected an array ({horizon}, {count}) of inputs, or a set of them")
        return np.zeros((horizon, 0)), np.zeros((horizon, 0))
    values = finite_array("u", u)
    if values.ndim != 2 or values.shape[1] != count or len(values) < horizon:
        raise ValueError(f"u has shape {values.shape}; expected (K, {count}) with K >= {horizon}, the horizon")
    return values[:horizon], values[:horizon]
