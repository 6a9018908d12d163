"""The constrained-zonotope observer: sets that grow with the data and are reduced, for many states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from svo.checks import Array, is_count, is_finite_number
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.model import UncertainModel, expect_model
from svo.models.normal_form import NormalForm
from svo.observers.base import VerdictName
from svo.observers.data import check_may_start_by_step, inputs_of, outputs_of, stack_at
from svo.observers.free_start import Reading
from svo.observers.given_units import arrival_in
from svo.observers.readings import NO_SAMPLE, OUTGROWN, Readings
from svo.observers.saved_state import check_model, check_unchanged, last_schedule, sealed
from svo.observers.window.evidence import WindowSample
from svo.observers.window.setup import first_states, needs_next_input
from svo.observers.window_kernel import LARGEST
from svo.observers.zonotope.certificate import ZonotopeCertificate
from svo.observers.zonotope.program import ZonotopeProgram
from svo.observers.zonotope.reduction import reduced
from svo.observers.zonotope.sample import Stage, StageBuilder
from svo.observers.zonotope.step import ZonotopeRecord, ZonotopeStep
from svo.observers.zonotope.zonotope import ConstrainedZonotope

_SAMPLE = ("stack", "u", "y", "noise", "w_lower", "w_upper")


class ConstrainedZonotopeObserver:
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

    def __init__(
        self,
        model: UncertainModel,
        initial: HPolytope,
        max_generators: int | None = None,
        max_constraints: int | None = None,
        eps: float = 1e-9,
    ) -> None:
        expect_model("model", model)
        if not (is_finite_number(eps) and eps >= 0):
            raise ValueError(f"eps is {eps}; expected a relative slack >= 0, such as 1e-9")
        n = model.n_states
        generators = _limit("max_generators", max_generators, 8 * n, n)
        constraints = _limit("max_constraints", max_constraints, 3 * n, 0)
        first = first_states(initial, model)
        form = NormalForm.at(model, first.box_lower, first.box_upper)
        self._configure(form, generators, constraints, eps)
        self._forget(self._builder.first_set(arrival_in(first, form)))

    def _configure(self, form: NormalForm, max_generators: int, max_constraints: int, eps: float) -> None:
        self.model, self._form, self._normal = form.given, form, form.model
        self.eps = float(eps)
        self.max_generators, self.max_constraints = max_generators, max_constraints
        self._builder = StageBuilder(form, self.eps)
        self._wants_next_input = needs_next_input(self.model)

    # -- the protocol ----------------------------------------------------------------------------

    def reset(self, set: HPolytope) -> None:
        """Forget all data; the state at the next measurement lies in ``set``.

        Raises
        ------
        ValueError
            If the set is empty, unbounded or of the wrong dimension, or outside the model's physical range.
        """
        self._forget(self._builder.first_set(arrival_in(first_states(set, self.model), self._form)))

    def _forget(self, first: ConstrainedZonotope) -> None:
        self._first = first
        self._number = -1
        self._stages: tuple[Stage, ...] = ()  # the last one goes on to the next sample
        self._falsified: ZonotopeCertificate | None = None
        self._readings: Readings | None = None  # of an observer that has lost its set
        self.largest_at: int | None = None
        self._schedule: Any = None  # of the newest sample

    def lose_set(self) -> None:
        """Forget all data; nothing is known of the state at the next measurement.

        The observer starts from the model's largest set, or is undecided until the readings alone bound the state.
        """
        self._number, self._stages, self._falsified = -1, (), None
        self._readings, self.largest_at = None, None
        largest = self._normal.start_range
        if largest is None:
            self._readings = Readings(self._normal, self.eps)
        else:
            self._first, self.largest_at = ConstrainedZonotope.box(largest.lower, largest.upper), 0

    def update(self, y0: ArrayLike, u: ArrayLike | None = None, schedule: Any = None) -> ZonotopeStep:
        """The first measurement, without a transition.

        Parameters
        ----------
        y0 : (ny,) array
            NaN = that sensor is missing.
        u : (nu,) array, optional
            Needed where `step` needs ``u_next``.
        schedule : optional
            Scheduling value at this sample.
        """
        begun = perf_counter()
        if self._number >= 0:
            raise ValueError("update was called after the first sample; use step(u, y), or reset(set) to start again")
        inputs = inputs_of(self.model, "u", u, self._wants_next_input)
        data = self._data(inputs, outputs_of(self.model, y0), schedule)
        if self._readings is not None:
            return self._without_set(data.u, data, begun)
        return self._begin(data, begun)

    def step(
        self, u: ArrayLike | None, y: ArrayLike, u_next: ArrayLike | None = None, schedule: Any = None
    ) -> ZonotopeStep:
        """One transition x(k) -> x(k+1) driven by u, then the measurement y at k + 1.

        Parameters
        ----------
        u : (nu,) array
        y : (ny,) array
            NaN = that sensor is missing; all NaN = prediction only.
        u_next : (nu,) array, optional
            u(k+1); needed only if D or a D_i is not zero, or if an uncertainty of B reaches the output: B_i, and C_i,
            c_i or F_i, are not zero for one i.
        schedule : optional
            Scheduling value at the sample of y; it also gives the matrices of the next transition.

        Raises
        ------
        ValueError
            For a wrong shape, an infinite or missing value, a schedule that gives no finite matrices, or a scheduled
            model whose first call is not `update`. The observer is unchanged.
        """
        begun = perf_counter()
        inputs = inputs_of(self.model, "u", u, True)
        following = inputs_of(self.model, "u_next", u_next, self._wants_next_input)
        outputs = outputs_of(self.model, y)
        if self._falsified is not None:
            return self._answer("falsified", self._stages[-1], begun)
        data = self._data(following, outputs, schedule)
        if self._number < 0:
            check_may_start_by_step(self.model)
            self.update(np.full(self.model.n_outputs, np.nan), inputs, schedule)
        u = self._form.inputs(inputs)
        if self._readings is not None:
            return self._without_set(u, data, begun)
        return self._go_on(u, data, begun) or self._give_up(u, data, begun)

    def run(self, log: Log) -> ZonotopeRecord:
        """All samples of a log, with the box of the state at each."""
        steps = list(drive(self, log))
        boxes = np.array([step.box for step in steps])
        return ZonotopeRecord(
            verdicts=tuple(step.verdict for step in steps),
            lower=boxes[:, 0],
            upper=boxes[:, 1],
            seconds=np.array([step.seconds for step in steps]),
            certificate=self._falsified,
        )

    def warm_up(self) -> float:
        """Load and compile whatever a step needs, without touching this observer; returns the seconds it took."""
        begun = perf_counter()
        other = ConstrainedZonotopeObserver.__new__(ConstrainedZonotopeObserver)
        other.__dict__.update(self.__dict__)
        other._number, other._stages, other._falsified, other._readings = -1, (), None, None
        y, u = np.full(self.model.n_outputs, np.nan), np.zeros(self.model.n_inputs)
        other.update(y, u, self.model.schedule)
        other.step(u, y, u, self.model.schedule).box  # noqa: B018
        return perf_counter() - begun

    @property
    def options(self) -> dict[str, Any]:
        """What besides model and sets decides what the observer answers: it is part of what names a saved state."""
        limits = {"max_generators": self.max_generators, "max_constraints": self.max_constraints}
        return {"kind": "constrained zonotope", **limits, "eps": self.eps}

    def state_dict(self) -> dict[str, Array]:
        """Everything that the next steps depend on, as named arrays (for ``numpy.savez``)."""
        falsified = float(self._falsified is not None)
        settings = [self._number, falsified, self.max_generators, self.max_constraints, self.eps]
        largest = NO_SAMPLE if self.largest_at is None else self.largest_at
        state = {"settings": np.array(settings), "restart": np.array([largest, self._readings is not None])}
        state |= _named("first", self._first) | self._form.state_dict()
        if self._readings is not None:
            state |= {f"readings.{name}": value for name, value in self._readings.state().items()}
        for i, stage in enumerate(self._stages):
            state |= _named(f"{i}.arrival", stage.arrival)
            state |= {f"{i}.{name}": getattr(stage.data, name).copy() for name in _SAMPLE}
        return sealed(state, self.model, self.options, self._schedule)

    @classmethod
    def from_state_dict(cls, model: UncertainModel, state: Mapping[str, Array]) -> ConstrainedZonotopeObserver:
        """The observer that `state_dict` described, to continue bit for bit with the same model.

        Raises
        ------
        ValueError
            If the state is not that of a constrained-zonotope observer of this very model, or was changed since.
        """
        try:
            check_unchanged(state)
            number, falsified, generators, constraints, eps = (float(v) for v in state["settings"])
            observer = cls.__new__(cls)
            observer._configure(NormalForm.from_state_dict(model, state), int(generators), int(constraints), eps)
            check_model(state, model, observer.options)
            observer._forget(_read(state, "first"))
            observer._schedule = last_schedule(state)
            observer._restore(int(number), bool(falsified), state)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise ValueError(f"state does not belong to a zonotope observer of this model: {error}") from error
        return observer

    # -- a set that is lost ------------------------------------------------------------------------

    def _begin(self, data: WindowSample, begun: float) -> ZonotopeStep:
        """The first sample of a set."""
        with np.errstate(over="ignore", invalid="ignore"):
            now = self._builder.measured(self._first, data)
        return self._conclude((), now, None, begun) if now.joint.within(LARGEST) else self._lost(data.u, data, begun)

    def _go_on(self, u: Array, data: WindowSample, begun: float) -> ZonotopeStep | None:
        """The next sample, or None if the set has outgrown all bounds."""
        with np.errstate(over="ignore", invalid="ignore"):
            before, states = self._builder.predicted(self._stages[-1], u)
            if not states.within(LARGEST):
                return None
            now = self._builder.measured(states, data)
        return self._conclude((before,), now, states, begun) if now.joint.within(np.inf) else None

    def _give_up(self, u: Array, data: WindowSample, begun: float) -> ZonotopeStep:
        """The set has outgrown all bounds at this sample: it starts again from the largest set, if there is one."""
        largest = self._normal.start_range
        if largest is None:
            return self._lost(u, data, begun)
        self._first, self.largest_at = ConstrainedZonotope.box(largest.lower, largest.upper), self._number + 1
        return self._begin(data, begun)

    def _lost(self, u: Array, data: WindowSample, begun: float) -> ZonotopeStep:
        self._stages, self.largest_at, self._readings = (), None, Readings(self._normal, self.eps)
        return self._without_set(u, data, begun)

    def _without_set(self, u: Array, data: WindowSample, begun: float) -> ZonotopeStep:
        """A sample of an observer that has no set: it starts again once the readings alone bound the state."""
        assert self._readings is not None
        self._number += 1
        self._readings.add(u, Reading(data.stack, data.u, data.y, data.noise, data.slack, data.w_lower, data.w_upper))
        found = self._readings.start()
        return (found and self._start_again(*found, begun)) or self._answer("undecided", None, begun)

    def _start_again(self, samples: list[Reading], lower: Array, upper: Array, begun: float) -> ZonotopeStep | None:
        """From bounds of the state at the first of some samples; None if a set does not come out of it."""
        number, readings = self._number, self._readings
        physical = self._normal.physical_range
        if physical is not None:
            lower, upper, _ = physical.cut(lower, upper)
        self._number, self._readings = number - len(samples), None
        self._first = ConstrainedZonotope.box(lower, upper)
        step = None
        for j, s in enumerate(samples):
            data = self._builder.data(s.stack, (s.w_lower, s.w_upper, s.noise), s.u, s.y)
            step = self._begin(data, begun) if j == 0 else self._go_on(samples[j - 1].u, data, begun)
            if step is None or step.reason is not None or (step.verdict == "falsified" and j + 1 < len(samples)):
                # a proof before the last sample would rest on readings that come after it
                self._number, self._readings, self._stages, self._falsified = number, readings, (), None
                return None
        return step

    # -- inside ------------------------------------------------------------------------------------

    def _data(self, u: Array, y: Array, schedule: Any) -> WindowSample:
        """Model and data of a sample, in normal form."""
        form, model = self._form, self._normal
        stack, self._schedule = stack_at(model, schedule), schedule
        return self._builder.data(stack, model.bounds(schedule), form.inputs(u), form.outputs(y))

    def _conclude(
        self, before: tuple[Stage, ...], now: Stage, states: ConstrainedZonotope | None, begun: float
    ) -> ZonotopeStep:
        """Decide whether anything explains the measurement, and keep what goes on to the next sample."""
        self._number += 1
        verdict = self._decide(before, now)
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
        return self._answer(verdict, now, begun)

    def _decide(self, before: tuple[Stage, ...], now: Stage) -> VerdictName:
        free = (*(j for stage in before for j in stage.on_p), *now.on_p)
        answer = ZonotopeProgram(now.joint, free).feasibility()
        if answer.status == "nonempty":
            return "consistent"
        if answer.status == "empty":
            for multipliers in (answer.ray, -answer.ray):
                found = self._builder.certificate((*before, now), multipliers, self._number)
                if found is not None:
                    window = replace(found.window, largest_at=self.largest_at)
                    self._falsified = replace(found, window=window)
                    return "falsified"
        return "undecided"

    def _answer(self, verdict: VerdictName, now: Stage | None, begun: float) -> ZonotopeStep:
        joint, reason = (None, OUTGROWN) if now is None else (now.joint, None)
        seconds = perf_counter() - begun
        return ZonotopeStep(self._number, verdict, self._falsified, seconds, joint, self._form, reason)

    def _restore(self, number: int, falsified: bool, state: Mapping[str, Array]) -> None:
        """The stages, made again from their arrival sets and data as they were made first."""
        stages: list[Stage] = []
        while f"{len(stages)}.stack" in state:
            i = len(stages)
            values = {name: np.array(state[f"{i}.{name}"]) for name in _SAMPLE}
            bounds = values["w_lower"], values["w_upper"], values["noise"]
            data = self._builder.data(values["stack"], bounds, values["u"], values["y"])
            arrival = _read(state, f"{i}.arrival")
            if i:
                before, arrival = self._builder.predicted(stages[-1], stages[-1].data.u)
                stages[-1] = before
            stages.append(self._builder.measured(arrival, data))
        largest, lost = (int(v) for v in state["restart"])
        self._stages, self._number, self._falsified = tuple(stages), number, None
        self.largest_at, self._readings = None if largest == NO_SAMPLE else largest, None
        if lost:
            self._readings = Readings(self._normal, self.eps)
            prefix = "readings."
            self._readings.restore({k.removeprefix(prefix): state[k] for k in state if k.startswith(prefix)})
        if falsified and self._decide(self._stages[:-1], self._stages[-1]) != "falsified":
            raise ValueError("its falsification cannot be proven again")


def _limit(name: str, value: int | None, default: int, least: int) -> int:
    if value is None:
        return default
    if not is_count(value, least):
        raise ValueError(f"{name} is {value!r}; expected an integer of at least {least}, or None for {default}")
    return int(value)


def _named(prefix: str, Z: ConstrainedZonotope) -> dict[str, Array]:
    return {f"{prefix}.{f.name}": getattr(Z, f.name).copy() for f in fields(Z)}


def _read(state: Mapping[str, Array], prefix: str) -> ConstrainedZonotope:
    return ConstrainedZonotope(**{f.name: np.array(state[f"{prefix}.{f.name}"]) for f in fields(ConstrainedZonotope)})
