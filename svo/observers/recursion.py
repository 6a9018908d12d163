"""An observer whose set goes from sample to sample, that loses it in a long gap and finds one again.

A set that outgrows all bounds says nothing any more. Where the model states the largest set it starts again there, a
premise of every later alarm; otherwise from the samples whose readings bound the state without anything before
(`svo.observers.readings`): nothing is promised then. All in normal form.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from svo.checks import Array
from svo.models import NormalForm, UncertainModel
from svo.models.intervals import transition_rows
from svo.models.nonlinear import Span
from svo.models.recent_inputs import RecentInputs
from svo.models.state_range import within
from svo.observers.answers import Step
from svo.observers.base import Observer
from svo.observers.data import stack_at
from svo.observers.free_start import Reading
from svo.observers.readings import Readings
from svo.observers.saved_state import State
from svo.observers.stamped import Stamped

Data = TypeVar("Data")


class _Taken(NamedTuple, Generic[Data]):
    """A sample that is read, and where stamps are off, the inputs of that time."""

    data: Data
    recent: RecentInputs | None
    around: tuple[Array, Array] | None
    y: Array


class RecursiveObserver(Observer, Generic[Data]):
    """Hooks of a set that is kept from sample to sample; ``Data`` are model and data of a sample."""

    starts_without_set = takes_intervals = takes_jitter = True

    _form: NormalForm
    _normal: UncertainModel
    eps: float
    _wants_next_input: bool
    _dt: float | None = None  # seconds of the transition that is being taken; None = the model's Ts
    _steps_kept: int = 0  # at least, of a set that is lost
    _readings: Readings | None = None  # of an observer that has lost its set
    _stamped: Stamped | None = None
    _recent: RecentInputs | None = None  # where stamps are off

    @abstractmethod
    def _data(self, stack: Array, bounds: tuple[Array, Array, Array], u: Array, y: Array) -> Data:
        """Model, bounds of w and of the noise, and data of a sample, u its own input."""

    @abstractmethod
    def _again(self, reading: Reading, number: int) -> Data:
        """The same of a sample that has been kept."""

    @abstractmethod
    def _reading(self, data: Data) -> Reading:
        """A sample as it is kept."""

    @abstractmethod
    def _start_from(self, lower: Array, upper: Array) -> None:
        """A box of first states."""

    @abstractmethod
    def _drop(self) -> None:
        """Forget the set, but for that of first states."""

    @abstractmethod
    def _begin(self, data: Data) -> Step | None:
        """The first sample of a set; None if the set has outgrown all bounds."""

    @abstractmethod
    def _go_on(self, u: Array, data: Data) -> Step | None:
        """The next sample; None if the set has outgrown all bounds."""

    @abstractmethod
    def _move_by(self, rows: Array) -> None:
        """Replace the transition from the newest sample of a set by that of state rows (items, n, columns)."""

    @abstractmethod
    def _unknown(self) -> Step:
        """The answer without a set."""

    @abstractmethod
    def _known(self) -> tuple[Array, Array]:
        """Bounds (n,) of the newest state of a set, or of the first one before it is read; in the user's units."""

    # -- samples -----------------------------------------------------------------------------------

    def _update(self, y: Array, u: Array, schedule: Any) -> Step:
        if self._stamped is not None:
            self._recent = RecentInputs.none(float(self._stamped.errors.jitter.max()), u.size)
            self._stamped.box = None if self._readings is not None else Span(*self._known())
        taken = self._taken(self._recent, y, u, schedule)
        data, known = taken.data, self._form.inputs(u)
        step = None if self._readings is not None else self._begin(data) or self._lost(known, data)
        return self._seen(taken, step or self._without_set(known, data))

    def _step(self, u: Array, y: Array, u_next: Array, schedule: Any, end: float | None) -> Step:
        dt, self._dt, recent = self._dt, None, self._recent
        if self._stamped is not None and recent is not None:
            recent = recent.moved(u, dt or self.Ts)
            everywhere = np.full(self.model.n_states, np.inf)
            known = (-everywhere, everywhere) if self._readings is not None else self._known()
            self._stamped.moved(Span(*known), u, dt)
        taken = self._taken(recent, y, u_next, schedule)
        data, driven = taken.data, self._form.inputs(u)
        step = None if self._readings is not None else self._go_on(driven, data) or self._give_up(driven, data)
        return self._seen(taken, step or self._without_set(driven, data))

    def _taken(self, recent: RecentInputs | None, y: Array, u: Array, schedule: Any) -> _Taken[Data]:
        """A sample that is read, ``recent`` being the inputs before it."""
        form, stack = self._form, stack_at(self._normal, schedule)
        lower, upper, noise = self._normal.bounds(schedule)
        around = None if recent is None else recent.around(u, self._ahead)
        if self._stamped is not None and around is not None:
            stack, noise, y = self._stamped.applied(form, stack, noise, y, around, u)
        data = self._data(stack, (lower, upper, noise), form.inputs(u), form.outputs(y))
        return _Taken(data, recent, around, y)

    def _seen(self, taken: _Taken[Data], step: Step) -> Step:
        """An answer, once its sample is taken: its readings may be of inputs to come."""
        if taken.recent is not None and taken.around is not None:
            assert self.model.jitter is not None
            jitter = float(self.model.jitter[~np.isnan(taken.y)].max(initial=0.0))
            self._recent = taken.recent.read(jitter, taken.around)
        return step

    def _check_interval(self, dt: float) -> None:
        transition_rows(self.model, dt)

    def _set_interval(self, dt: float | None) -> None:
        self._dt = dt
        rows = self._form.state_rows(transition_rows(self.model, dt))
        if self._readings is not None:
            self._readings.move_by(rows)
        else:
            self._move_by(rows)

    # -- a set that is lost ------------------------------------------------------------------------

    def _lose_set(self) -> None:
        largest = self._normal.start_range
        if largest is None:
            self._lose()
        else:
            self._drop()
            self._start_from(largest.lower, largest.upper)
            self._readings, self.largest_at = None, 0

    def _lose(self) -> None:
        """There is no set any more."""
        self._drop()
        self.largest_at, self._readings = None, Readings(self._normal, self.eps, self._steps_kept)

    def _give_up(self, u: Array, data: Data) -> Step:
        """The set has outgrown all bounds at this sample: it starts again from the largest set, if there is one."""
        largest = self._normal.start_range
        if largest is None:
            return self._lost(u, data)
        self._start_from(largest.lower, largest.upper)
        self.largest_at = self._number
        return self._begin(data) or self._lost(u, data)

    def _lost(self, u: Array, data: Data) -> Step:
        self._lose()
        return self._without_set(u, data)

    def _without_set(self, u: Array, data: Data) -> Step:
        """A sample of an observer that has no set: it starts again once the readings alone bound the state."""
        assert self._readings is not None
        before, readings = self._readings, self._readings.added(u, self._reading(data))
        step, self._readings = None, None
        try:
            found = readings.start()
            step = found and self._start_again(*found)
        except BaseException:
            readings = before  # the sample may be given again
            raise
        finally:
            if step is None:
                self._drop()
                self._readings = readings
        return step or self._unknown()

    def _start_again(self, samples: list[Reading], lower: Array, upper: Array) -> Step | None:
        """From bounds of the state at the first of some samples; None if a set does not come out of it."""
        self._start_from(*within(self._normal.physical_range, lower, upper))
        step = None
        for j, s in enumerate(samples):
            data = self._again(s, self._number - len(samples) + 1 + j)
            step = self._begin(data) if j == 0 else self._go_on(samples[j - 1].u, data)
            if step is None or (step.verdict == "falsified" and j + 1 < len(samples)):
                return None  # a proof before the last sample would rest on readings that come after it
        return step

    # -- stamps that are off -------------------------------------------------------------------------

    def _plan_stamps(self) -> None:
        """What the model's stamps ask for, once the model is known."""
        origin = self.model.origin
        stamps = None if origin is None else origin.stamps
        self._recent, self._stamped = None, None if stamps is None else Stamped(self.model, stamps)

    @property
    def needs_next_input(self) -> bool:
        return self._wants_next_input or self._stamped is not None

    # -- saved states ------------------------------------------------------------------------------------

    def _saved_readings(self) -> dict[str, Array]:
        recent = {} if self._recent is None else self._recent.state()
        return recent if self._readings is None else recent | self._readings.state()

    def _restore_readings(self, lost: int, state: State) -> None:
        if self._stamped is not None and self._number >= 0:
            reach = float(self._stamped.errors.jitter.max())
            self._recent = RecentInputs.of_state(reach, self.model.n_inputs, state)
        self._readings = None
        if lost:
            self._readings = Readings(self._normal, self.eps, self._steps_kept)
            self._readings.restore(state)

    def _check_started(self, has_set: bool) -> None:
        """Raise ValueError if a state that was taken back is past its first sample and holds nothing of it."""
        if self._number >= 0 and not has_set and self._readings is None:
            raise ValueError(f"it is that of sample {self._number}, without the set of that sample")
