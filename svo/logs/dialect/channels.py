"""The series of every channel, out of the file or the folder that a log is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from svo.logs.columns import TIME_TOLERANCE
from svo.logs.dialect.block import Block, block_of, ordered
from svo.logs.dialect.files import open_source
from svo.logs.dialect.held import without_repeats
from svo.logs.dialect.notes import notes_of, unit_notes
from svo.logs.dialect.numbers import marks_of
from svo.logs.dialect.rules import Channel, Dialect, Times, Which
from svo.logs.dialect.series import Series, series_of
from svo.logs.dialect.source import Source
from svo.logs.dialect.stamps import moment, seconds
from svo.logs.dialect.values import good_rows, in_model_units, values_of
from svo.logs.names import Column, Columns


class _Key(NamedTuple):
    """What the stamps of a channel depend on."""

    file: str | None
    tag: str | None
    time: Times
    size: int


class Channels:
    """Reads the channels of a log; those that share their stamps share a block of rows.

    Parameters
    ----------
    path : path
    columns : Columns
    dialect : Dialect

    Attributes
    ----------
    notes : list of str
        What a reader of the log should know of, so far.
    """

    def __init__(self, path: Path, columns: Columns, dialect: Dialect) -> None:
        self._path, self._columns, self._dialect = path, columns, dialect
        self._blocks: dict[_Key, Block] = {}
        self.notes: list[str] = []
        self._check_columns()

    @property
    def all(self) -> tuple[Column, ...]:
        """Inputs first: the grid is theirs."""
        return (*self._columns.inputs, *self._columns.outputs)

    def is_input(self, name: str) -> bool:
        return name in [column.name for column in self._columns.inputs]

    def rule(self, name: str) -> Channel:
        return self._dialect.channel(name)

    def times(self, name: str) -> Times:
        """Where the stamps of a channel stand."""
        time = self.rule(name).time or self._dialect.time
        return time if time.columns or time.step is not None else replace(time, columns=(self._columns.time,))

    def which(self, name: str) -> Which:
        """The column that a channel is in."""
        if self._dialect.long is not None:
            return self._dialect.long.value
        column = self.rule(name).column
        return name if column is None else column

    def flag(self, name: str, block: Block, row: int) -> str:
        """What is said of a flag beside a reading, if the channel has one."""
        valid = self.rule(name).valid or self._dialect.valid
        if valid is None:
            return ""
        return (
            f", and {block.source.label(valid.column)} is {str(block.source.column(valid.column)[block.rows[row]])!r}"
        )

    def series(self, column: Column) -> Series:
        """The readings of a channel.

        Raises
        ------
        ValueError
            Naming the file, the line and the column, and the key of `[log]` to state.
        """
        rule, which = self.rule(column.name), self.which(column.name)
        block = self._block(self._key(column.name))
        try:
            in_model_units(rule, column.unit)
        except ValueError as error:
            raise ValueError(f"{self._path}, unit in [log.columns.{column.name}]: {error}") from error
        values = values_of(block, which, self._dialect, rule, column.unit)
        self._check_flag(column.name, block)
        series = series_of(column.name, block.source.label(which), block, values, self._dialect.duplicates)
        if series.repeats:
            counts = self._dialect.duplicates
            kept = "repeat" if counts == "error" else f"share their times with others, of which {counts} counts"
            self.notes.append(f"{series.repeats} readings of {column.name} {kept} and are dropped")
        if not series.values.size:
            self.notes += [f"{column.name} has no reading at all"] * (not self.is_input(column.name))
            return series
        self.notes += (unit_notes if self.is_input(column.name) else notes_of)(series, rule, column.unit)
        return series if rule.held is None else without_repeats(series, rule.held)

    def _check_flag(self, name: str, block: Block) -> None:
        """Note a flag that never is what is stated to be good; of an input it is an error."""
        valid = self.rule(name).valid or self._dialect.valid
        if valid is None or not block.rows or good_rows(block, valid).any():
            return
        flags = block.source.column(valid.column)
        there = ", ".join(repr(flag) for flag in sorted({str(flags[row]) for row in block.rows})[:10])
        found = (
            f"{name}: {block.source.label(valid.column)} never is {' or '.join(valid.good)}, so no reading counts; it "
            f"is {there}"
        )
        if self.is_input(name):
            raise ValueError(f"{block.source.source}, {found}. An input must be known: state its own valid, or others")
        self.notes.append(found)

    def check_clocks(self, series: Mapping[str, Series], Ts: float) -> None:
        """Raise a ValueError if files begin at times that differ by more than a step: they may be of other clocks."""
        if self._dialect.time.one_clock:
            return
        first: dict[str | None, Series] = {}
        for name, one in series.items():
            if self.rule(name).time is None and one.values.size:
                first.setdefault(self.rule(name).file, one)
        for one in list(first.values())[1:]:
            other = next(iter(first.values()))
            apart = abs(seconds(one.stamp(0) - other.stamp(0)))
            steps = np.diff(one.time(one.stamp(0)))
            if apart > max(Ts, float(np.median(steps)) if steps.size else 0.0) * (1 + TIME_TOLERANCE):
                raise ValueError(
                    f"{self._path}: {other.name} begins at {when(other, other.stamp(0))} and {one.name} at "
                    f"{when(one, one.stamp(0))}, {apart:.9g} s apart. If both files have one clock, state one_clock = "
                    f"true in [log.time]; else state the times of one of them, [log.columns.{one.name}] time = ..."
                )

    # -- inside ----------------------------------------------------------------------------------

    @cached_property
    def _sources(self) -> Mapping[str | None, Source]:
        if self._path.is_dir():
            self._check_files()
        found = {}
        for name in dict.fromkeys(self.rule(column.name).file for column in self.all):
            if name is not None and not self._path.is_dir():
                raise ValueError(f"{self._path} is no folder, and [log] states file = {name!r} of it")
            found[name] = open_source(self._path if name is None else self._path / name, self._dialect)
            self.notes += [note if name is None else f"{name}: {note}" for note in found[name].notes]
        return found

    def _check_files(self) -> None:
        lost = [column.name for column in self.all if self.rule(column.name).file is None]
        if lost:
            held = ", ".join(sorted(item.name for item in self._path.iterdir())[:20])
            raise ValueError(
                f"{self._path} is a folder; state which file holds {', '.join(lost)}: file = ... in "
                f"[log.columns.{lost[0]}] (there are {held or 'none'})"
            )

    def _check_columns(self) -> None:
        """Two channels are not one column."""
        seen: dict[tuple[str | None, Which, str | None], str] = {}
        for name in (column.name for column in self.all):
            which = self.which(name)
            other = seen.setdefault((self.rule(name).file, which, self._tag(name)), name)
            if other != name:
                raise ValueError(
                    f"{self._path}: {which!r} is asked for by {other} and by {name}; if its rows hold tag and value, "
                    "state long = { tag = ..., value = ... } in [log]"
                )

    def _tag(self, name: str) -> str | None:
        return None if self._dialect.long is None else self.rule(name).tag or name

    def _key(self, name: str) -> _Key:
        file = self.rule(name).file
        return _Key(file, self._tag(name), self.times(name), self._sources[file].size(self.which(name)))

    def _block(self, key: _Key) -> Block:
        if key not in self._blocks:
            source, rows = self._sources[key.file], list(range(key.size))
            if key.tag is not None:
                rows = self._tagged(source, key.tag)
            used = [self.which(column.name) for column in self.all if self._key(column.name) == key]
            in_order = not self._dialect.sort
            block = block_of(source, rows, key.time, marks_of(self._dialect), used, in_order=in_order)
            self.notes += [note for note in block.notes if note not in self.notes]
            self._blocks[key] = ordered(block, part=self._dialect.part, sort=self._dialect.sort)
        return self._blocks[key]

    def _tagged(self, source: Source, tag: str) -> list[int]:
        """The rows of a tag."""
        assert self._dialect.long is not None
        where = self._dialect.long.tag
        tags = [str(text).strip() for text in source.column(where)]
        rows = [row for row, text in enumerate(tags) if text == tag]
        if not rows:
            there = ", ".join(sorted(set(filter(None, tags)))[:20]) or "none"
            raise ValueError(f"{source.source}, {source.label(where)}: no row has the tag {tag!r}; there are {there}")
        return rows


def when(one: Series, stamp: int) -> str:
    """A stamp of a channel, for people."""
    if not one.block.is_date:
        return f"{seconds(stamp):.12g} s"
    return f"{moment(stamp)} {'local time' if one.block.is_local else 'UTC'}"
