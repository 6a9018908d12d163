"""Banks of observers that detect and isolate faults (Rosa and Silvestre 2013, section 4.2 and Figure 6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from svo.isolation.logic import NOMINAL, IsolationLogic, LogicState
from svo.isolation.record import BankRecord, Recorder, Verdict
from svo.log import Log
from svo.observers.step import Observer, Step

Array = NDArray[np.float64]
Box = tuple[Array, Array]


@dataclass(frozen=True, slots=True)
class _Sample:
    """The arguments of a bank's step, kept for observers that have to repeat it."""

    u: ArrayLike | None
    u_next: ArrayLike | None
    schedule: Any


class ArchitectureI:
    """A nominal observer and one observer a fault, all running from the start.

    Every fault model must contain the nominal plant. A fault is detected when the nominal model is
    falsified, and isolated when exactly one fault model is left. An observer that is declared falsified is
    no longer stepped.

    Parameters
    ----------
    nominal : Observer
    faults : mapping of str to Observer
        One observer a fault, by the fault's name. All observers see the same inputs and outputs; no
        observer may stand twice in the bank.
    debounce : int
        Certified falsifications, each after a new initialisation, that declare a model falsified.
    recovery : int, optional
        Consistent samples after which earlier falsifications of an observer are forgotten and, if it is
        the nominal one, the fault is declared over and all models are alive again. By default a declared
        falsification is final. It also brings the bank back from "unexplained".
    timeout : int, optional
        Samples from detection without isolation after which all models are alive again.

    Notes
    -----
    An observer starts again from the bounding box of the union of the survivors' boxes. Where no
    observer survives a sample, from that of the sample before, moved on by its own model without the
    measurement that nothing explains. These sets contain the true state if one of the survivors' models
    holds (in the second case: held until the sample before); that is the assumption behind debounce,
    recovery and timeout. Without any of the three, nothing ever starts again and no such assumption is made.

    Raises
    ------
    ValueError
        For a bad or missing name, an observer used twice, observers whose models differ in inputs, outputs
        or sampling time (in states, if observers can start again), or a count below one.
    """

    def __init__(
        self,
        nominal: Observer,
        faults: Mapping[str, Observer],
        debounce: int = 1,
        recovery: int | None = None,
        timeout: int | None = None,
    ) -> None:
        _check_names(faults)
        _check_count("debounce", debounce)
        _check_count("recovery", recovery, optional=True)
        _check_count("timeout", timeout, optional=True)
        observers = {NOMINAL: nominal, **faults}
        self.names = tuple(observers)
        self.observers: Mapping[str, Observer] = MappingProxyType(observers)
        self._logic = IsolationLogic(self.names, debounce, recovery, timeout)
        _check_observers(observers, self._logic.may_restart)
        self._forget()

    # -- samples -----------------------------------------------------------------------------------

    def update(self, y0: ArrayLike, u: ArrayLike | None = None, schedule: Any = None) -> Verdict:
        """The first measurement, without a transition; ``u`` is needed only if D or a D_i is not zero.

        Raises
        ------
        ValueError
            If the bank has already started.
        """
        if self._sample is not None:
            raise ValueError("update was called after the first sample; use step(u, y), or reset(set) to start again")
        steps = {name: observer.update(y0, u=u, schedule=schedule) for name, observer in self._running.items()}
        return self._conclude(0, steps, _Sample(None, u, schedule))

    def step(
        self, u: ArrayLike | None, y: ArrayLike, u_next: ArrayLike | None = None, schedule: Any = None
    ) -> Verdict:
        """One transition driven by u, then the measurement y; arguments as for the observers.

        Raises
        ------
        ValueError
            If there was no first measurement, or an observer refuses the arguments.
        """
        if self._sample is None:
            raise ValueError("step was called before the first measurement; call update(y0), with NaN if there is none")
        steps = {n: o.step(u, y, u_next=u_next, schedule=schedule) for n, o in self._running.items()}
        return self._conclude(self._sample + 1, steps, _Sample(u, u_next, schedule))

    def reset(self, set: HPolytope) -> None:
        """Forget everything; all models are alive and the state at the next measurement lies in ``set``."""
        for observer in self.observers.values():
            observer.reset(set)
        self._forget()

    def warm_up(self) -> float:
        """Compile whatever the observers' steps need; returns the seconds that it took."""
        return sum(observer.warm_up() for observer in self.observers.values())

    def run(self, log: Log) -> BankRecord:
        """All samples of a log, with its own schedule.

        Raises
        ------
        ValueError
            If the bank has already started, or the log is empty or has other channels than the models.
        """
        self._check_log(log)
        recorder = Recorder(self.names, len(log))
        recorder.add(self.update(log.y[0], u=log.u[0], schedule=log.schedule_at(0)))
        for k in range(1, len(log)):
            recorder.add(self.step(log.u[k - 1], log.y[k], u_next=log.u[k], schedule=log.schedule_at(k)))
        return recorder.record()

    # -- inside ------------------------------------------------------------------------------------

    def _forget(self) -> None:
        self._sample: int | None = None
        self._hull: Box | None = None
        self._latest = _Sample(None, None, None)
        self._adopt(self._logic.initial())

    def _adopt(self, state: LogicState) -> None:
        self._state = state
        self._running = {name: self.observers[name] for name in state.running}

    def _conclude(self, k: int, steps: dict[str, Step], now: _Sample) -> Verdict:
        falsified: list[str] = []
        undecided: list[str] = []
        for name, step in steps.items():
            if step.verdict != "consistent":
                (falsified if _is_proved(name, step) else undecided).append(name)
        before, state = self._state, self._logic.advance(self._state, k, falsified, undecided)
        if self._logic.may_restart:
            survivors = [step.box for name, step in steps.items() if name not in falsified]
            state = self._begin_again(state, k, survivors, now)
        if state is not before:
            self._adopt(state)
        self._sample, self._latest = k, now
        return Verdict(k, state.state, state.fault, state.alive, state.detected_at, state.isolated_at, steps)

    def _begin_again(self, state: LogicState, k: int, survivors: list[Box], now: _Sample) -> LogicState:
        """Initialise the observers that the logic asks for, and keep the hull of this sample's boxes."""
        if survivors:
            self._hull = _hull(survivors)
            for name in state.restart:
                self._start_from(name, self._hull, now)
        elif self._hull is None:
            return self._logic.give_up(state, k)
        elif state.restart:
            self._hull = _hull([self._predict_from(name, self._hull, now) for name in state.restart])
        return state

    def _start_from(self, name: str, box: Box, at: _Sample) -> None:
        observer = self.observers[name]
        observer.reset(HPolytope.box(*box))
        # The survivors' sets have seen the measurement; this only tells the observer its schedule.
        observer.update(self._nothing(), u=at.u_next, schedule=at.schedule)

    def _predict_from(self, name: str, box: Box, now: _Sample) -> Box:
        """Start from the sample before, leaving out the measurement that nothing explains."""
        self._start_from(name, box, self._latest)
        return self.observers[name].step(now.u, self._nothing(), u_next=now.u_next, schedule=now.schedule).box

    def _nothing(self) -> Array:
        return np.full(self.observers[NOMINAL].model.n_outputs, np.nan)

    def _check_log(self, log: Log) -> None:
        if self._sample is not None:
            raise ValueError("run was called on a bank that has already started; call reset(set), or use a fresh bank")
        model = self.observers[NOMINAL].model
        if len(log) == 0:
            raise ValueError("log has no samples; expected at least one")
        for name, wanted in (("u", model.n_inputs), ("y", model.n_outputs)):
            shape = getattr(log, name).shape
            if shape[1] != wanted:
                raise ValueError(f"log.{name} has shape {shape}; expected (samples, {wanted}), as the models have")


