"""Banks of observers that detect and isolate faults (Rosa and Silvestre 2013, sections 4.1, 4.2 and Figure 6)."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from polytopes import HPolytope
from polytopes.signatures import options_by_name
from svo.checks import Array, bounded_box
from svo.isolation.bank import Bank, falsified_and_undecided
from svo.isolation.bank_checks import by_name, check_contain_nominal, check_counts
from svo.isolation.bank_state import Sample
from svo.isolation.global_logic import GlobalLogic
from svo.isolation.logic import GLOBAL, NOMINAL, IsolationLogic, LogicState
from svo.observers.base import Observer, Step
from svo.observers.saved_state import arrays_of, read_arrays

Box = tuple[Array, Array]


class ArchitectureI(Bank):
    """A nominal observer and one observer a fault, all running from the start.

    Every fault model must contain the nominal plant. Where the contrary is sure (`svo.isolation.containment`), it is
    refused; elsewhere it is for the user to know: a fault's model that a healthy log falsifies does not. A fault is
    detected when the nominal model is falsified, and isolated when exactly one fault model is left. An observer that is
    declared falsified is no longer stepped.

    Parameters
    ----------
    nominal : Observer
    faults : mapping of str to Observer
        One observer a fault, by the fault's name. All observers see the same inputs and outputs; no
        observer may stand twice in the bank. Without any the bank detects only, and a falsified nominal
        model leaves the data unexplained.
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
    Where there is no such set, or it is unbounded since a survivor's was lost in a gap, an observer starts as one that
    has lost its own: from its model's largest set, or when the readings alone bound the state.

    Raises
    ------
    ValueError
        For a bad or missing name, an observer used twice, observers whose models differ in inputs, outputs
        or sampling time (in states, if observers can start again), a fault's model that does not contain the nominal
        plant, or a count below one.
    """

    @options_by_name
    def __init__(
        self,
        nominal: Observer,
        faults: Mapping[str, Observer],
        *,
        debounce: int = 1,
        recovery: int | None = None,
        timeout: int | None = None,
    ) -> None:
        check_counts(debounce, recovery, timeout)
        observers = by_name(nominal, faults, reserved=(NOMINAL, GLOBAL))
        check_contain_nominal(observers)
        logic = IsolationLogic(tuple(observers), debounce, recovery, timeout)
        super().__init__(logic, observers, same_states=logic.may_restart)

    def _forget(self) -> None:
        super()._forget()
        self._hull: Box | None = None

    @property
    def may_start_again(self) -> bool:
        return self._logic.may_restart

    def _memory(self) -> dict[str, Array]:
        return {} if self._hull is None else {"hull": np.array(self._hull)}

    def _recall(self, arrays: Mapping[str, Array]) -> None:
        hull = arrays.get("hull")
        self._hull = None if hull is None else (hull[0], hull[1])

    def _begin_again(
        self, state: LogicState, k: int, steps: dict[str, Step], falsified: Collection[str], now: Sample
    ) -> LogicState:
        """Initialise the observers that the logic asks for, and keep the hull of this sample's boxes."""
        if not self._logic.may_restart:
            return state
        survivors = [name for name in steps if name not in falsified]
        if survivors:
            self._hull = _hull([steps[name].box for name in survivors])
            self._rest_on(k, steps, survivors)
            for name in state.restart:
                self._start_from(name, _box(self._hull), now, largest_at=_age(k, self._largest_at))
        elif self._hull is None:
            if not all(_has_largest_set(self.observers[name]) for name in state.restart):
                return self._logic.give_up(state, k)
            for name in state.restart:
                self._start_from(name, None, now)
        elif state.restart:
            before, since = _box(self._hull), _age(k, self._largest_at)
            self._hull = _hull([self._predict_from(name, before, now, since).box for name in state.restart])
        return state


