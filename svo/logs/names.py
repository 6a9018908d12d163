"""The names of the channels of a log, and their units."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

from polytopes.shown import Shown
from polytopes.signatures import options_by_name


@dataclass(frozen=True)
class Column(Shown):
    """One channel of a log file: its column name and the unit of the numbers in it."""

    name: str
    unit: str

    @property
    def label(self) -> str:
        """Name and unit for people; a unit that the name ends with is not said twice."""
        name = self.name.removesuffix("_" + self.unit.replace("/", "_")).replace("_", " ")
        return f"{name} [{self.unit}]" if self.unit else name

    @property
    def bounded(self) -> str:
        """Label of a state where it is bounds that are shown: a column of true states may say "true" in its name."""
        return Column(self.name.removeprefix("true_"), self.unit).label


@options_by_name
@dataclass(frozen=True)
class Columns(Shown):
    """Column names of a log: time [s], then inputs, outputs and states in the model's order and units."""

    inputs: tuple[Column, ...]
    outputs: tuple[Column, ...]
    states: tuple[Column, ...] = ()
    _: KW_ONLY
    time: str = "time_s"
