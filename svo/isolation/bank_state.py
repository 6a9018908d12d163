"""The state of a bank as named arrays: observers, conclusions, and what observers would start again from.

Names are ``observer.<number>.<name>`` for the arrays of the observers, in the order of the bank, and ``bank.<name>``
for the rest. Conclusions are JSON in an array of text; nothing is pickled.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.isolation.logic import LogicState, Tally
from svo.models.digest import canonical
from svo.observers.base import Observer
from svo.observers.saved_state import digest_of_arrays

if TYPE_CHECKING:
    from svo.isolation.bank import Bank

State = dict[str, NDArray[Any]]
_SET = ("A", "b", "C", "d")
_SEAL = "bank.seal"


def saved_state(bank: Bank) -> State:
    """See `Bank.state_dict`."""
    for name, observer in bank.observers.items():
        if not (hasattr(observer, "state_dict") and hasattr(type(observer), "from_state_dict")):
            raise TypeError(f"observer {name!r} ({type(observer).__name__}) has no state_dict to save")
    state: State = {
        f"observer.{i}.{key}": value
        for i, observer in enumerate(bank.observers.values())
        for key, value in observer.state_dict().items()  # type: ignore[attr-defined]
    }
    conclusions = {"kind": _kind(bank), "sample": bank._sample, "logic": asdict(bank._state)}
    state["bank.conclusions"] = np.array(json.dumps(conclusions))
    for key, value in (*bank._latest.arrays().items(), *bank._memory().items()):
        state[f"bank.{key}"] = value
    state[_SEAL] = np.array(digest_of_arrays(_own(state)))
    return state


def restore_state(bank: Bank, state: Mapping[str, NDArray[Any]]) -> None:
    """See `Bank.load_state_dict`."""
    if not isinstance(state, Mapping):
        raise TypeError(f"state is a {type(state).__name__}; expected the named arrays that state_dict() gave")
    try:
        conclusions = json.loads(str(state["bank.conclusions"]))
        if conclusions["kind"] != _kind(bank):
            raise ValueError(f"it is of {conclusions['kind']}, this bank is {_kind(bank)}")
        logic = _logic_state(conclusions["logic"])
        if str(state[_SEAL]) != digest_of_arrays(_own(state)):
            raise ValueError("its conclusions were changed since state_dict() made it")
        observers = {
            name: _restored(name, observer, _part(state, f"observer.{i}."))
            for i, (name, observer) in enumerate(bank.observers.items())
        }
        bank._resume(conclusions["sample"], logic, observers, _part(state, "bank."))
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"state does not belong to this bank: {error}") from error


def _restored(name: str, observer: Observer, state: State) -> Observer:
    """An observer as a state describes it, which must be one like the bank's."""
    again: Observer = type(observer).from_state_dict(observer.model, state)  # type: ignore[attr-defined]
    options, wanted = getattr(again, "options", None), getattr(observer, "options", None)
    if options is not None and wanted is not None and canonical(options) != canonical(wanted):
        raise ValueError(f"observer {name!r} has other options than this bank's")
    return again


def _own(state: Mapping[str, NDArray[Any]]) -> State:
    """What is the bank's own."""
    return {key: value for key, value in state.items() if key.startswith("bank.") and key != _SEAL}


def set_arrays(name: str, P: HPolytope | None) -> State:
    """A set, or none, as named arrays."""
    return {} if P is None else {f"{name}.{part}": getattr(P, part) for part in _SET}


def set_of(name: str, state: Mapping[str, NDArray[Any]]) -> HPolytope | None:
    """What `set_arrays` named."""
    return HPolytope(*(state[f"{name}.{part}"] for part in _SET)) if f"{name}.A" in state else None


def _kind(bank: Bank) -> list[str]:
    """What a state must agree in: architecture, models and options."""
    return [type(bank).__name__, *bank.observers, repr(bank._logic)]


def _part(state: Mapping[str, NDArray[Any]], prefix: str) -> State:
    return {key.removeprefix(prefix): state[key] for key in state if key.startswith(prefix)}


def _logic_state(values: dict[str, Any]) -> LogicState:
    lists = {key: tuple(values[key]) for key in ("alive", "running", "restart")}
    return LogicState(**{**values, **lists, "tallies": tuple(Tally(**tally) for tally in values["tallies"])})
