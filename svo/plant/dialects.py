"""Plants that state how their logs are written, and that take a log whose readings are less exact than the model's."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from svo.checks import Array
from svo.logs.dialect.rules import Dialect
from svo.plant.protocol import MonitoredPlant


@runtime_checkable
class StatesDialect(Protocol):
    """What a plant offers besides if its logs are not plain ones."""

    @property
    def dialect(self) -> Dialect | None:
        """How they are written; None for plain ones."""
        ...

    def widened(self, widening: Array) -> MonitoredPlant:
        """The plant with bounds of its sensors' noise that are wider by ``widening`` (ny,), healthy and faulty."""
        ...


def dialect_of(plant: MonitoredPlant) -> Dialect | None:
    """How the logs of a plant are written; None for plain ones."""
    return plant.dialect if isinstance(plant, StatesDialect) else None


class Widened(Protocol):
    """A log, in memory or not."""

    @property
    def widening(self) -> Array | None:
        """What its readings are less exact than the model's, (ny,)."""
        ...


def on_log(plant: MonitoredPlant, log: Widened) -> MonitoredPlant:
    """The plant whose bounds hold on a log: with the widening that reading the log cost."""
    return widened(plant, log.widening)


def widened(plant: MonitoredPlant, widening: Array | None) -> MonitoredPlant:
    """The plant with bounds of its sensors' noise that are wider by ``widening`` (ny,); None is nothing.

    Raises
    ------
    TypeError
        If there is something and the plant cannot take it.
    """
    if widening is None:
        return plant
    if not isinstance(plant, StatesDialect):
        raise TypeError(
            f"readings of the log are less exact than the model of {plant.name} says, by {widening.tolist()}, and "
            "the plant has no method widened(widening) that takes that; expected a described plant, or one with it"
        )
    return plant.widened(widening)
