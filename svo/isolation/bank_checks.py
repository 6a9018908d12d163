"""What a bank asks of its observers, their names and its options."""

from __future__ import annotations

from collections.abc import Mapping

from svo.checks import Array, expect, expect_kind, expect_shape, is_count
from svo.isolation.containment import excludes
from svo.isolation.logic import NOMINAL
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.observers.base import Observer

_AN_OBSERVER = (
    "an observer, such as WindowObserver(model, initial): one of your own is a subclass of svo.observers.base.Observer"
)


def by_name(nominal: Observer, faults: Mapping[str, Observer], reserved: tuple[str, ...]) -> dict[str, Observer]:
    """All models' observers by name, the nominal one first; refuses bad names and the reserved ones."""
    taken = " or ".join(repr(name) for name in reserved)
    expect_kind("faults", faults, Mapping, "a mapping of fault names to observers")
    for name in faults:
        if not isinstance(name, str) or not name.strip() or name in reserved:
            raise ValueError(f"faults has the name {name!r}; expected a string that is not empty and not {taken}")
    observers = {NOMINAL: nominal, **faults}
    for name, observer in observers.items():
        expect_kind(repr(name), observer, Observer, _AN_OBSERVER)
    return observers


def check_contain_nominal(observers: Mapping[str, Observer]) -> None:
    """Refuse fault models that surely do not contain the nominal plant, which Architecture I rests on."""
    nominal = observers[NOMINAL].model
    for name, observer in observers.items():
        alike = observer.model.n_inputs == nominal.n_inputs and observer.model.n_outputs == nominal.n_outputs
        if name != NOMINAL and alike and excludes(observer.model, nominal):
            raise ValueError(
                f"the model of fault {name!r} does not contain the nominal plant: no value of its uncertainties gives "
                "the nominal response to the inputs; expected bounds that reach from no fault to the largest one, or "
                "use ArchitectureII with global_=..., whose fault models need not contain it"
            )


def check_counts(debounce: int, recovery: int | None, timeout: int | None) -> None:
    """Refuse counts of samples below one."""
    for name, value, or_none in (
        ("debounce", debounce, ""),
        ("recovery", recovery, ", or None"),
        ("timeout", timeout, ", or None"),
    ):
        expect(is_count(value, 1) or (or_none and value is None), name, value, f"a number of samples >= 1{or_none}")


def check_observers(observers: Mapping[str, Observer], same_states: bool) -> None:
    """Refuse an observer that stands twice, and models that differ in what a bank needs to agree."""
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


def check_log(log: Log, model: UncertainModel, start: int, started: bool) -> None:
    """Refuse a log of other channels than the models', or samples ``start`` of it at which a bank does not stand."""
    if start == 0 and started:
        raise ValueError("run was called on a bank that has already started; call reset(set), or use a fresh bank")
    if start > 0 and not started:
        raise ValueError(f"start is {start}, but the bank has seen no sample; expected 0")
    for name, wanted in (("u", model.n_inputs), ("y", model.n_outputs)):
        array: Array = getattr(log, name)
        expect_shape(array.shape[1] == wanted, f"log.{name}", array, f"(samples, {wanted}), as the models have")
