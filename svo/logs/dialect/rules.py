"""What a `[log]` table states: every rule by which a log is read, and nothing that is guessed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime

_DAY = re.compile("%[dmbBjxcyYG]")

Which = str | int
"""A column by its name, or by its number from 1 on."""


@dataclass(frozen=True)
class Valid:
    """A flag beside the readings: only rows where ``column`` holds one of ``good`` have a reading."""

    column: Which
    good: tuple[str, ...]


@dataclass(frozen=True)
class Long:
    """One row a reading: the columns of the tags and of the values."""

    tag: Which
    value: Which


@dataclass(frozen=True)
class Times:
    """Where stamps stand and what they mean.

    Attributes
    ----------
    columns : tuple of str or int
        Joined by a blank; empty where the log has none and `start` and `step` say it.
    start : float or datetime, optional
        Time of the first row [s], or its date.
    step : float, optional
        Seconds from row to row.
    format : str, optional
        Of `datetime.strptime`, "iso" or "duration"; None for numbers.
    unit : str
        Of numbers: a key of `svo.logs.dialect.stamps.UNITS`.
    scale : float
        Numbers are multiplied by it first.
    epoch : datetime, optional
        The date that numbers count from; without it they count from something unknown.
    zone : str, optional
        IANA name of the zone of local stamps.
    one_clock : bool
        Files whose stamps begin at different times share one clock.
    """

    columns: tuple[Which, ...] = ()
    start: float | datetime | None = None
    step: float | None = None
    format: str | None = None
    unit: str | None = None
    scale: float = 1.0
    epoch: datetime | None = None
    zone: str | None = None
    one_clock: bool = False

    @property
    def is_date(self) -> bool:
        """Whether stamps say the day, so that a zone has a meaning."""
        if self.step is not None:
            return isinstance(self.start, datetime)
        if self.format is None:
            return self.epoch is not None
        return self.format == "iso" or _DAY.search(self.format) is not None


@dataclass(frozen=True)
class Channel:
    """How one input or output is read.

    Attributes
    ----------
    column : str or int, optional
        A name, a number from 1 on, or a place in a MAT file; by default the channel's own name.
    tag : str, optional
        In a long log: what its rows say in the column of tags.
    file : str, optional
        In a folder: the file that holds it.
    time : Times, optional
        Where it is not that of the log.
    scale, offset : float
        A reading is scale * number + offset, in `unit`.
    unit : str, optional
        Of that; None is the unit of the model.
    number : str, optional
        "hex" (no sign) or "hex8" to "hex64" (two's complement of so many bits).
    resolution : float
        Step of the numbers written: half of it is added to the bound of the noise.
    missing : tuple of str
        Texts that mean that there is no reading, beside those of the log.
    hold : bool
        A missing input is that of before.
    sentinels : tuple of float
    valid : Valid, optional
    held : float, optional
        Period [s] of a sensor whose reading is written again until the next.
    every : int
        One of so many readings is on the grid; those between are left out.
    rate : float, optional
        Bound of the rate of the reading [model's unit / s]: with it, readings off the grid are moved at its price.
    """

    column: Which | None = None
    tag: str | None = None
    file: str | None = None
    time: Times | None = None
    scale: float = 1.0
    offset: float = 0.0
    unit: str | None = None
    number: str | None = None
    resolution: float = 0.0
    missing: tuple[str, ...] = ()
    hold: bool = False
    sentinels: tuple[float, ...] = ()
    valid: Valid | None = None
    held: float | None = None
    every: int = 1
    rate: float | None = None


@dataclass(frozen=True)
class Dialect:
    """A `[log]` table.

    Attributes
    ----------
    encoding, separator, decimal, thousands, exponent : str
        Of text; a byte order mark wins over ``encoding``. The separator " " is any blanks.
    header, first_row : int, optional
        Lines, from 1 on, of the names and of the first row of data.
    names : tuple of str
        Where the file has no line of names.
    skip : tuple of str
        Regular expressions: lines that have one of them in them are none of the log.
    missing : tuple of str
    sentinels : tuple of float
    valid : Valid, optional
    time : Times
    long : Long, optional
    channels : mapping of str to Channel
        By the names of inputs and outputs; those that are not there are read as they are.
    duplicates : {"error", "first", "last", "mean"}
        What counts where readings of one time differ.
    sort : bool
        Rows may stand in any order.
    events : bool
        Channels keep their own times, instead of those of one grid.
    part : int, optional
        Which recording, from 1 on, of a log whose clock was started again.
    stated : str
        The table as it stands, for what is to be kept beside the numbers.
    """

    encoding: str = "utf-8"
    separator: str = ","
    decimal: str = "."
    thousands: str = ""
    exponent: str = ""
    header: int | None = None
    first_row: int | None = None
    names: tuple[str, ...] = ()
    skip: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    sentinels: tuple[float, ...] = ()
    valid: Valid | None = None
    time: Times = field(default_factory=Times)
    long: Long | None = None
    channels: Mapping[str, Channel] = field(default_factory=dict)
    duplicates: str = "error"
    sort: bool = False
    events: bool = False
    part: int | None = None
    stated: str = ""

    @property
    def counts_rows(self) -> bool:
        """Whether the place of a row is its time, so that a row of empty cells is a sample too."""
        times = (self.time, *(channel.time for channel in self.channels.values()))
        return any(time is not None and time.step is not None for time in times)

    def channel(self, name: str) -> Channel:
        """How the input or output of that name is read."""
        return self.channels.get(name, Channel())
