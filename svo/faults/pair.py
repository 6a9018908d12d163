"""Two faults at once (Rosa and Silvestre 2013, Remark 3: simultaneous faults need models of their own)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

from polytopes.shown import Shown
from svo.faults.actuator import ActuatorFault
from svo.faults.blocks import channels
from svo.faults.equations import Model
from svo.faults.parameter import ParameterFault
from svo.faults.plant import PlantFault
from svo.faults.sensor import SensorFault

Fault = ActuatorFault | ParameterFault | PlantFault | SensorFault


@dataclass(frozen=True)
class FaultPair(Shown):
    """Two faults that act together.

    Where both act on one channel the first acts first: of two actuator faults the second one moves what the
    first one achieves, of two sensor faults the second one reads what the first one gives.
    """

    first: Fault
    second: Fault

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            if not isinstance(getattr(self, name), Fault):
                raise TypeError(f"{name} is a {type(getattr(self, name)).__name__}; expected a fault of svo.faults")
        for name, (one, other) in self._equations().items():
            if not (isinstance(one, Mapping) and isinstance(other, Mapping) and not one.keys() & other.keys()):
                raise ValueError(
                    f"both faults have {name} of their own, of which one would be lost; expected equations of one "
                    "fault only, or a single ParameterFault whose equations are those of both"
                )

    def _equations(self) -> dict[str, tuple[Any, Any]]:
        """Equations that both faults write, by name."""
        one, other = (f.equations if isinstance(f, ParameterFault) else {} for f in (self.first, self.second))
        return {name: (one[name], other[name]) for name in one.keys() & other.keys()}

    def model(self, nominal: Model) -> Model:
        """The observer's model of the pair; it contains ``nominal`` and the model of each fault alone.

        Beside locking or a runaway that is so for commands within the travel, as of these faults alone.
        """
        model: Any = nominal
        for fault in self._in_order():
            model = fault.model(model)
        found: Model = model
        return found

    def _in_order(self) -> list[Fault]:
        """Innermost first: the plant, then what drives it, then what measures it, so that no product is lost."""
        both = (self.first, self._second())
        # An actuator's model acts on the command, before the faults that the model has already.
        actuators = [f for f in reversed(both) if isinstance(f, ActuatorFault)]
        sensors = [f for f in both if isinstance(f, SensorFault)]
        # Equations of a fault's own come before the terms of others, which are added to them.
        parameters = sorted((f for f in both if isinstance(f, ParameterFault)), key=lambda f: not f.equations)
        return [*parameters, *(f for f in both if isinstance(f, PlantFault)), *actuators, *sensors]

    @property
    def members(self) -> tuple[Fault, ...]:
        """The faults as a run has them: the plant's, then those of actuators and sensors, the first one first."""
        plant = [f for f in self._in_order() if isinstance(f, ParameterFault | PlantFault)]
        return *plant, *(f for f in (self.first, self._second()) if isinstance(f, ActuatorFault | SensorFault))

    def _second(self) -> Fault:
        """The second fault; a travel that it has is that of the command, and must let through what the first does."""
        first, second = self.first, self.second
        if not (isinstance(first, ActuatorFault) and isinstance(second, ActuatorFault)) or second.travel is None:
            return second
        if not set(channels(first.where)) & set(channels(second.where)):
            return second
        return replace(second, travel=first.reach(second.travel))


def pairs(faults: Mapping[str, Fault]) -> dict[str, FaultPair]:
    """All pairs of simultaneous faults, named "first + second", in the order of ``faults``.

    A pair's model contains those of its faults. Beside them in a bank, a single fault is therefore isolated only
    if the bank has neither of its pairs; run the pairs when every single fault is falsified.

    Parameters
    ----------
    faults : mapping of str to fault
        At least two.

    Raises
    ------
    ValueError
        For fewer than two faults, or names that make two pairs of one name.
    """
    if len(faults) < 2:
        raise ValueError(f"faults has {len(faults)} entries; expected at least two faults to pair")
    found: dict[str, FaultPair] = {}
    for first, second in combinations(faults, 2):
        name = f"{first} + {second}"
        if name in found:
            raise ValueError(f"faults make two pairs of the name {name!r}; expected names without ' + ' in them")
        found[name] = FaultPair(faults[first], faults[second])
    return found
