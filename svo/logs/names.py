"""The names of the channels of a log, and their units."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """One channel of a log file: its column name and the unit of the numbers in it."""

    name: str
    unit: str


@dataclass(frozen=True)
class Columns:
    """Column names of a log: time in seconds, then the channels in the model's order and units."""

    inputs: tuple[Column, ...]
    outputs: tuple[Column, ...]
    states: tuple[Column, ...] = ()
    time: str = "time_s"
