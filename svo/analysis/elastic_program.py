"""One trajectory of a model through a piece of a log, with bounds that give way at a cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from polytopes import HPolytope
from svo.analysis.lifted_rows import Channel, LiftedSample, evaluate, line_rows, set_rows
from svo.analysis.sparse_program import Columns, SparseProgram, Terms
from svo.checks import Array
from svo.logs.log import Log
from svo.models.model import UncertainModel
from svo.models.normal_form import NormalForm, set_in

Kind = Literal["noise", "disturbance", "Delta"]

# Of the data, as the observers do: y = fl(C x + n) on a bound need not satisfy it. Theirs is a little wider.
ROUNDING = 1e-9
_HIGH_PRICE = 1e3
_LARGEST = 1e18  # relative to the noise: HiGHS takes 1e20 for infinity
_KINDS: dict[str, Kind] = {"noise": "noise", "disturbances": "disturbance", "deltas": "Delta"}


@dataclass(frozen=True)
class Bound:
    """A bound that may be widened, by ``scale`` times a relative widening at either end."""

    kind: Kind
    index: int
    name: str
    scale: float


@dataclass(frozen=True)
class Explained:
    """A solved piece: relative widenings (bounds,) beyond what was allowed, states (K, n), and the signs of each s."""

    widenings: Array
    x: Array
    signs: Array


class ElasticProgram:
    """The samples first, ..., first + count - 1 of a log, from a set of first states.

    Log, bounds and set are as they are given; the program is about the model's normal form.
    """

    def __init__(
        self, form: NormalForm, log: Log, chosen: Sequence[Bound], first: int, count: int, start: HPolytope
    ) -> None:
        self._form, self._model, self._log, self._first, self._count = form, form.model, log, first, count
        self._start = set_in(start, form.x)
        self._chosen = {(bound.kind, bound.index): i for i, bound in enumerate(chosen)}
        units = {"noise": form.y, "disturbance": form.w}
        self._scales = np.array([b.scale / units[b.kind][b.index] if b.kind in units else b.scale for b in chosen])
        self._evaluated = [evaluate(self._model, log.schedule_at(first + k)) for k in range(count)]
        self.is_exact = all(_is_known(self._model, c) for _, channels in self._evaluated for c in channels)

    def solve(
        self, allowed: Array, samples: int | None = None, only: int | None = None, signs: Array | None = None
    ) -> Explained | None:
        """The least sum of relative widenings beyond ``allowed`` (bounds,), or None if nothing helps.

        ``samples`` cuts the piece short and ``only`` lets a single bound give way. The signs (samples, channels) of
        the factors s that are not known are looked for if they are not given.
        """
        count = self._count if samples is None else samples
        if signs is None and not self.is_exact:
            centred = self._solve(allowed, count, only, None)
            if centred is None:
                return None
            signs = centred.signs
        return self._solve(allowed, count, only, signs)

    def _solve(self, allowed: Array, count: int, only: int | None, signs: Array | None) -> Explained | None:
        program = SparseProgram()
        free = np.isin(np.arange(len(allowed)), np.arange(len(allowed)) if only is None else only)
        widening = program.columns(np.zeros(len(allowed)), np.where(free, np.inf, 0.0))
        one = program.columns(1.0, 1.0)
        # With every Delta at its centre the chosen bounds may not suffice: then all noise gives way, at a high price.
        common = program.columns(0.0, np.inf if signs is None and not self.is_exact else 0.0)
        elastic = _Elastic(program, widening, allowed, common, self._chosen, self._scales)
        lifted: list[LiftedSample] = []
        x = self._states(program)
        set_rows(program, x, self._start)
        for k in range(count):
            lifted.append(self._sample(elastic, k, x, one, None if signs is None else signs[k]))
            if k + 1 < count:
                x = self._states(program)
                n = len(x)
                program.rows([*lifted[-1].terms(slice(0, n)), (x, -np.eye(n))], 0.0, 0.0)
        cost = np.zeros(program.column_count)
        cost[widening], cost[common] = 1.0, _HIGH_PRICE
        solution = program.minimise(cost, solver="ipm")
        if solution is None:
            return None
        point = solution.point
        found = np.array([[1.0 if c.functional @ point[s.known] >= 0 else -1.0 for c in s.channels] for s in lifted])
        return Explained(point[widening], np.array([point[s.x] for s in lifted]) * self._form.x, found)

    def _states(self, program: SparseProgram) -> Columns:
        size = self._model.n_states
        return program.columns(np.full(size, -np.inf), np.full(size, np.inf))

    def _sample(self, elastic: _Elastic, k: int, x: Columns, one: Columns, signs: Array | None) -> LiftedSample:
        model, program, u_now = self._model, elastic.program, self._form.inputs(self._log.u[self._first + k])
        stack, channels = self._evaluated[k]  # what they leave out is far below the solver's tolerance
        lower, upper, noise = model.bounds(self._log.schedule_at(self._first + k))
        u = program.columns(u_now, u_now)
        w = self._disturbances(elastic, lower, upper)
        known = np.concatenate([x, u, one, w])
        p = program.columns(np.full(len(channels), -np.inf), np.full(len(channels), np.inf))
        n = model.n_states
        for q, channel in enumerate(channels):
            column, f = p[q : q + 1], channel.functional
            if _is_known(model, channel):
                s = float(f[n:] @ np.concatenate([u_now, [1.0], np.zeros(len(w))]))
                low, high = sorted((channel.lo * s, channel.hi * s))
                elastic.within(("Delta", channel.owner), column, low, high, abs(s))
            elif signs is None:
                centre = (channel.lo + channel.hi) / 2
                program.rows([(column, np.ones((1, 1))), (known, -centre * f[None, :])], 0.0, 0.0)
            else:
                program.rows([(known, signs[q] * f[None, :])], 0.0, np.inf)
                line_rows(program, channel, known, column, *((0.0, np.inf) if signs[q] > 0 else (-np.inf, 0.0)))
        nothing = np.zeros(0, dtype=np.int64), np.zeros((len(stack), 0))
        lifted = LiftedSample(x, w, known, stack, channels, p, noise, *nothing)
        read = self._log.y[self._first + k]
        y = self._form.outputs(read)
        for i in np.flatnonzero(~np.isnan(y)):
            if abs(float(y[i])) / (float(noise[i]) or 1.0) > _LARGEST:
                raise ValueError(
                    f"y of the log has the value {read[i]:g} of sensor {i}, over {_LARGEST:g} times its "
                    "noise; no program can hold that, so where it stands for a missing measurement, leave the cell "
                    "empty (NaN)"
                )
            elastic.measure(int(i), lifted.terms(slice(n + i, n + i + 1)), float(y[i]), float(noise[i]))
        return lifted

    def _disturbances(self, elastic: _Elastic, lower: Array, upper: Array) -> Columns:
        w = elastic.program.columns(np.full_like(lower, -np.inf), np.full_like(upper, np.inf))
        for j in range(len(w)):
            elastic.within(("disturbance", j), w[j : j + 1], lower[j], upper[j], 1.0)
        if self._model.disturbance_polytope is not None:
            set_rows(elastic.program, w, self._model.disturbance_polytope)
        return w


@dataclass(frozen=True)
class _Elastic:
    """Rows of a program whose bounds give way: ``widening`` and ``allowed`` have one entry a chosen bound."""

    program: SparseProgram
    widening: Columns
    allowed: Array
    common: Columns
    chosen: dict[tuple[Kind, int], int]
    scales: Array

    def within(self, key: tuple[Kind, int], column: Columns, lower: float, upper: float, factor: float) -> None:
        """A variable between two bounds, each of which moves by ``factor`` times the widening."""
        variable = (column, np.ones((1, 1)))
        if key not in self.chosen:
            self.program.rows([variable], lower, upper)
            return
        i = self.chosen[key]
        step = factor * self.scales[i]
        more, less = self._widening(i, step)
        self.program.rows([variable, more], lower - step * self.allowed[i], np.inf)
        self.program.rows([variable, less], -np.inf, upper + step * self.allowed[i])

    def measure(self, sensor: int, terms: Terms, y: float, noise: float) -> None:
        """A noise-free output (terms) within the sensor's noise of what was read."""
        width = noise + ROUNDING * (abs(y) + noise)
        i = self.chosen.get(("noise", sensor))
        if i is not None:
            width += self.scales[i] * self.allowed[i]
        unit = noise or 1.0  # rows of about size one, for the solver's absolute tolerance
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


