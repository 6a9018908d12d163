"""The constrained-zonotope observer: sets that grow with the data and are reduced, for many states."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from polytopes.signatures import options_by_name
from svo.checks import Array, expect, is_count
from svo.models import NormalForm, UncertainModel
from svo.models.intervals import check_splits
from svo.observers.answers import NO_PROOF, VerdictName
from svo.observers.data import relative_slack
from svo.observers.first_states import first_box
from svo.observers.free_start import Reading
from svo.observers.given_units import arrival_in
from svo.observers.readings import NO_SAMPLE, OUTGROWN
from svo.observers.recursion import RecursiveObserver
from svo.observers.saved_state import arrays_of, numbers, sample_shapes
from svo.observers.window.evidence import WindowSample
from svo.observers.window.setup import arrival_of, needs_next_input
from svo.observers.window_kernel import LARGEST
from svo.observers.zonotope.certificate import ZonotopeCertificate
from svo.observers.zonotope.program import ZonotopeProgram
from svo.observers.zonotope.reduction import reduced
from svo.observers.zonotope.sample import Stage, StageBuilder
from svo.observers.zonotope.step import ZonotopeStep
from svo.observers.zonotope.zonotope import ConstrainedZonotope

_SAMPLE = ("stack", "u", "y", "noise", "w_lower", "w_upper")


class ConstrainedZonotopeObserver(RecursiveObserver[WindowSample]):
    """Set-valued observer on constrained zonotopes (Scott et al., Automatica 69, 2016), in a form that is sound.

    {c + G xi : |xi| <= 1, A xi = b} is closed under affine maps, sums and measurements; each sample adds generators and
    constraints. What exceeds the limits is reduced to a superset, with the rounding of every operation added.

    Parameters
    ----------
    model : UncertainModel
    initial : HPolytope
        Bounded set that contains the state at the first sample.
    max_generators, max_constraints : int or None
        Of the set of the state that goes on to the next sample; by default 8 n and 3 n. Larger is tighter and slower.
    eps : float
        Every measurement row is widened by eps (|y| + |C||x|max + |D u| + |c| + |F| wmax + n), for the rounding
        of the data.

    Raises
    ------
    TypeError, ValueError
        For arguments that do not fit, and for an initial set that is empty or unbounded.

    Notes
    -----
    "falsified" comes with a `ZonotopeCertificate` that was checked in exact arithmetic; it is conditional on the set of
    the sample before and on the bounds of s of each channel. After it the observer stays falsified until `reset`.
    Uncertainties enter as the channels of `WindowObserver`: exact where s keeps one sign, the convex hull otherwise.
    """

    kind = "constrained zonotope"
    saves_state = True

    @options_by_name
    def __init__(
        self,
        model: UncertainModel,
        initial: HPolytope,
        *,
        max_generators: int | None = None,
        max_constraints: int | None = None,
        eps: float = 1e-9,
    ) -> None:
        super().__init__(model)
        slack, n = relative_slack(eps), model.n_states
        generators = _limit("max_generators", max_generators, 8 * n, n)
        constraints = _limit("max_constraints", max_constraints, 3 * n, 0)
        lower, upper = first_box(initial, model)
        self._configure(NormalForm.at(model, lower, upper), generators, constraints, slack)
        self._reset(initial, lower, upper)

    def _configure(self, form: NormalForm, max_generators: int, max_constraints: int, eps: float) -> None:
        self.model, self._form, self._normal = form.given, form, form.model
        self.max_generators, self.max_constraints, self.eps = max_generators, max_constraints, eps
        self._builder = StageBuilder(form, eps)
        self._wants_next_input = needs_next_input(self.model)
        self._plan_stamps()

    # -- the hooks -------------------------------------------------------------------------------

    def _reset(self, set: HPolytope, lower: Array, upper: Array) -> None:
        self.first_set = arrival_of(set, lower, upper)
        self._begin_from(self._builder.first_set(arrival_in(self.first_set, self._form)))

    def _begin_from(self, first: ConstrainedZonotope) -> None:
        """Nothing is known but a set of first states."""
        self._first, self._readings = first, None
        self._drop()

    def _start_from(self, lower: Array, upper: Array) -> None:
        self._first = ConstrainedZonotope.box(lower, upper)

    def _drop(self) -> None:
        self._stages: tuple[Stage, ...] = ()  # the last one goes on to the next sample

    def _warm_up(self) -> None:
        other = copy(self)
        other._forget()
        other._begin_from(self._first)
        y, u = np.full(self.model.n_outputs, np.nan), np.zeros(self.model.n_inputs)
        other.update(y, u, self.model.schedule)
        other.step(u, y, u, self.model.schedule).box  # noqa: B018

    def _options(self) -> dict[str, Any]:
        return {"max_generators": self.max_generators, "max_constraints": self.max_constraints, "eps": self.eps}

    def _state(self) -> dict[str, NDArray[Any]]:
        falsified = float(self._alarm is not None)
        settings = [self._number, falsified, self.max_generators, self.max_constraints, self.eps]
        largest = NO_SAMPLE if self.largest_at is None else self.largest_at
        state = {"settings": np.array(settings), "restart": np.array([largest, self._readings is not None])}
        state |= arrays_of("first", self._first) | self._form.state_dict()
        state |= self._saved_readings()
        for i, stage in enumerate(self._stages):
            state |= arrays_of(f"{i}.arrival", stage.arrival)
            state |= {f"{i}.{name}": getattr(stage.data, name).copy() for name in _SAMPLE}
        return state

    def _set_up(self, model: UncertainModel, state: Mapping[str, NDArray[Any]]) -> None:
        *_, generators, constraints, eps = (float(v) for v in state["settings"])
        self._configure(NormalForm.from_state_dict(model, state), int(generators), int(constraints), eps)

    def _resume(self, state: Mapping[str, NDArray[Any]]) -> ZonotopeStep | None:
        """The stages are made again from their arrival sets and data, as they were made first."""
        self._begin_from(self._read_set(state, "first"))
        number, falsified, *_ = (float(v) for v in state["settings"])
        largest, lost = (int(v) for v in state["restart"])
        self._number, self.largest_at = int(number), None if largest == NO_SAMPLE else largest
        stages, shapes = list[Stage](), sample_shapes(self.model)
        while f"{len(stages)}.stack" in state:
            i = len(stages)
            values = {part: numbers(state, f"{i}.{part}", *shapes[part], missing=part == "y") for part in _SAMPLE}
            bounds = values["w_lower"], values["w_upper"], values["noise"]
            data = self._builder.data(values["stack"], bounds, values["u"], values["y"])
            arrival = self._read_set(state, f"{i}.arrival")
            if i:
                before, arrival = self._builder.predicted(stages[-1], stages[-1].data.u)
                stages[-1] = before
            stages.append(self._builder.measured(arrival, data))
        self._stages = tuple(stages)
        self._restore_readings(lost, state)
        self._check_started(bool(stages))
        if not falsified:
            return None
        verdict, certificate = self._decide(self._stages[:-1], self._stages[-1])
        if verdict != "falsified":
            raise ValueError("its falsification cannot be proven again")
        return self._answer(verdict, self._stages[-1], certificate)

    def _read_set(self, state: Mapping[str, NDArray[Any]], name: str) -> ConstrainedZonotope:
        """One of the state, from its arrays; ValueError unless they fit together."""
        n, generators = self.model.n_states, np.shape(state[f"{name}.generators"])[-1]
        rows = len(state[f"{name}.offset"])
        shapes = {"center": (n,), "generators": (n, generators), "room": (n,)}
        shapes |= {"constraints": (rows, generators), "offset": (rows,), "slack": (rows,)}
        P = ConstrainedZonotope(**{part: numbers(state, f"{name}.{part}", *shape) for part, shape in shapes.items()})
        if (P.room < 0.0).any() or (P.slack < 0.0).any():
            raise ValueError(f"{name} has room or slack below zero")
        return P

    # -- the recursion -----------------------------------------------------------------------------

    def _data(self, stack: Array, bounds: tuple[Array, Array, Array], u: Array, y: Array) -> WindowSample:
        return self._builder.data(stack, bounds, u, y)

    def _again(self, reading: Reading, number: int) -> WindowSample:
        bounds = reading.w_lower, reading.w_upper, reading.noise
        return self._builder.data(reading.stack, bounds, reading.u, reading.y)

    def _reading(self, data: WindowSample) -> Reading:
        return Reading(data.stack, data.u, data.y, data.noise, data.slack, data.w_lower, data.w_upper)

    def _begin(self, data: WindowSample) -> ZonotopeStep | None:
        with np.errstate(over="ignore", invalid="ignore"):
            now = self._builder.measured(self._first, data)
        return self._conclude((), now, None) if now.joint.within(LARGEST) else None

    def _go_on(self, u: Array, data: WindowSample) -> ZonotopeStep | None:
        with np.errstate(over="ignore", invalid="ignore"):
            before, states = self._builder.predicted(self._stages[-1], u)
            if not states.within(LARGEST):
                return None
            now = self._builder.measured(states, data)
        return self._conclude((before,), now, states) if now.joint.within(np.inf) else None

    def _check_interval(self, dt: float) -> None:
        check_splits(self.model)
        super()._check_interval(dt)

    def _move_by(self, rows: Array) -> None:
        self._stages = (*self._stages[:-1], self._builder.moved(self._stages[-1], rows))

    def _unknown(self) -> ZonotopeStep:
        return self._answer("undecided", None, None)

    def _known(self) -> tuple[Array, Array]:
        joint = self._stages[-1].joint if self._stages else self._first
        return ZonotopeStep(joint, self._form, verdict="consistent").box

    def _conclude(self, before: tuple[Stage, ...], now: Stage, states: ConstrainedZonotope | None) -> ZonotopeStep:
        """Decide whether anything explains the measurement, and keep what goes on to the next sample."""
        verdict, certificate = self._decide(before, now)
        if verdict == "falsified":
            self._stages = (*before, now)
        elif states is None:
            self._stages = (now,)
        else:
            arrival = reduced(states, self.max_generators, self.max_constraints)
            physical = self._normal.physical_range
            if physical is not None:
                arrival = arrival.cut_to(physical.lower, physical.upper)
            self._stages = (self._builder.measured(arrival, now.data),)
        return self._answer(verdict, now, certificate)

    def _decide(self, before: tuple[Stage, ...], now: Stage) -> tuple[VerdictName, ZonotopeCertificate | None]:
        free = (*(j for stage in before for j in stage.on_p), *now.on_p)
        answer = ZonotopeProgram(now.joint, free).feasibility()
        if answer.status == "nonempty":
            return "consistent", None
        for multipliers in (answer.ray, -answer.ray) if answer.status == "empty" else ():
            found = self._builder.certificate((*before, now), multipliers, self._number)
            if found is not None:
                return "falsified", replace(found, window=replace(found.window, largest_at=self.largest_at))
        return "undecided", None

    def _answer(self, verdict: VerdictName, now: Stage | None, certificate: ZonotopeCertificate | None) -> ZonotopeStep:
        joint, reason = (None, OUTGROWN) if now is None else (now.joint, NO_PROOF if verdict == "undecided" else None)
        return ZonotopeStep(joint, self._form, verdict=verdict, certificate=certificate, reason=reason)


def _limit(name: str, value: int | None, default: int, least: int) -> int:
    if value is None:
        return default
    expect(is_count(value, least), name, value, f"an integer of at least {least}, or None for {default}")
    return int(value)