def _is_proved(name: str, step: Step) -> bool:
    if step.verdict == "falsified" and step.certificate is None:
        raise ValueError(f"observer {name!r} answered 'falsified' without a certificate; expected one, or 'undecided'")
    return step.verdict == "falsified"


def _hull(boxes: list[Box]) -> Box:
    return np.min([lower for lower, _ in boxes], axis=0), np.max([upper for _, upper in boxes], axis=0)


def _check_names(faults: Mapping[str, Observer]) -> None:
    if not isinstance(faults, Mapping):
        raise TypeError(f"faults is a {type(faults).__name__}; expected a mapping of fault names to observers")
    if not faults:
        raise ValueError("faults is empty; expected at least one fault observer (to detect only, run one observer)")
    for name in faults:
        if not isinstance(name, str) or not name.strip() or name == NOMINAL:
            raise ValueError(f"faults has the name {name!r}; expected a string that is not empty and not {NOMINAL!r}")


def _check_count(name: str, value: int | None, optional: bool = False) -> None:
    if value is None and optional:
        return
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ValueError(f"{name} is {value!r}; expected a number of samples >= 1{', or None' if optional else ''}")


def _check_observers(observers: Mapping[str, Observer], same_states: bool) -> None:
    owners: dict[int, str] = {}
    for name, observer in observers.items():
        if id(observer) in owners:
            raise ValueError(f"{name!r} and {owners[id(observer)]!r} are the same observer; give each name its own")
        owners[id(observer)] = name
    nominal = observers[NOMINAL].model
    for name, observer in observers.items():
        for attribute in ("n_inputs", "n_outputs", "Ts", *(("n_states",) if same_states else ())):
            found, wanted = getattr(observer.model, attribute), getattr(nominal, attribute)
            if found != wanted:
                raise ValueError(f"the model of {name!r} has {attribute} = {found}; expected {wanted}, as nominal has")