def bounds_of(model: UncertainModel, wanted: Sequence[str]) -> tuple[Bound, ...]:
    """The bounds that are meant by kinds ("noise", "disturbances", "deltas") and names ("noise alpha").

    Raises
    ------
    ValueError
        For an unknown name, a disturbance polytope, and a Delta that multiplies states or disturbances.
    """
    every = _every_bound(model)
    for name in wanted:
        if name not in _KINDS and name not in {bound.name for bound in every}:
            known = ", ".join([*_KINDS, *(bound.name for bound in every)])
            raise ValueError(f"bounds contains {name!r}; expected any of {known}")
    chosen = tuple(b for b in every if b.name in wanted or any(_KINDS.get(name) == b.kind for name in wanted))
    if model.disturbance_polytope is not None and any(b.kind == "disturbance" for b in chosen):
        raise ValueError(
            "bounds contains disturbances, but w is a polytope; give it as a box, or leave the disturbances out"
        )
    _, channels = evaluate(model, model.schedule)
    for bound in chosen:
        if bound.kind == "Delta" and not all(_is_known(model, c) for c in channels if c.owner == bound.index):
            raise ValueError(
                f"bounds contains {bound.name}, which multiplies states or disturbances: its widening is not a linear "
                "program; leave it out"
            )
    return chosen


