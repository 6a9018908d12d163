"""The names of the channels of a log, and their units."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

from polytopes.signatures import options_by_name


@dataclass(frozen=True)
class Column:
    """One channel of a log file: its column name and the unit of the numbers in it."""

    name: str
    unit: str


@options_by_name
@dataclass(frozen=True)
class Columns:
    """Column names of a log: time [s], then inputs, outputs and states in the model's order and units."""

    inputs: tuple[Column, ...]
    outputs: tuple[Column, ...]
    states: tuple[Column, ...] = ()
    _: KW_ONLY
    time: str = "time_s"
