"""The table [log]: how recorded logs are written, where they are not the plain ones that need none."""

from __future__ import annotations

import codecs
import json
import re
from contextlib import suppress
from datetime import date, datetime
from datetime import time as clock_time
from typing import Any
from zoneinfo import ZoneInfo

from svo.logs.dialect.numbers import HEXADECIMAL
from svo.logs.dialect.rules import Channel, Dialect, Long, Times, Valid, Which
from svo.logs.dialect.stamps import UNITS
from svo.logs.names import Columns
from svo.plant.description.table import Table, shown

_LOG = (
    "encoding", "separator", "decimal", "thousands", "exponent", "header", "first_row", "names", "skip", "missing",
    "sentinels", "valid", "time", "long", "columns", "duplicates", "order", "part",
    "times",
)  # fmt: skip
_TIME = ("column", "start", "step", "format", "unit", "scale", "epoch", "zone", "one_clock")
_CHANNEL = (
    "column", "tag", "file", "time", "scale", "offset", "unit", "number", "resolution", "missing", "sentinels", "valid",
    "held", "every", "rate",
)  # fmt: skip
ALL_KEYS = (*_LOG, *_TIME, *_CHANNEL)
_FINEST, _LONGEST = 1e-12, 1e15  # seconds: a picosecond, thirty million years
_NO_MARKS = tuple('"+-\r\n')
_NUMBERS_ONLY = ("unit", "scale", "epoch")
_GRID_ONLY = ("every", "rate")
_OUTPUTS_ONLY = {
    "resolution": "an input is taken as exact; widen w of [model] by what it is not",
    "held": 'an input stays what it was by missing = "hold"',
    "rate": "an input is never moved in time; state its times: time = { start = ..., step = ... }",
}


def dialect_of(top: Table, columns: Columns) -> Dialect | None:
    """What the table [log] states; None if it is not there."""
    if "log" not in top:
        return None
    table = top.table("log", _LOG)
    time = _times(table.table("time", _TIME))
    long = _long(table)
    dialect = Dialect(
        **_marks(table),
        encoding=_encoding(table),
        header=_line(table, "header"),
        first_row=_line(table, "first_row"),
        names=_texts(table, "names"),
        skip=_patterns(table),
        missing=_texts(table, "missing"),
        sentinels=_sentinels(table),
        valid=_valid(table),
        time=time,
        long=long,
        channels=_channels(table.table("columns"), columns, long),
        duplicates=table.text("duplicates", "error", ("error", "first", "last", "mean")),
        sort=table.text("order", "", ("sort",)) == "sort" if "order" in table else False,
        events="times" in table and table.text("times", choices=("events",)) == "events",
        part=_line(table, "part"),
        stated=json.dumps(table.content, default=str, ensure_ascii=False),
    )
    _check_rows(table, dialect)
    if dialect.events:
        _check_own_times(table.table("columns"))
    return dialect


def _check_own_times(channels: Table) -> None:
    """No channel states what is about a grid."""
    for name in channels.content:
        for key in _GRID_ONLY:
            if key in channels.table(name):
                raise channels.table(name).error(key, 'is about a grid; drop it, or times = "events" of [log]')


def _marks(table: Table) -> dict[str, str]:
    """How cells and numbers are told apart; no mark has two meanings."""
    found = {key: table.text(key, getattr(Dialect(), key)) for key in ("separator", "decimal", "thousands", "exponent")}
    for key, mark in found.items():
        if len(mark) != 1 and (key in table or mark):
            raise table.error(key, f"is {mark!r}; expected one character")
        if key == "exponent" and mark and not (mark.isascii() and mark.isalpha()):
            raise table.error(key, f"is {mark!r}; expected a letter such as D")
        if key != "exponent" and (mark.isalnum() or mark in _NO_MARKS):
            raise table.error(key, f"is {mark!r}; expected a mark that is no part of a name or number")
    if found["decimal"] not in (".", ","):
        raise table.error("decimal", f'is {found["decimal"]!r}; expected "." or ","')
    # A separator may be a mark of numbers too, where cells are quoted.
    if found["decimal"] == found["thousands"]:
        raise table.error("thousands", f"is {found['thousands']!r}, as decimal is; expected two marks that differ")
    return found


def _encoding(table: Table) -> str:
    name = table.text("encoding", "utf-8")
    try:
        codecs.lookup(name)
        "".encode(name)
    except (LookupError, ValueError):
        raise table.error(
            "encoding", f"is {name!r}; expected one such as utf-8, utf-16-le, cp1252 or latin-1"
        ) from None
    return name