def widened(model: UncertainModel, chosen: Sequence[Bound], amounts: Array) -> UncertainModel:
    """The model with bounds widened by relative amounts (bounds,)."""
    extra = {(b.kind, b.index): float(b.scale * a) for b, a in zip(chosen, amounts, strict=True) if a > 0.0}
    changes: dict[str, Any] = {}
    noise = np.array([extra.get(("noise", i), 0.0) for i in range(model.n_outputs)])
    if noise.any():
        changes["n"] = _shifted(model, 2, noise)
    w = np.array([extra.get(("disturbance", j), 0.0) for j in range(model.n_disturbances)])
    if w.any():
        changes["w"] = (_shifted(model, 0, -w), _shifted(model, 1, w))
    if any(kind == "Delta" for kind, _ in extra):
        more = [extra.get(("Delta", i), 0.0) for i in range(len(model.uncertainties))]
        changes["uncertainties"] = [
            replace(q, bounds=(q.bounds[0] - m, q.bounds[1] + m))
            for q, m in zip(model.uncertainties, more, strict=True)
        ]
    return model.replace(**changes)


def _shifted(model: UncertainModel, which: int, shift: Array) -> Array | Callable[[Any], Array]:
    """One of `UncertainModel.bounds`, moved; a function of the schedule if the model is scheduled."""
    if model.is_scheduled:
        return lambda schedule: model.bounds(schedule)[which] + shift
    return model.bounds()[which] + shift


def _every_bound(model: UncertainModel) -> list[Bound]:
    lower, upper, noise = model.bounds(model.schedule)
    deltas = [q.bounds for q in model.uncertainties]
    groups: list[tuple[Kind, Sequence[str], Sequence[float]]] = [
        ("noise", _names(model, "outputs", len(noise)), noise.tolist()),
        ("disturbance", _names(model, "disturbances", len(lower)), ((upper - lower) / 2).tolist()),
        ("Delta", [q.name or str(i) for i, q in enumerate(model.uncertainties)], [(hi - lo) / 2 for lo, hi in deltas]),
    ]
    return [
        Bound(kind, i, f"{kind} {name}", float(half) or 1.0)
        for kind, names, halves in groups
        for i, (name, half) in enumerate(zip(names, halves, strict=True))
    ]


def _names(model: UncertainModel, key: str, size: int) -> Sequence[str]:
    given = (model.names or {}).get(key)
    return given if given is not None else [str(i) for i in range(size)]


def _is_known(model: UncertainModel, channel: Channel) -> bool:
    """Whether s = f'(x, u, 1, w) has no x and w in it."""
    n, nu = model.n_states, model.n_inputs
    return not np.any(np.delete(channel.functional, np.s_[n : n + nu + 1]))