class ArchitectureII(Bank):
    """A nominal and a global observer, and fault observers that start from the global set when there is a fault.

    The nominal observer detects; once it is declared falsified, the observers of class II start from the
    global set with the measurement of that sample, so that their models need not contain the nominal plant.
    Those of class I, which contain it, run from the start. A fault is isolated when exactly one fault model
    is left. An observer that is declared falsified is no longer stepped.

    Parameters
    ----------
    nominal : Observer
    faults : mapping of str to Observer
        One observer a fault, by the fault's name; no observer may stand twice in the bank. The sets that
        the observers of class II were built with are not used.
    global_ : Observer or HPolytope
        Its set contains the state whether the plant is healthy or has any of the faults: an observer of a
        model that contains all the others, or a bounded set that the state never leaves. The observer runs
        from the start; its answers are ``Verdict.steps["global"]``. When it is declared falsified, no model
        explains the data, and the bank is "unexplained".
    class_one : sequence of str
        Faults whose models contain the nominal plant.
    debounce : int
        Certified falsifications, each after a new initialisation from the global set, that declare a model
        falsified (the paper's Remark 5). The global observer's own count too; it starts again from its set
        at the sample before, moved on without the measurement that falsified it.
    recovery : int, optional
        Consistent samples, since its start from the global set, after which a falsified nominal model is
        believed again: the fault is over and all models are alive and start from the global set. Also
        the consistent samples after which falsifications short of the debounce are forgotten, and the trial
        of every model after "unexplained". By default a declared falsification is final.
    timeout : int, optional
        Samples from detection without isolation after which all models are alive again and start from the
        global set.

    Notes
    -----
    The bank never rules out the true fault if the plant keeps to a model of the bank: the global one
    always, the nominal one until the fault begins, and the fault's own from then on. Recovery and timeout
    assume that a fault that is still there falsifies the nominal model within so many samples.

    Raises
    ------
    ValueError
        For a bad or missing name, an observer used twice, observers whose models differ in inputs, outputs,
        states or sampling time, a global set that is empty, unbounded or of the wrong dimension, or a count
        below one.
    """

    @options_by_name
    def __init__(
        self,
        nominal: Observer,
        faults: Mapping[str, Observer],
        global_: Observer | HPolytope,
        *,
        class_one: Collection[str] = (),
        debounce: int = 1,
        recovery: int | None = None,
        timeout: int | None = None,
    ) -> None:
        check_counts(debounce, recovery, timeout)
        observers = by_name(nominal, faults, reserved=(NOMINAL, GLOBAL))
        if not faults:
            raise ValueError("faults is empty; expected at least one fault observer (ArchitectureI needs none)")
        names = tuple(observers)
        _check_class_one(class_one, faults)
        self._constant: HPolytope | None = None
        if isinstance(global_, HPolytope):
            bounded_box("global_", global_, nominal.model.n_states)
            self._constant = global_
        else:
            observers[GLOBAL] = global_
        class_two = tuple(name for name in faults if name not in class_one)
        logic = GlobalLogic(names, debounce, recovery, timeout, class_two, observed=self._constant is None)
        super().__init__(logic, observers, same_states=True)

    def _forget(self) -> None:
        super()._forget()
        self._global_set = self._constant

    def _memory(self) -> dict[str, Array]:
        return {} if self._global_set is None else arrays_of("global", self._global_set)

    def _recall(self, arrays: Mapping[str, Array]) -> None:
        self._global_set = read_arrays(HPolytope, "global", arrays) if "global.A" in arrays else None

    def _begin_again(
        self, state: LogicState, k: int, steps: dict[str, Step], falsified: Collection[str], now: Sample
    ) -> LogicState:
        """Start the observers that the logic asks for from the global set of this sample."""
        if GLOBAL in falsified and self._global_set is None:
            return self._logic.give_up(state, k)
        self._keep_global_set(state, k, steps, now)
        while state.restart:
            fallen = self._start(state, k, steps, now)
            if not fallen:
                break
            # The others have no new answer at this sample.
            state = self._logic.advance(state, k, fallen, undecided=(*self.names, GLOBAL))
        return state

    def _keep_global_set(self, state: LogicState, k: int, steps: dict[str, Step], now: Sample) -> None:
        if GLOBAL in state.restart:
            assert self._global_set is not None
            since = _age(k, self._largest_at)
            self._global_set = self._predict_from(GLOBAL, _bounded(self._global_set), now, since).set
        elif GLOBAL in steps and (state.restart or self._logic.may_restart):
            self._global_set = steps[GLOBAL].set
            self._rest_on(k, steps, [GLOBAL])

    def _start(self, state: LogicState, k: int, steps: dict[str, Step], now: Sample) -> list[str]:
        """Start observers, keep the answers of those that did not fall, and say which fell at once."""
        assert self._global_set is not None
        started: dict[str, Step] = {}
        for name in state.restart:
            if name == GLOBAL:
                continue
            # The measurement that falsified an observer is left out: it may be an outlier.
            measures = name not in steps and state.state in ("detected", "isolated")
            since = _age(k, self._largest_at)
            step = self._start_from(name, _bounded(self._global_set), now, now.y if measures else None, since)
            if name not in steps or steps[name].verdict != "falsified":
                started[name] = step
        steps |= started
        return falsified_and_undecided(started)[0]


def _hull(boxes: list[Box]) -> Box:
    return np.min([lower for lower, _ in boxes], axis=0), np.max([upper for _, upper in boxes], axis=0)


def _box(hull: Box) -> HPolytope | None:
    """None where a set is lost, so that nothing bounds the state."""
    return HPolytope.box(*hull) if np.isfinite(hull).all() else None


def _bounded(set: HPolytope) -> HPolytope | None:
    """None where a set is lost."""
    return set if np.isfinite(set.bounding_box()).all() else None


def _has_largest_set(observer: Observer) -> bool:
    return observer.model.start_range is not None and observer.starts_without_set


def _age(k: int, sample: int | None) -> int | None:
    """A sample as counted from sample k."""
    return None if sample is None else sample - k


def _check_class_one(class_one: Collection[str], faults: Mapping[str, Observer]) -> None:
    if isinstance(class_one, str):
        raise TypeError(f"class_one is the string {class_one!r}; expected a sequence of fault names, such as a tuple")
    for name in class_one:
        if name not in faults:
            raise ValueError(f"class_one has the name {name!r}; expected names among the faults: {', '.join(faults)}")