def _line(table: Table, key: str) -> int | None:
    if key not in table:
        return None
    value = table.count(key)
    if value < 1:
        raise table.error(key, f"is {value}; expected a number from 1 on")
    return value


def _check_rows(table: Table, dialect: Dialect) -> None:
    if dialect.names and dialect.header is not None:
        raise table.error("names", "is given and so is header; drop header, or the names")
    if dialect.header is not None and dialect.first_row is not None and dialect.first_row <= dialect.header:
        raise table.error("first_row", f"is {dialect.first_row}; expected a line behind header, {dialect.header}")
    if dialect.part is not None and dialect.sort:
        raise table.error("order", "is given and so is part: rows in no order have no parts; drop one of both")


def _patterns(table: Table) -> tuple[str, ...]:
    for pattern in (found := _texts(table, "skip")):
        try:
            re.compile(pattern)
        except (re.error, OverflowError) as error:
            raise table.error("skip", f"has {pattern!r}, which is no regular expression ({error})") from None
    return found


def _texts(table: Table, key: str) -> tuple[str, ...]:
    value = table.content.get(key, [])
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise table.error(key, f'is {shown(value)}; expected a list of texts such as ["a", "b"]')
    return tuple(item.strip() if key == "missing" else item for item in value)


def _sentinels(table: Table) -> tuple[float, ...]:
    if "sentinels" not in table:
        return ()
    return tuple(table.array("sentinels").ravel().tolist())


def _which(table: Table, key: str) -> Which:
    if key not in table:
        raise table.error(key, "is missing; expected the name of a column, or its number from 1 on")
    value = table.content[key]
    if isinstance(value, bool) or not isinstance(value, str | int) or value == "":
        raise table.error(key, f"is {shown(value)}; expected the name of a column, or its number from 1 on")
    if isinstance(value, int) and value < 1:
        raise table.error(key, f"is {value}; expected the number of a column, from 1 on")
    return value


def _valid(table: Table) -> Valid | None:
    if "valid" not in table:
        return None
    inner = table.table("valid", ("column", "good"))
    good = inner.content.get("good", "missing")
    if not isinstance(good, list) or not good or not all(isinstance(item, str | int | float) for item in good):
        raise inner.error("good", f"is {shown(good)}; expected what the flag is where the reading counts, such as [1]")
    return Valid(_which(inner, "column"), tuple(str(item) for item in good))


def _long(table: Table) -> Long | None:
    if "long" not in table:
        return None
    inner = table.table("long", ("tag", "value"))
    return Long(_which(inner, "tag"), _which(inner, "value"))


def _times(table: Table) -> Times:
    columns = _time_columns(table)
    own = "step" in table
    if own == bool(columns) and (
        own or table.content.keys() - {"zone", "one_clock", "format", "unit", "scale", "epoch"}
    ):
        raise table.error(None, "expected either column, or start and step where no column holds the time")
    step = table.number("step") if own else None
    if step is not None and not _FINEST <= step < _LONGEST:
        raise table.error("step", f"is {step:g}; expected seconds from row to row, above 0")
    times = Times(
        columns=columns,
        start=_date_or_number(table, "start"),
        step=step,
        format=_format(table),
        unit=table.text("unit", choices=tuple(UNITS)) if "unit" in table else None,
        scale=_positive(table, "scale", 1.0),
        epoch=_epoch(table),
        zone=_zone(table),
        one_clock=table.truth("one_clock", False),
    )
    _check_used(table, times)
    return times


def _check_used(table: Table, times: Times) -> None:
    """No key is stated that the others leave without a meaning."""
    if times.step is None and times.start is not None:
        raise table.error("start", "is given and so is column, which says when each row is; drop one of both")
    for key in _NUMBERS_ONLY:
        if key in table and times.step is not None:
            raise table.error(key, "is given and so is step, which is in seconds; drop it")
        if key in table and times.format is not None:
            raise table.error("format", f"is given and so is {key}, which is for numbers; drop one of both")
    if times.format is not None and times.step is not None:
        raise table.error("format", "is for a column of times, and step is given instead of one; drop it")
    if times.zone is not None and (times.step is not None or times.format is not None) and not times.is_date:
        raise table.error("zone", "is for dates, and these times are none; drop it, or state the day too")


