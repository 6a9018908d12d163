"""What all isolation banks share: they step their observers, ask a logic and start observers again."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping
from copy import deepcopy
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from polytopes.shown import Picture, Shown, in_a_line
from polytopes.signatures import options_by_name
from svo.checks import Array, expect_kind
from svo.isolation.bank_checks import check_log, check_observers
from svo.isolation.bank_state import BankState, Sample, restored, saved
from svo.isolation.front import Front
from svo.isolation.logic import GLOBAL, NOMINAL, IsolationLogic, LogicState
from svo.isolation.record import BankRecord, Replay, Verdict
from svo.isolation.recorder import Recorder
from svo.isolation.running import Running
from svo.isolation.starts import nothing_of, predict_from, start_from
from svo.logs.drive import drive
from svo.logs.log import Log, expect_log
from svo.models import Labels
from svo.observers.base import Observer, Step
from svo.pictures.sets import picture_of_sets


class Bank(Shown, ABC):
    """A nominal observer and one observer a fault, driven together; `ArchitectureI` and `ArchitectureII` are banks.

    Attributes
    ----------
    names : tuple of str
        The models: "nominal", then the faults.
    observers : mapping of str to Observer
    """

    def __init__(self, logic: IsolationLogic, observers: Mapping[str, Observer], same_states: bool) -> None:
        self.names = logic.names
        self.observers: Mapping[str, Observer] = MappingProxyType(dict(observers))
        self._logic = logic
        check_observers(self.observers, same_states)
        self._forget()

    def __repr__(self) -> str:
        state = self._state.state
        where = "before its first sample" if self._sample is None else f"at sample {self._sample}: {state}"
        names = ", ".join(self.observers)
        return in_a_line(f"<{type(self).__name__} of {names:.200} {where}>")

    def _picture(self) -> Picture | None:
        running = self._running.observers
        newest = {name: o._newest for name, o in running.items() if o._newest is not None}
        sets = {name: step.set for name, step in newest.items() if step.sample == running[name]._number}
        labels = Labels.of(self.observers[NOMINAL].model)
        return picture_of_sets(sets, self.names, labels.state_titles[:2])

    @property
    def Ts(self) -> float:
        """Sampling time of the models [s]."""
        return self.observers[NOMINAL].Ts

    @property
    def jitter(self) -> Array | None:
        """Bounds (ny,) of the errors of the sensors' time stamps [s], the largest of all models; None if exact."""
        every = [observer.jitter for observer in self.observers.values() if observer.jitter is not None]
        return np.max(every, axis=0) if every else None

    # -- samples -----------------------------------------------------------------------------------

    def update(
        self, y0: ArrayLike, u: ArrayLike | None = None, schedule: Any = None, u_range: ArrayLike | None = None
    ) -> Verdict:
        """The first measurement, without a transition.

        Parameters
        ----------
        y0 : (ny,) array
            NaN for a missing sensor.
        u : (nu,) array, optional
            The input from this sample on, where an observer needs it (as `step` needs ``u_next``).
        schedule : optional
            Scheduling value of this sample; needed if an observer's model has a schedule.
        u_range : (2, nu) array, optional
            As in `step`.

        Raises
        ------
        ValueError
            If the bank has already started.
        """
        if self._sample is not None:
            raise ValueError("update was called after the first sample; use step(u=..., y=...), or reset(set) first")
        now = Sample.given(None, y0, u, schedule, u_range=u_range)
        steps = self._running.ask(lambda name: now.first(self.observers[name], now.y))
        return self._conclude(0, steps, now)

    def step(
        self,
        u: ArrayLike | None,
        y: ArrayLike,
        u_next: ArrayLike | None = None,
        schedule: Any = None,
        deadline: float | None = None,
        dt: float | None = None,
        u_range: ArrayLike | None = None,
    ) -> Verdict:
        """One transition driven by u, then the measurement y; arguments as for the observers.

        Parameters
        ----------
        u : (nu,) array
            Drove the plant from the sample before to this one.
        y : (ny,) array
            NaN for a missing sensor.
        u_next : (nu,) array, optional
            The input from this sample on; needed if the output of an observer's model depends on it.
        schedule : optional
            Scheduling value of this sample; needed if an observer's model has a schedule.
        deadline : float, optional
            Seconds for all observers together. They are stepped in the order of the bank, and each may take an equal
            share of what is left; one that is done early leaves its time to those behind it. Sets may be wider and
            verdicts "undecided" then, never wrong, and results depend on the machine's speed. Not cut short are the
            exact proof of an alarm and, at the samples at which observers start again, their first programs.
        dt : float, optional
            Seconds from the sample before to this one; by default the models' ``Ts``.
        u_range : (2, nu) array, optional
            Lower and upper bounds of the input from this sample on, for as long as a reading may have been taken after
            its stamp; by default it stays u_next. For the observers whose models have ``jitter``.

        Raises
        ------
        ValueError
            If there was no first measurement, an observer refuses the arguments (its name leads the message), or a
            deadline is given to a bank with an observer whose step has none. After a refusal by another than the
            first observer, the ones before it have seen the sample: the bank then refuses further samples until
            `reset` or `load_state_dict`.
        """
        if self._sample is None:
            raise ValueError("step was called before the first measurement; call update(y0=...), NaN if there is none")
        now = Sample.given(u, y, u_next, schedule, dt, u_range)
        if deadline is None:
            steps = self._running.ask(lambda name: now.to(self.observers[name], now.y))
        else:
            steps = self._running.ask_within(now, deadline)
        return self._conclude(self._sample + 1, steps, now)

    def late_update(self, y: ArrayLike, sample: int) -> Verdict:
        """A measurement that arrives after its sample; the verdict is about the newest one, and replaces the last.

        Every running observer whose window holds the sample takes it. One that started after it, or whose window has
        left it behind, goes on without: its set is still sound. What is falsified is falsified at the newest sample.

        Parameters
        ----------
        y : (ny,) array
            Measured at ``sample``; NaN for the sensors that did not arrive now.
        sample : int
            As `Verdict.sample` counts.

        Raises
        ------
        TypeError
            If a running observer has no ``late_update``.
        ValueError
            Before the first measurement, for a sample in the window of no running observer, or what an observer
            refuses, as in `step`.
        """
        if self._sample is None:
            raise ValueError("late_update was called before the first measurement; call update(y0=...) first")
        steps = self._running.ask_late(y, sample, self._sample, self._nothing())
        falsified, _ = falsified_and_undecided(steps)
        state = replace(self._state, restart=())
        if falsified:  # only those count: the others had their answer at this sample
            state = self._logic.advance(state, self._sample, falsified, undecided=(*self.names, GLOBAL))
        return self._apply(self._sample, state, steps, falsified, self._latest)

    def state_dict(self) -> dict[str, NDArray[Any]]:
        """Everything that the next samples depend on, as named arrays without objects (for ``numpy.savez``).

        Raises
        ------
        TypeError
            If an observer has no ``state_dict``, or the schedule is no number or array of numbers.
        """
        observers = {name: saved(name, observer) for name, observer in self.observers.items()}
        memory = self._memory()
        if self._largest_at is not None:
            memory["largest_at"] = np.array(float(self._largest_at))
        return BankState(self._kind, self._sample, self._state, self._latest, memory, observers).arrays()

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on bit for bit from what `state_dict` gave; this bank must be built as that one was.

        `observers` then holds new objects, made by the classes of the present ones for the same models.

        Raises
        ------
        ValueError
            If the state is that of a bank with other models or options, or is incomplete. The bank is unchanged.
        """
        expect_kind("state", state, Mapping, "the named arrays that state_dict() gave")
        try:
            self._resume(BankState.of_arrays(state))
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise ValueError(f"state does not belong to this bank: {error}") from error

    def reset(self, set: HPolytope) -> None:
        """Forget everything; all models are alive and the state at the next measurement lies in ``set``."""
        for observer in self.observers.values():
            observer.reset(set)
        self._forget()

    def warm_up(self) -> float:
        """Load whatever the observers' steps can need; returns the seconds that it took."""
        return sum(observer.warm_up() for observer in self.observers.values())

    @options_by_name
    def run(self, log: Log, *, progress: Callable[[int, int], None] | None = None) -> BankRecord:
        """All samples of a log, with its own schedule.

        Parameters
        ----------
        log : Log
        progress : callable, optional
            Called with (samples done, samples in all) as they are done.

        Raises
        ------
        ValueError
            If the bank has already started, or the log is empty or has other channels than the models.
        """
        expect_log(log)
        self._check_log(log, 0)
        recorder = Recorder(self.names, log, Labels.of(self.observers[NOMINAL].model), Replay(self._boxes_of(log)))
        for verdict, samples in self.follow(log):
            recorder.add(verdict, samples)
            if progress is not None:
                progress(verdict.sample + 1, len(log))
        return recorder.record()

    @options_by_name
    def follow(
        self, log: Log, boxes: Mapping[str, Array] | None = None, *, start: int = 0
    ) -> Iterator[tuple[Verdict, int]]:
        """The verdicts over a log, each with the samples that it is of: many where nothing changes.

        A long log can be followed in portions, each with the last sample of the one before as its first. When all
        verdicts of a portion are read, the bank is where `step` would have brought it.

        Parameters
        ----------
        log : Log
        boxes : mapping of str to (K, 2, n) array, optional
            For every observer: filled with lower and upper bounds of the state at each sample at which it is stepped,
            which are computed only then.
        start : int
            First sample that the bank has not seen.

        Raises
        ------
        ValueError
            As `run`; if the bank has started where ``start`` is 0, or has not where it is more.
        """
        expect_log(log)
        self._check_log(log, start)
        if self.may_start_again:
            for at, verdict in enumerate(drive(self, log, start=start), start=start):
                for name, box in (boxes or {}).items():
                    if name in verdict.steps:
                        box[at] = verdict.steps[name].box
                yield verdict, 1
            return
        fronts = {
            name: Front(name, observer.follow(log, None if boxes is None else boxes[name], start=start))
            for name, observer in self._running.observers.items()
        }
        k = start
        while k < len(log):
            running = [fronts[name] for name in self._running.observers]
            count = min((front.plain() for front in running), default=len(log) - k)
            count = max(count, 1)
            k += count
            steps = {front.name: front.take(count) for front in running}
            before, dt = log.u[k - 2] if k > 1 else None, log.interval_at(k - 1)
            now = Sample.given(before, log.y[k - 1], log.u[k - 1], log.schedule_at(k - 1), dt)
            yield self._conclude((-1 if self._sample is None else self._sample) + count, steps, now), count

    def _boxes_of(self, log: Log) -> Callable[[], dict[str, tuple[Array, Array]]]:
        """What computes the boxes of a run from the present sample on, after it too."""
        models = {id(o.model): o.model for o in self.observers.values()}  # values, as large as all the rest
        try:
            again = deepcopy(self, dict(models))
        except Exception as error:
            why = f"the bank cannot be copied ({type(error).__name__}: {error}), so its boxes cannot be computed again"

            def refuse() -> dict[str, tuple[Array, Array]]:
                raise ValueError(why)

            return refuse
        return lambda: again._boxes(log)

    def _boxes(self, log: Log) -> dict[str, tuple[Array, Array]]:
        """Bounds of the state over a log by each observer, (K, n) each; NaN where it has none."""
        boxes = {name: np.full((len(log), 2, o.model.n_states), np.nan) for name, o in self.observers.items()}
        for _ in self.follow(log, boxes):
            pass
        return {name: (box[:, 0], box[:, 1]) for name, box in boxes.items()}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "observers": dict(self.observers)}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.__dict__.update(state)
        self.observers = MappingProxyType(self.observers)

    # -- what the architectures add ----------------------------------------------------------------

    @abstractmethod
    def _begin_again(
        self, state: LogicState, k: int, steps: dict[str, Step], falsified: Collection[str], now: Sample
    ) -> LogicState:
        """Start the observers that the logic asks for; ``steps`` may gain their answers."""

    @abstractmethod
    def _memory(self) -> dict[str, NDArray[np.float64]]:
        """What an architecture keeps besides, as named arrays."""

    @abstractmethod
    def _recall(self, arrays: Mapping[str, NDArray[np.float64]]) -> None:
        """Take back what `_memory` gave."""

    @property
    def may_start_again(self) -> bool:
        """Whether an observer may be started during a run, from the sets that others have at that sample."""
        return True

    # -- inside ------------------------------------------------------------------------------------

    def _forget(self) -> None:
        self._sample: int | None = None
        self._running = Running(self.observers)
        self._largest_at: int | None = None  # what the set that observers start from rests on
        self._latest = Sample(None, self._nothing(), None)
        self._adopt(self._logic.initial())

    @property
    def _kind(self) -> list[str]:
        """What a state must agree in: architecture, models and options."""
        return [type(self).__name__, *self.observers, repr(self._logic)]

    def _resume(self, state: BankState) -> None:
        """Go on from a saved state."""
        if state.kind != self._kind:
            raise ValueError(f"it is of {state.kind}, this bank is {self._kind}")
        observers = {name: restored(name, observer, state.observers[name]) for name, observer in self.observers.items()}
        self._recall(state.memory)
        self._largest_at = int(state.memory["largest_at"]) if "largest_at" in state.memory else None
        self.observers = MappingProxyType(observers)
        self._running = Running(self.observers)
        self._sample, self._latest = state.sample, state.latest
        self._adopt(state.logic)

    def _adopt(self, state: LogicState) -> None:
        self._state = state
        self._running.choose(state.running)

    def _conclude(self, k: int, steps: dict[str, Step], now: Sample) -> Verdict:
        falsified, undecided = falsified_and_undecided(steps)
        state = self._logic.advance(self._state, k, falsified, undecided)
        return self._apply(k, state, steps, falsified, now)

    def _apply(
        self, k: int, state: LogicState, steps: dict[str, Step], falsified: Collection[str], now: Sample
    ) -> Verdict:
        """Do what the logic asks for at sample k."""
        state = self._begin_again(state, k, steps, falsified, now)
        if state is not self._state:
            self._adopt(state)
        self._sample, self._latest = k, now
        return Verdict(k, state.state, state.fault, state.alive, state.detected_at, state.isolated_at, steps)

    def _rest_on(self, k: int, steps: Mapping[str, Step], names: Collection[str]) -> None:
        """Note the newest sample at which a set that one of these rests on was the largest; k is the present one."""
        own = [(steps[name], self.observers[name].largest_at) for name in names]
        self._largest_at = max((k + at - step.sample for step, at in own if at is not None), default=None)

    def _start_from(
        self, name: str, set: HPolytope | None, at: Sample, y: ArrayLike | None = None, largest_at: int | None = None
    ) -> Step:
        """As `svo.isolation.starts.start_from`."""
        return start_from(name, self.observers[name], set, at, y, largest_at)

    def _predict_from(self, name: str, set: HPolytope | None, now: Sample, largest_at: int | None) -> Step:
        """As `svo.isolation.starts.predict_from`."""
        return predict_from(name, self.observers[name], set, self._latest, now, largest_at)

    def _nothing(self) -> ArrayLike:
        return nothing_of(self.observers[NOMINAL])

    def _check_log(self, log: Log, start: int) -> None:
        check_log(log, self.observers[NOMINAL].model, start, self._sample is not None)


def falsified_and_undecided(steps: Mapping[str, Step]) -> tuple[list[str], list[str]]:
    """Names of the falsified and of the undecided observers."""
    falsified: list[str] = []
    undecided: list[str] = []
    for name, step in steps.items():
        if step.verdict != "consistent":
            (falsified if _is_proved(name, step) else undecided).append(name)
    return falsified, undecided


def _is_proved(name: str, step: Step) -> bool:
    if step.verdict == "falsified" and step.certificate is None:
        raise ValueError(f"observer {name!r} answered 'falsified' without a certificate; expected one, or 'undecided'")
    return step.verdict == "falsified"
