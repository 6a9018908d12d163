"""A log of any dialect, read as its `[log]` table states it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from svo.checks import Array
from svo.logs.columns import TIME_TOLERANCE
from svo.logs.columns import noted as warn
from svo.logs.dialect.block import SUMMER
from svo.logs.dialect.channels import Channels, when
from svo.logs.dialect.clocks import check_counts, check_kinds, slow_note
from svo.logs.dialect.events import merged
from svo.logs.dialect.grid import Placed, check_unit, grid_of, most_samples, place_input, place_output
from svo.logs.dialect.rules import Dialect
from svo.logs.dialect.series import Series
from svo.logs.dialect.stamps import PICO, seconds
from svo.logs.dialect.values import in_model_units
from svo.logs.log import Log
from svo.logs.names import Column, Columns


@dataclass(frozen=True, eq=False)
class Reading:
    """A log with what was found out while it was read.

    Attributes
    ----------
    log : Log
        Its time begins at 0.
    start : str
        The first sample's own time, for people.
    notes : tuple of str
    """

    log: Log
    start: str
    notes: tuple[str, ...]


def read_dialect(path: str | Path, columns: Columns, Ts: float, dialect: Dialect) -> Reading:
    """Read a log as a dialect states it.

    Parameters
    ----------
    path : path
        A text file, a MAT or Parquet file, or a folder of them.
    columns : Columns
        Inputs and outputs of the model, with the units that they are read in.
    Ts : float
        Sampling time of the model [s].
    dialect : Dialect

    Raises
    ------
    ValueError
        Naming the file, the line and the column, and the key of `[log]` to state.
    OSError
        If a file cannot be opened.
    ImportError
        If pint, h5py or pyarrow is needed and not installed.
    """
    path = Path(path)
    channels = Channels(path, columns, dialect)
    series = {column.name: channels.series(column) for column in channels.all}
    _check_read(path, channels, series)
    if dialect.events:
        log, start = merged(path, columns, Ts, channels, series)
        widening = np.array([_rounding(channels, column) for column in columns.outputs])
    else:
        log, start, widening = _Placing(path, columns, Ts, channels, series).placed()
    if any(one.block.is_local for one in series.values()):
        channels.notes.append(
            "times are local ones without a zone, so only their differences are known (zone in [log.time])"
        )
    log = replace(log, source=path.name, widening=widening if widening.any() else None)
    return Reading(log, start, tuple(channels.notes))


def _check_read(path: Path, channels: Channels, series: Mapping[str, Series]) -> None:
    """Every input is there, and some channel."""
    for name, one in series.items():
        if channels.is_input(name) and not one.values.size:
            rows = "" if one.block.rows else " (there are no rows behind the names)"
            raise ValueError(f"{path}, {one.label}: no row has a reading of {name}{rows}; an input must be known")
    if not any(one.values.size for one in series.values()):
        raise ValueError(f"{path}: no row has a reading of {' or '.join(series)}")


def _rounding(channels: Channels, column: Column) -> float:
    """By what the bound of a sensor's noise grows for the resolution of its numbers."""
    rule = channels.rule(column.name)
    rounding = rule.resolution / 2 * abs(in_model_units(rule, column.unit)[0])
    if rounding:
        channels.notes.append(f"{column.name}: n grows by {rounding:.6g} {column.unit}, half of its resolution")
    return rounding


def noted(reading: Reading, path: str | Path) -> Log:
    """The log of a reading, with a `LogNote` for each of its notes."""
    for note in reading.notes:
        warn(f"{path}: {note}")
    return reading.log


