"""The tables [faults.NAME]: models of faults, from the fault objects or from arrays of their own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from polytopes.shown import Shown
from svo.faults import ActuatorFault, PlantFault, SensorFault, Step
from svo.isolation import GLOBAL, NOMINAL
from svo.models import UncertainModel, Uncertainty
from svo.models.nonlinear import NonlinearModel
from svo.plant.description.model import ARRAYS, arrays_of, remainder_of
from svo.plant.description.table import Table

KEYS = {
    "sensor": ("output", "kind", "magnitude"),
    "actuator": ("input", "kind", "magnitude", "travel", "frequency_hz"),
    "plant": (*ARRAYS, "magnitude", "remainder"),
    "model": (*ARRAYS, "n", "w", "contains_nominal", "remainder"),
}


@dataclass(frozen=True)
class FaultModel(Shown):
    """An observer's model of a fault, and whether the healthy plant is one of the plants that it describes.

    Of a nonlinear plant also how it is simulated: the fault that is ``acting``, or the parameters that are ``moved``.
    """

    model: UncertainModel | NonlinearModel
    contains_nominal: bool
    acting: Any = None
    moved: tuple[str, ...] = ()


def faults_of(top: Table, nominal: UncertainModel, names: Mapping[str, Sequence[str]]) -> dict[str, FaultModel]:
    """The models of all faults, by name."""
    every = top.table("faults")
    return {name: _fault_model(check_name(every, name), nominal, names) for name in every.content}


def check_name(every: Table, name: str) -> Table:
    """The table of a fault, unless its name is taken."""
    if name in (NOMINAL, GLOBAL):
        raise every.error(name, "is the name of an observer that every bank has; give the fault another name")
    return every.table(name)


def _fault_model(table: Table, nominal: UncertainModel, names: Mapping[str, Sequence[str]]) -> FaultModel:
    kind = table.text("type", choices=tuple(KEYS))
    table.check_keys(("type", *KEYS[kind]))
    remainder = _own_remainder(table, nominal)
    if kind == "model":
        arrays = arrays_of(table)
        if not arrays:
            raise table.error(None, f"is the nominal model; expected at least one of {', '.join(KEYS['model'])}")
        with table.errors():
            model = _in_time_of(nominal, lambda plant: plant.replace(**arrays), remainder)
            return FaultModel(model, table.truth("contains_nominal", False))
    with table.errors():
        return FaultModel(_in_time_of(nominal, fault_of(table, kind, names).model, remainder), contains_nominal=True)


def _own_remainder(table: Table, nominal: UncertainModel) -> Any:
    if "remainder" not in table:
        return None
    if nominal.origin is None:
        raise table.error(
            "remainder", "has no meaning for a discrete model; drop it, or say continuous = true in [model]"
        )
    return remainder_of(table)


def _in_time_of(
    nominal: UncertainModel, change: Callable[[UncertainModel], UncertainModel], remainder: Any
) -> UncertainModel:
    """A fault's arrays are in the same time as those of [model]."""
    return change(nominal) if nominal.origin is None else nominal.origin.changed(change, remainder)


def fault_of(table: Table, kind: str, names: Mapping[str, Sequence[str]]) -> ActuatorFault | PlantFault | SensorFault:
    """The fault of a table of type "sensor", "actuator" or "plant".

    ``names`` are those of "inputs" and "outputs".
    """
    # An observer's model holds at all times, so the profile says nothing here.
    magnitude = table.number("magnitude") if "magnitude" in table else None
    options: dict[str, Any] = {"magnitude": magnitude, "profile": Step()}
    if kind == "plant":
        arrays: dict[str, Any] = {name: table.array(name) for name in ARRAYS if name in table}
        if not any(array.any() for array in arrays.values()):
            raise table.error(None, f"changes nothing; expected at least one of {', '.join(ARRAYS)} that is not zero")
        direction = Uncertainty(**arrays)
        return PlantFault(direction=direction, **options | {"magnitude": table.number("magnitude")})
    if kind == "sensor":
        where = channels_of(table, "output", names["outputs"])
        return SensorFault(where, table.text("kind"), **options | {"magnitude": table.number("magnitude")})  # type: ignore[arg-type]
    if "travel" in table:
        options["travel"] = tuple(table.array("travel"))
    if "frequency_hz" in table:
        options["frequency_hz"] = table.number("frequency_hz")
    return ActuatorFault(channels_of(table, "input", names["inputs"]), table.text("kind"), **options)  # type: ignore[arg-type]


def channels_of(table: Table, key: str, names: Sequence[str]) -> int | tuple[int, ...]:
    """Positions of the column or columns that a key names."""
    value = table.content.get(key)
    chosen = [value] if isinstance(value, str) else value
    if not isinstance(chosen, list) or not chosen or not all(name in names for name in chosen):
        raise table.error(key, f"is {value!r}; expected one or more of the columns {', '.join(names)}")
    where = tuple(names.index(name) for name in chosen)
    return where[0] if len(where) == 1 else where