def _format(table: Table) -> str | None:
    if "format" not in table:
        return None
    form = table.text("format")
    if form in ("iso", "duration"):
        return form
    try:
        if "%" not in form:
            raise ValueError("without %")
        datetime.strptime("", form)
    except (ValueError, IndexError) as error:
        if "does not match" not in str(error):
            expected = 'expected "iso", "duration", or one such as "%d.%m.%Y %H:%M:%S.%f"'
            raise table.error("format", f"is {form!r} ({error}); {expected}") from None
    return form


def _time_columns(table: Table) -> tuple[Which, ...]:
    if "column" not in table:
        return ()
    value = table.content["column"]
    if not isinstance(value, list):
        return (_which(table, "column"),)
    if not value:
        raise table.error("column", 'is an empty list; expected columns such as ["Date", "Time"]')
    return tuple(_which(Table(table.path, table.name, {"column": item}), "column") for item in value)


def _date_or_number(table: Table, key: str) -> float | datetime | None:
    if key not in table:
        return None
    value = table.content[key]
    if isinstance(value, datetime):
        return value
    if isinstance(value, date):
        return datetime(value.year, value.month, value.day)
    if isinstance(value, str):
        with suppress(ValueError):
            return datetime.fromisoformat(value)
    if isinstance(value, str | clock_time):
        raise table.error(key, f"is {str(value)!r}; expected a date such as 2025-03-14T10:15:00")
    if not abs(number := table.number(key)) < _LONGEST:
        raise table.error(key, f"is {number:g}; expected seconds, or a date such as 2025-03-14T10:15:00")
    return number


def _epoch(table: Table) -> datetime | None:
    """The date that numbers count from."""
    epoch = _date_or_number(table, "epoch")
    if epoch is None:
        return None
    if not isinstance(epoch, datetime):
        raise table.error("epoch", f"is {epoch:g}; expected the date that the numbers count from, such as 1970-01-01")
    return epoch


def _zone(table: Table) -> str | None:
    if "zone" not in table:
        return None
    name = table.text("zone")
    try:
        ZoneInfo(name)
    except (ValueError, OSError, KeyError):
        raise table.error("zone", f"is {name!r}; expected a name such as Europe/Berlin or UTC") from None
    return name


def _positive(table: Table, key: str, default: float) -> float:
    value = table.number(key, default)
    if not 0 < value < float("inf"):
        raise table.error(key, f"is {value:g}; expected a number > 0")
    return value


def _channels(table: Table, columns: Columns, long: Long | None) -> dict[str, Channel]:
    names = [column.name for column in columns.inputs + columns.outputs]
    table.check_keys(names)
    inputs = {column.name for column in columns.inputs}
    return {name: _channel(table.table(name, _CHANNEL), name in inputs, long) for name in table.content}


def _channel(table: Table, is_input: bool, long: Long | None) -> Channel:
    for key, why in _OUTPUTS_ONLY.items():
        if is_input and key in table:
            raise table.error(key, f"is for outputs: {why}")
    if "column" in table and long is not None:
        raise table.error("column", "has no meaning in a long log, whose values are in one column; expected tag")
    if "tag" in table and long is None:
        raise table.error("tag", "needs the columns of tags and values: long = { tag = ..., value = ... } in [log]")
    missing, hold = _missing(table, is_input)
    scale, offset = table.number("scale", 1.0), table.number("offset", 0.0)
    if scale == 0 or not abs(scale) < float("inf") or not abs(offset) < float("inf"):
        raise table.error("scale", "and offset are numbers, and scale is not 0")
    return Channel(
        column=_which(table, "column") if "column" in table else None,
        tag=table.text("tag") if "tag" in table else None,
        file=str(table.file_beside("file", table.text("file"))) if "file" in table else None,
        time=_times(table.table("time", _TIME)) if "time" in table else None,
        scale=scale,
        offset=offset,
        unit=table.text("unit") if "unit" in table else None,
        number=table.text("number", choices=tuple(HEXADECIMAL)) if "number" in table else None,
        resolution=_positive(table, "resolution", 0.0) if "resolution" in table else 0.0,
        missing=missing,
        hold=hold,
        sentinels=_sentinels(table),
        valid=_valid(table),
        held=_positive(table, "held", 0.0) if "held" in table else None,
        every=_line(table, "every") or 1,
        rate=_positive(table, "rate", 0.0) if "rate" in table else None,
    )


def _missing(table: Table, is_input: bool) -> tuple[tuple[str, ...], bool]:
    """Texts that mean no reading, and whether an input is then that of before."""
    value: Any = table.content.get("missing", [])
    if value != "hold":
        return _texts(table, "missing"), False
    if not is_input:
        raise table.error("missing", 'is "hold", which is for inputs: a sensor that is missing has no reading')
    return (), True
