"""What a bank's next samples depend on, a value that it gives and takes; and the same as named arrays.

Names are ``observer.<number>.<name>`` for the arrays of the observers, in the order of the bank, and ``bank.<name>``
for the rest. Conclusions are JSON in an array of text; nothing is pickled.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from svo.checks import real_array
from svo.isolation.logic import LogicState, Tally
from svo.models.digest import canonical
from svo.observers.base import Observer, Step
from svo.observers.saved_state import digest_of_arrays

State = dict[str, NDArray[Any]]
_NAMES = ("u", "y", "u_next", "schedule", "dt", "u_range")
_CONCLUSIONS, _SEAL = "bank.conclusions", "bank.seal"


@dataclass(frozen=True, slots=True)
class Sample:
    """The arguments of a bank's step, kept for observers that have to repeat it."""

    u: ArrayLike | None
    y: ArrayLike
    u_next: ArrayLike | None
    schedule: Any = None
    dt: float | None = None
    u_range: ArrayLike | None = None

    @classmethod
    def given(
        cls,
        u: ArrayLike | None,
        y: ArrayLike,
        u_next: ArrayLike | None,
        schedule: Any,
        dt: float | None = None,
        u_range: ArrayLike | None = None,
    ) -> Sample:
        """Copies of what a user hands over, whose arrays may hold the next sample when these are needed again."""
        before = None if u is None else real_array("u", u, finite=False)
        after = None if u_next is None else real_array("u_next", u_next, finite=False)
        ahead = None if u_range is None else real_array("u_range", u_range, finite=False)
        return cls(before, real_array("y", y, finite=False, missing=True), after, schedule, dt, ahead)

    def first(self, observer: Observer, y: ArrayLike) -> Step:
        """The answer of an observer to a measurement (ny,) at this sample, its first one."""
        return observer.update(y, u=self.u_next, schedule=self.schedule, **self._ahead(observer))

    def to(self, observer: Observer, y: ArrayLike, **options: Any) -> Step:
        """The answer of an observer to this sample with a measurement (ny,)."""
        if self.dt is not None:
            options["dt"] = self.dt
        options |= self._ahead(observer)
        return observer.step(self.u, y, u_next=self.u_next, schedule=self.schedule, **options)

    def _ahead(self, observer: Observer) -> dict[str, Any]:
        """What an observer is told of inputs that follow, whose readings may be taken that late."""
        return {} if self.u_range is None or observer.jitter is None else {"u_range": self.u_range}

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """Those that are given, by name."""
        given = {name: getattr(self, name) for name in _NAMES}
        try:
            return {name: real_array(name, v, finite=False, missing=True) for name, v in given.items() if v is not None}
        except (TypeError, ValueError) as error:
            raise TypeError(f"schedule is {self.schedule!r}; only numbers and arrays of them can be saved") from error

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[np.float64]]) -> Sample:
        """What `arrays` gave; numbers are numbers again."""
        u, y, u_next, schedule, dt, ahead = (arrays.get(name) for name in _NAMES)
        if y is None:
            raise ValueError("y is missing")
        value = float(schedule) if schedule is not None and schedule.ndim == 0 else schedule
        return cls(u, y, u_next, value, None if dt is None else float(dt), ahead)


@dataclass(frozen=True, eq=False)
class BankState:
    """Everything that the next samples of a bank depend on.

    Attributes
    ----------
    kind : list of str
        What the bank must agree in: its architecture, the names of its observers, its options.
    sample : int or None
        Number of the newest sample.
    logic : LogicState
        What was concluded from it.
    latest : Sample
        Its data.
    memory : mapping of str to array
        What an architecture keeps besides.
    observers : mapping of str to mapping of str to array
        What each observer's ``state_dict`` gave.
    """

    kind: list[str]
    sample: int | None
    logic: LogicState
    latest: Sample
    memory: State
    observers: Mapping[str, State]

    def arrays(self) -> State:
        """As named arrays."""
        parts = {f"observer.{i}": part for i, part in enumerate(self.observers.values())}
        parts["bank"] = self.latest.arrays() | self.memory
        state = {f"{owner}.{key}": value for owner, part in parts.items() for key, value in part.items()}
        conclusions = {"kind": self.kind, "sample": self.sample, "logic": asdict(self.logic)}
        state[_CONCLUSIONS] = np.array(json.dumps(conclusions))
        return state | {_SEAL: np.array(_digest(state))}

    @classmethod
    def of_arrays(cls, state: Mapping[str, NDArray[Any]]) -> BankState:
        """What `arrays` named.

        Raises
        ------
        AttributeError, KeyError, TypeError, ValueError
            For anything else.
        """
        conclusions = json.loads(str(state[_CONCLUSIONS]))
        if str(state[_SEAL]) != _digest(state):
            raise ValueError("its conclusions were changed since state_dict() made it")
        memory, (_, *names, _) = _part(state, "bank."), conclusions["kind"]
        return cls(
            kind=conclusions["kind"],
            sample=conclusions["sample"],
            logic=_logic_state(conclusions["logic"]),
            latest=Sample.of_arrays(memory),
            memory=memory,
            observers={name: _part(state, f"observer.{i}.") for i, name in enumerate(names)},
        )


def saved(name: str, observer: Observer) -> State:
    """The state of an observer of a bank."""
    if not observer.saves_state:
        raise TypeError(f"observer {name!r} ({type(observer).__name__}) has no state_dict to save")
    return observer.state_dict()


def restored(name: str, observer: Observer, state: State) -> Observer:
    """An observer as a state describes it, which must be one like the bank's."""
    again = type(observer).from_state_dict(observer.model, state)
    if canonical(again.options) != canonical(observer.options):
        raise ValueError(f"observer {name!r} has other options than this bank's")
    return again


def _digest(state: Mapping[str, NDArray[Any]]) -> str:
    """Of what is the bank's own."""
    return digest_of_arrays({key: v for key, v in state.items() if key.startswith("bank.") and key != _SEAL})


def _part(state: Mapping[str, NDArray[Any]], prefix: str) -> State:
    return {key.removeprefix(prefix): state[key] for key in state if key.startswith(prefix)}


def _logic_state(values: dict[str, Any]) -> LogicState:
    lists = {key: tuple(values[key]) for key in ("alive", "running", "restart")}
    return LogicState(**{**values, **lists, "tallies": tuple(Tally(**tally) for tally in values["tallies"])})