class _Placing:
    """Sets series on one grid."""

    def __init__(
        self, path: Path, columns: Columns, Ts: float, channels: Channels, series: Mapping[str, Series]
    ) -> None:
        self._columns, self._Ts, self._channels, self._series = columns, Ts, channels, series
        self._notes = channels.notes
        self._anchor = next(one for one in series.values() if one.values.size)
        self._origin = self._anchor.stamp(0)

    def placed(self) -> tuple[Log, str, Array]:
        """The log, its first sample's own time for people, and its widening."""
        anchor = self._anchor
        every = self._channels.rule(anchor.name).every
        check_unit(anchor, self._Ts, self._channels.times(anchor.name), every)
        self._channels.check_clocks(self._series, self._Ts)
        check_counts(self._channels, self._series)
        self._notes += slow_note(self._series, self._Ts)
        grid = self._extended(grid_of(anchor, self._Ts))
        check_kinds(self._series)  # those that overlap although they cannot be compared
        placed = {name: self._place(one, grid) for name, one in self._series.items()}
        first, last = self._known(placed, grid)
        time = grid[first:last]
        u, y = (self._stacked(group, placed, first, last) for group in (self._columns.inputs, self._columns.outputs))
        widening = np.array([self._widening(column, placed[column.name]) for column in self._columns.outputs])
        self._notes += [note for column in self._channels.all for note in self._left_out(column, placed[column.name])]
        start = self._origin + round(time[0] * PICO)
        if anchor.block.is_date:  # no finer than a sample is told from another
            finest = max(round(TIME_TOLERANCE * self._Ts * PICO), 1)
            start = round(start / finest) * finest
        return Log(time - time[0], u, y), when(anchor, start), widening

    def _place(self, one: Series, grid: Array) -> Placed:
        place = place_input if self._channels.is_input(one.name) else place_output
        return place(one, self._channels.rule(one.name), grid, self._origin, self._Ts)

    def _extended(self, grid: Array) -> Array:
        """The grid, which goes on where inputs are held; readings beside it are counted."""
        ends = [seconds(one.stamp(-1) - self._origin) for one in self._series.values() if one.values.size]
        more = int(np.floor((max(ends) - grid[-1]) / self._Ts + TIME_TOLERANCE))
        if 0 < more <= most_samples(grid.size) and all(
            self._channels.rule(column.name).hold for column in self._columns.inputs
        ):
            grid = np.append(grid, grid[-1] + self._Ts * np.arange(1, more + 1))
        for name, one in self._series.items():
            time = one.time(self._origin)
            self._check_clock(one, time, grid)
            for edge, where in ((grid[0], "before the first"), (grid[-1], "after the last")):
                beside = time < edge - self._Ts / 2 if where.startswith("before") else time > edge + self._Ts / 2
                if beside.any():
                    self._check_inputs_beside(one, time, beside, edge)
                    self._notes.append(f"{beside.sum()} readings of {name} {where} of {self._anchor.name} are left out")
        return grid

    def _check_clock(self, one: Series, time: Array, grid: Array) -> None:
        """A channel all of whose readings are beside the grid has another clock."""
        if time.size and (time[-1] < grid[0] - self._Ts / 2 or time[0] > grid[-1] + self._Ts / 2):
            spans = [f"{when(it, it.stamp(0))} to {when(it, it.stamp(-1))}" for it in (one, self._anchor)]
            raise ValueError(
                f"{one.place(0)}: no reading of {one.name} ({spans[0]}) is within the time of {self._anchor.name} "
                f"({spans[1]}); state the times of one of them as the other's clock says"
            )

    def _check_inputs_beside(self, one: Series, time: Array, beside: np.ndarray, edge: float) -> None:
        """A row of a table with a reading on the grid has its inputs too."""
        if one.block is not self._anchor.block or not self._channels.is_input(self._anchor.name):
            return
        for i in np.flatnonzero(beside).tolist():
            steps = (time[i] - edge) / self._Ts
            if abs(steps - round(steps)) <= TIME_TOLERANCE:
                raise self._no_input(self._anchor, int(one.at[i]), time[i], 1)

    def _known(self, placed: Mapping[str, Placed], grid: Array) -> tuple[int, int]:
        """The samples from the first to the last at which all inputs are known; none may be missing between them."""
        first, last = 0, grid.size
        names = [column.name for column in self._columns.inputs]
        for name in names:
            known = np.flatnonzero(~np.isnan(placed[name].values))
            if not known.size:
                raise ValueError(f"{self._series[name].place(0)}: no reading of input {name} is on the grid")
            if self._series[name].block is not self._anchor.block:
                first, last = max(first, int(known[0])), min(last, int(known[-1]) + 1)
        if first >= last:
            raise ValueError(f"inputs {', '.join(names)} have no time in common")
        for name in names:
            lost = first + np.flatnonzero(np.isnan(placed[name].values[first:last]))
            if lost.size:
                time = float(grid[lost[0]])
                raise self._no_input(self._series[name], self._row_at(self._series[name], time), time, lost.size)
        if last - first < grid.size:
            self._notes.append(
                f"{grid.size - last + first} samples at the ends, where an input is not known, are left out"
            )
        return first, last

    def _row_at(self, one: Series, time: float) -> int | None:
        rows = np.array([seconds(stamp - self._origin) for stamp in one.block.time])
        row = int(np.argmin(np.abs(rows - time)))
        return row if abs(rows[row] - time) <= TIME_TOLERANCE * self._Ts else None

    def _no_input(self, one: Series, row: int | None, time: float, count: int) -> ValueError:
        where, what = one.block.source.source, "no row is there"
        if row is not None:
            where = f"{one.block.place(row)}, {one.label}"
            cell = one.block.source.column(self._channels.which(one.name))[one.block.rows[row]]
            flag = self._channels.flag(one.name, one.block, row)
            what = f"the cell is {str(cell)!r:.60}{flag}"
        more = f" (and at {count - 1} samples more)" if count > 1 else ""
        if one.block.is_local and any(abs(count * self._Ts - by) < 2 * self._Ts for by in SUMMER):
            what += "; does the clock go forward there? Then state zone in [log.time]"
        return ValueError(
            f"{where}: input {one.name} has no reading at {time:.9g} s{more}: {what}. An input must be known: state "
            f'missing = "hold" in [log.columns.{one.name}] if it stays what it was'
        )

    def _stacked(self, group: tuple[Column, ...], placed: Mapping[str, Placed], first: int, last: int) -> Array:
        columns = [placed[column.name].values[first:last] for column in group]
        return np.column_stack(columns) if columns else np.zeros((last - first, 0))

    def _widening(self, column: Column, placed: Placed) -> float:
        """By what the bound of a sensor's noise grows."""
        if placed.moved:
            rate = self._channels.rule(column.name).rate
            self._notes.append(
                f"{column.name}: readings are moved by up to {placed.moved:.6g} s to their samples; n grows by "
                f"{placed.price:.6g} {column.unit}, at {rate:g} {column.unit}/s"
            )
        return _rounding(self._channels, column) + placed.price

    def _left_out(self, column: Column, placed: Placed) -> Iterator[str]:
        if not placed.left_out:
            return
        if self._channels.is_input(column.name) or self._channels.rule(column.name).every > 1:
            yield f"{column.name}: {placed.left_out} readings between the samples are left out"
        else:
            yield (
                f"{column.name}: {placed.left_out} readings are off the grid by more than 1 % of {self._Ts:g} s and "
                f"left out; with a bound of its rate (rate in [log.columns.{column.name}]) they would be moved"
            )
