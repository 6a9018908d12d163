"""What an observer is.

Its answers are in `svo.observers.answers`, its proofs in `svo.observers.certificate`, what it may do besides in
`svo.observers.capabilities`.

Public methods are checked and described here, once; an observer fills in the hooks behind them, which begin with an
underscore and are given what has been checked.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from time import perf_counter
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from polytopes.rounding import check_rounding
from polytopes.shown import Picture, Shown, brief, in_a_line
from polytopes.signatures import options_by_name
from svo.checks import Array, is_count
from svo.logs.drive import drive
from svo.logs.log import Log, expect_log
from svo.models import Labels, UncertainModel, expect_model
from svo.models.intervals import interval_of
from svo.models.nonlinear import NonlinearModel
from svo.observers.answers import Seen, Step, VerdictName
from svo.observers.capabilities import Capabilities
from svo.observers.certificate import Certificate
from svo.observers.data import (
    check_may_start_by_step,
    check_schedule,
    inputs_ahead,
    inputs_of,
    outputs_of,
    seconds_allowed,
)
from svo.observers.first_states import first_box
from svo.observers.record import Record
from svo.observers.saved_state import State, check_model, check_unchanged, last_schedule, sealed
from svo.observers.window.evidence import ArrivalSet

__all__ = ["Certificate", "Observer", "Record", "Seen", "Step", "VerdictName"]

_UNREADABLE = (LookupError, TypeError, ValueError, ArithmeticError, RecursionError)  # by arrays that fit no observer


class Observer(Shown, Capabilities, ABC):
    """The set of states that a model and the data so far allow, sample by sample.

    A kind of its own defines `_reset`, `_update` and `_step`, and what it declares of `Capabilities`.
    Hooks answer with a new step each time. They get arrays of the right shapes: finite numbers, NaN in a measurement
    where a sensor is missing, zeros for an input that is not needed. One that raises an error leaves the observer as it
    was. `_number` is the number of the sample that a hook is asked about, or of the newest one. After a falsification
    no hook is asked until `reset`.

    Parameters
    ----------
    model : UncertainModel

    Attributes
    ----------
    largest_at : int or None
        Sample at which the set last started from the model's largest set, if what is known now rests on it.
    first_set : ArrivalSet or None
        Of the state at its first sample, as it was given; a proof of its whole chain needs it. None where none was.
    """

    model: UncertainModel
    largest_at: int | None = None
    first_set: ArrivalSet | None = None
    _number: int = -1
    _schedule: Any = None  # of the newest sample
    _ahead: tuple[Array, Array] | None = None  # bounds of the inputs that follow the sample of a hook soon
    _alarm: Step | None = None
    _newest: Step | None = None

    def __init__(self, model: UncertainModel) -> None:
        self._expect_model(model)
        self.model = model

    @classmethod
    def _expect_model(cls, model: Any) -> None:
        if not (cls.takes_nonlinear and isinstance(model, NonlinearModel)):
            expect_model("model", model, jitter=cls.takes_jitter)

    def __repr__(self) -> str:
        options = ", ".join(f"{name} {brief(value)}" for name, value in self._options().items())
        where = f"at sample {self._number}" if self._number >= 0 else "before its first sample"
        fallen = ", falsified" if self._alarm is not None else ""
        return in_a_line(f"<{type(self).__name__} {where}{fallen}: {options}; {self.model!r}>")

    def _picture(self) -> Picture | None:
        newest = self._alarm or self._newest
        return newest._picture() if newest is not None and newest.sample == self._number else None

    # -- samples -----------------------------------------------------------------------------------

    @property
    def Ts(self) -> float:
        """Sampling time of the model [s]."""
        return self.model.Ts

    @property
    def jitter(self) -> Array | None:
        """Bounds (ny,) of the errors of the sensors' time stamps [s]; None if they are exact."""
        return self.model.jitter

    @property
    def needs_next_input(self) -> bool:
        """Whether `step` needs ``u_next``, and `update` its ``u``."""
        return self.model.uses_input_in_output

    @property
    def stopped(self) -> int:
        """Programs since the start that ended at a limit: their bounds hold, yet could be narrower.

        The limits are a deadline, pivots by the ten thousand, and what the machine has of memory.
        """
        return 0

    def reset(self, set: HPolytope) -> None:
        """Forget all data; the state at the next measurement lies in ``set``.

        Raises
        ------
        TypeError, ValueError
            If the set is no polytope, empty, unbounded or of the wrong dimension, or outside the model's physical
            range, or if the equations of a nonlinear model do not hold or have no value there. The observer is
            unchanged.
        """
        self._reset(set, *first_box(set, self.model))
        self._forget()

    def restart(self, set: HPolytope) -> None:
        """As `reset`, from a set that was found while running: what a nonlinear model cannot do there is undecided."""
        self.reset(set)

    def lose_set(self) -> None:
        """Forget all data; nothing is known of the state at the next measurement.

        The observer starts from the model's largest set, or is undecided until the readings alone bound the state.

        Raises
        ------
        TypeError
            If it cannot start without a set (`starts_without_set`).
        """
        self._check_can(self.starts_without_set, "has no lose_set: it cannot start without a set")
        self._forget()
        self.first_set = None
        self._lose_set()

    def update(
        self, y0: ArrayLike, u: ArrayLike | None = None, schedule: Any = None, u_range: ArrayLike | None = None
    ) -> Step:
        """The first measurement, without a transition.

        Parameters
        ----------
        y0 : (ny,) array
            NaN = that sensor is missing.
        u : (nu,) array, optional
            Needed where `step` needs ``u_next``.
        schedule : optional
            Scheduling value at this sample.
        u_range : (2, nu) array, optional
            As in `step`.

        Raises
        ------
        TypeError, ValueError
            As `step`, and if there was a first sample already.
        """
        begun = perf_counter()
        if self._number >= 0:
            raise ValueError("update was called after the first sample; use step(u=..., y=...), or reset(set) first")
        outputs = outputs_of(self.model, y0)
        inputs = inputs_of(self.model, "u", u, self.needs_next_input)
        check_schedule(self.model, schedule)
        ahead = inputs_ahead(self.model, u_range, inputs)
        with self._taking(None, ahead):
            return self._ask(begun, schedule, lambda: self._update(outputs, inputs, schedule))

    def step(
        self,
        u: ArrayLike | None,
        y: ArrayLike,
        u_next: ArrayLike | None = None,
        schedule: Any = None,
        deadline: float | None = None,
        dt: float | None = None,
        u_range: ArrayLike | None = None,
    ) -> Step:
        """One transition x(k) -> x(k+1) driven by u, then the measurement y at k + 1.

        Parameters
        ----------
        u : (nu,) array
        y : (ny,) array
            NaN = that sensor is missing; all NaN = prediction only.
        u_next : (nu,) array, optional
            u(k+1); needed only if D or a D_i is not zero, or, for observers that keep one Delta in state and output, if
            an uncertainty of B reaches the output: B_i, and C_i, c_i or F_i, are not zero for one i.
        schedule : optional
            Scheduling value at the sample of y; it also gives the matrices of the next transition.
        deadline : float, optional
            Seconds >= 0 after which the programs stop where they are: the arrival set is then wider but still
            contains the state, and the verdict is "undecided" if emptiness could not be decided. What is left
            then takes a few microseconds a direction. The exact proof of an alarm, a few milliseconds once, is
            not cut short. Results depend on the machine's speed. Only where `takes_deadline`.
        dt : float, optional
            Seconds from k to k + 1; by default the model's ``Ts``. Of a model in continuous time (by
            `UncertainModel.from_continuous`, or a `NonlinearModel`) any number above zero, for which the transition is
            discretised; of one in discrete time ``Ts`` within 1 %. Only where `takes_intervals`.
        u_range : (2, nu) array, optional
            Lower and upper bounds of the input from k + 1 on, for as long as a reading may have been taken after its
            stamp; by default it stays u_next. Only of a model with ``jitter``.

        Raises
        ------
        TypeError, ValueError
            For a wrong shape, an infinite or missing value, a schedule that gives no finite matrices, a scheduled
            model whose first call is not `update`, or a deadline or dt that observer or model do not take. The observer
            is unchanged.
        """
        begun = perf_counter()
        if deadline is not None:
            self._check_can(self.takes_deadline, "has no deadline: leave it out")
            deadline = begun + seconds_allowed(deadline)
        inputs = inputs_of(self.model, "u", u, True)
        following = inputs_of(self.model, "u_next", u_next, self.needs_next_input)
        outputs = outputs_of(self.model, y)
        check_schedule(self.model, schedule)
        ahead = inputs_ahead(self.model, u_range, following)
        interval = interval_of(self.model, dt)
        if interval is not None:
            self._check_can(self.takes_intervals, "takes only transitions of the model's Ts: leave dt out")
            self._check_interval(interval)
        if self._alarm is not None:
            return replace(self._alarm, seconds=perf_counter() - begun)
        if self._number < 0:
            check_may_start_by_step(self.model)
            self.update(np.full(self.model.n_outputs, np.nan), inputs, schedule)
        with self._taking(interval, ahead):
            return self._ask(begun, schedule, lambda: self._step(inputs, outputs, following, schedule, deadline))

    def run(self, log: Log) -> Record:
        """All samples of a log, with the box of the state at each.

        A log that keeps its own times (`svo.Log.events`) has each transition discretised for its own interval.

        Raises
        ------
        TypeError, ValueError
            As `update` and `step`; if the log is no `svo.Log`, has no samples, or the observer has started already.
        """
        expect_log(log)
        boxes, before = np.empty((len(log), 2, self.model.n_states)), self.stopped
        verdicts: list[VerdictName] = []
        seconds: list[float] = []
        for samples, step in self.follow(log, boxes):
            verdicts += [step.verdict] * samples
            seconds += [step.seconds] * samples
        bounds, stopped = (boxes[:, 0], boxes[:, 1]), self.stopped - before
        labels = Labels.of(self.model)
        return Record(tuple(verdicts), *bounds, np.array(seconds), step.certificate, log, labels, stopped)

    @options_by_name
    def follow(self, log: Log, boxes: Array | None = None, *, start: int = 0) -> Iterator[Seen]:
        """The samples of a log as they are seen: one after the other, or many consistent ones at once.

        Who has seen enough stops asking. An observer that takes many samples at once has then seen more of the log.

        Parameters
        ----------
        log : Log
        boxes : (K, 2, n) array, optional
            Filled with lower and upper bounds of the state at each sample, which are computed only then.
        start : int
            First sample that it has not seen. A long log can be followed in portions, each with the last sample of the
            one before as its first.

        Raises
        ------
        TypeError, ValueError
            As `run`.
        """
        for k, step in enumerate(drive(self, log, start=start), start=start):
            if boxes is not None:
                boxes[k] = step.box  # it is that of the newest sample only
            yield Seen(1, step)

    def warm_up(self) -> float:
        """Load whatever a step can need, without touching this observer; returns the seconds it took."""
        begun = perf_counter()
        self._warm_up()
        return perf_counter() - begun

    # -- measurements that come late -----------------------------------------------------------------

    def late_update(self, y: ArrayLike, sample: int) -> Step:
        """A measurement that arrives after its sample, while that sample is still in the window.

        Its rows stand where they would have stood; the answer is about the newest sample, as that of the last
        `step`, which it replaces. Alarms and their certificates, saved states and sets then include it.

        Parameters
        ----------
        y : (ny,) array
            Measured at ``sample``; NaN for the sensors that did not arrive now.
        sample : int
            Number of that sample (`Step.sample` counts from 0), within `window`.

        Raises
        ------
        TypeError
            If the observer takes no measurements that come late (`takes_late`).
        ValueError
            For a sample outside the window, a sensor that has been read there already, or a bad ``y``. The
            observer is unchanged.
        """
        begun = perf_counter()
        outputs = self._late_outputs(y, sample)
        if self._alarm is not None:
            return replace(self._alarm, seconds=perf_counter() - begun)
        stopped = self.stopped
        return self._answered(self._late_update(outputs, int(sample)), begun, stopped)

    def check_late(self, y: ArrayLike, sample: int) -> None:
        """Raise what `late_update` of y (ny,), measured at ``sample``, would raise; nothing changes."""
        self._late_outputs(y, sample)

    @property
    def window(self) -> tuple[int, int]:
        """First and last sample that a late measurement may be of.

        Raises
        ------
        TypeError
            If the observer takes no measurements that come late (`takes_late`).
        ValueError
            Before the first sample.
        """
        self._check_can(self.takes_late, "takes no measurements that come late")
        if self._number < 0:
            raise ValueError("there is no sample yet; call update(y0=...), with NaN if there is no measurement")
        return self._oldest, self._number

    # -- saved states ------------------------------------------------------------------------------------

    @property
    def options(self) -> dict[str, Any]:
        """What besides model and sets decides what the observer answers: it is part of what names a saved state."""
        return {"kind": self.kind, **self._options()}

    def state_dict(self) -> dict[str, NDArray[Any]]:
        """Everything that the next steps depend on, as named arrays (for ``numpy.savez``).

        Raises
        ------
        TypeError
            If the observer cannot be saved (`saves_state`), or the schedule of the last sample is no number or array
            of numbers.
        """
        self._check_can(self.saves_state, "has no state_dict: it cannot be saved")
        return sealed(self._state(), self.model, self.options, self._schedule)

    @classmethod
    def from_state_dict(cls, model: UncertainModel, state: State) -> Self:
        """The observer that `state_dict` described, to continue bit for bit with the same model.

        Raises
        ------
        TypeError
            If observers of this kind cannot be saved (`saves_state`), or take no such model.
        ValueError
            If the state is not that of such an observer of this very model, or was changed since.
        """
        observer = cls.__new__(cls)
        observer._check_can(cls.saves_state, "has no state_dict: it cannot be saved")
        cls._expect_model(model)
        try:
            check_unchanged(state)
            observer._set_up(model, state)
            check_model(state, model, observer.options)
            alarm = observer._resume(state)
        except _UNREADABLE as error:
            raise ValueError(f"state does not belong to a {cls.kind} observer of this model: {error}") from error
        observer._schedule = last_schedule(state)
        observer._alarm = None if alarm is None else replace(alarm, sample=observer._number)
        return observer

    # -- hooks of every observer -------------------------------------------------------------------------

    @abstractmethod
    def _reset(self, set: HPolytope, lower: Array, upper: Array) -> None:
        """Start from a set; its box within the physical range is known by now."""

    @abstractmethod
    def _update(self, y: Array, u: Array, schedule: Any) -> Step:
        """The first measurement."""

    @abstractmethod
    def _step(self, u: Array, y: Array, u_next: Array, schedule: Any, end: float | None) -> Step:
        """A transition and a measurement, by the time ``end`` of `time.perf_counter` if there is one."""

    def _warm_up(self) -> None:
        """As `warm_up`; nothing, unless something is loaded late."""

    # -- inside ------------------------------------------------------------------------------------

    def _forget(self) -> None:
        self._number, self._alarm, self._newest, self._schedule, self.largest_at = -1, None, None, None, None

    def _ask(self, begun: float, schedule: Any, hook: Callable[[], Step]) -> Step:
        """The answer of a hook at the next sample."""
        check_rounding()
        stopped = self.stopped
        self._number += 1
        try:
            step = hook()
        except BaseException:
            self._number -= 1
            raise
        self._schedule = schedule
        return self._answered(step, begun, stopped)

    @contextmanager
    def _taking(self, interval: float | None, ahead: tuple[Array, Array] | None) -> Iterator[None]:
        """While a sample is taken: its transition is that of Ts again if it is refused."""
        if interval is not None:
            self._set_interval(interval)
        self._ahead = ahead
        try:
            yield
        except BaseException:
            if interval is not None:
                self._set_interval(None)
            raise
        finally:
            self._ahead = None

    def _answered(self, step: Step, begun: float, stopped: int) -> Step:
        # nobody has seen it yet, and a copy takes a twentieth of a fast observer's time
        object.__setattr__(step, "sample", self._number)
        object.__setattr__(step, "stopped", self.stopped - stopped)
        object.__setattr__(step, "seconds", perf_counter() - begun)
        self._newest = step
        if step.verdict == "falsified":
            self._alarm = step
        return step

    def _late_outputs(self, y: ArrayLike, sample: int) -> Array:
        """A late measurement that has been checked."""
        first, last = self.window
        outputs = outputs_of(self.model, y)
        if self._alarm is None:
            if not (is_count(sample, first) and sample <= last):
                raise ValueError(f"sample is {sample!r}; expected one in the window, which holds {first} to {last}")
            read = ~np.isnan(outputs) & ~np.isnan(self._read_at(sample))
            if read.any():
                raise ValueError(f"y has a value of sensor {int(np.argmax(read))}, which was already read at {sample}")
        return outputs
