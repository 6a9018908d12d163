"""Stamps to exact times: whole picoseconds, whatever they are counted in or written as."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from decimal import Decimal
from functools import lru_cache
from typing import TypeVar

from svo.logs.dialect.dates import suggested
from svo.logs.dialect.numbers import Marks
from svo.logs.dialect.rules import Times
from svo.logs.dialect.zones import to_utc

Where = Callable[[int], str]
Read = TypeVar("Read")

PICO = 10**12
UNITS = {
    "ns": PICO // 10**9, "100ns": PICO // 10**7, "us": PICO // 10**6, "ms": PICO // 1000, "s": PICO, "min": 60 * PICO,
    "h": 3600 * PICO, "day": 86400 * PICO,
}  # fmt: skip
"""Units of stamps in picoseconds."""

_LONGEST = PICO * 10**18
_EPOCH = datetime(1970, 1, 1)
_NO_DAY = datetime(1900, 1, 1)  # that strptime takes where a format has none
_FRACTION = re.compile(r"(?<=\d)[.,](\d+)(?=\s*(?:[A-Za-z+-].*)?$)")
_CLOCK = re.compile(
    r"(?P<sign>[+-])?(?:(?P<days>\d+)(?: days?,? |\.|d ?))?"
    r"(?:(?P<h>\d+):(?P<m>[0-5]?\d)|(?P<minutes>\d{1,2})):(?P<s>[0-5]?\d(?:[.,]\d+)?)(?P<ms>(?<=:\d\d):\d{3})?"
)
_NAMED = {
    "ns": "ns", "us": "us", "µs": "us", "μs": "us", "ms": "ms", "msec": "ms", "s": "s", "sec": "s", "secs": "s",
    "second": "s", "seconds": "s", "min": "min", "mins": "min", "minute": "min", "minutes": "min", "h": "h", "hr": "h",
    "hrs": "h", "hour": "h", "hours": "h", "d": "day", "day": "day", "days": "day",
}  # fmt: skip
_AMOUNT = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµμ]+)\s*")
_ISO = re.compile(r"P(?:(\d+)D)?(?:T(?:(\d+)H)?(?:(\d+)M)?(?:(\d+(?:[.,]\d+)?)S)?)?")


@dataclass(frozen=True)
class Stamps:
    """Times of rows.

    Attributes
    ----------
    picoseconds : list of int
        Since 1970 (UTC) for dates, since whatever the log counts from otherwise.
    is_date : bool
    is_local : bool
        Dates without a zone: only their differences are known.
    notes : tuple of str
    """

    picoseconds: list[int]
    is_date: bool = False
    is_local: bool = False
    notes: tuple[str, ...] = ()


def stamps_of(cells: Sequence[str], where: Where, rule: Times, marks: Marks, *, in_order: bool = True) -> Stamps:
    """The times in cells; ``where`` says where one stands, and ``in_order`` whether rows are in order of time.

    Raises
    ------
    ValueError
        For a cell that is none by the rule, with the key to state.
    """
    if rule.format is None:
        numbers = [_counted(cell, where, i, rule, marks) for i, cell in enumerate(cells)]
        return counted(numbers, where, rule, in_order=in_order)
    if rule.format == "duration":
        expected = "a duration such as 0:01:02.5 or 0.1 sec"
        return Stamps([_read(cell, where, i, _duration, expected) for i, cell in enumerate(cells)])
    iso = rule.format == "iso"
    read, expected = (_iso, "an ISO 8601 date") if iso else (_by_format(rule.format), repr(rule.format))
    dates = [_read(cell, where, i, read, expected) for i, cell in enumerate(cells)]
    if not rule.is_date:  # a clock without a day counts from midnight
        return Stamps([_since(_NO_DAY, date.replace(tzinfo=None), rest) for date, rest in dates])
    return _dated(dates, where, rule.zone, in_order)


def stamps_of_rows(count: int, where: Where, rule: Times) -> Stamps:
    """Times of rows from the stated start and step."""
    step = Decimal(repr(rule.step)) * PICO
    if isinstance(rule.start, datetime):
        first = _dated([(rule.start, 0)], where, rule.zone, True)
    else:
        first = Stamps([round(Decimal(repr(rule.start or 0.0)) * PICO)])
    return replace(first, picoseconds=[first.picoseconds[0] + round(k * step) for k in range(count)])


def counted(picoseconds: list[int], where: Where, rule: Times, *, in_order: bool = True) -> Stamps:
    """Times that count from an epoch, or from something unknown."""
    if rule.epoch is None:
        if rule.zone is not None and picoseconds:
            raise ValueError(f"{where(0)}: a number, and zone is for dates; state epoch in [log.time], or drop zone")
        return Stamps(picoseconds)
    epoch = rule.epoch if rule.epoch.tzinfo is None else rule.epoch.astimezone(UTC).replace(tzinfo=None)
    first = _since(_EPOCH, epoch, 0)
    found = [first + stamp for stamp in picoseconds]
    if rule.zone is None:
        return Stamps(found, is_date=True)
    # Whole microseconds are a date; what is left of a stamp is carried along.
    return _dated([_date(stamp, where, i) for i, stamp in enumerate(found)], where, rule.zone, in_order)


def _date(stamp: int, where: Where, i: int) -> tuple[datetime, int]:
    try:
        return _EPOCH + timedelta(microseconds=stamp // 10**6), stamp % 10**6
    except OverflowError:
        raise ValueError(f"{where(i)}: {stamp / PICO:.6g} s after 1970 is no date; another unit or scale?") from None


def seconds(picoseconds: int) -> float:
    return picoseconds / PICO


def moment(picoseconds: int) -> str:
    """A date for people, with no more digits than it has."""
    whole, rest = divmod(picoseconds, PICO)
    digits = f".{rest:012d}".rstrip("0").rstrip(".")
    return f"{_EPOCH + timedelta(seconds=whole):%Y-%m-%d %H:%M:%S}{digits}"


def _counted(cell: str, where: Where, i: int, rule: Times, marks: Marks) -> int:
    plain = marks.plain(cell)
    if plain is None:
        raise ValueError(f"{where(i)}: {_named(cell)} is no number{_how(cell)}")
    time = Decimal(plain) * Decimal(repr(rule.scale)) * UNITS[rule.unit or "s"]
    if abs(time) > _LONGEST:
        raise ValueError(f"{where(i)}: {cell!r:.60} is no time of a log; another unit or scale?")
    return round(time)


def _how(cell: str) -> str:
    found = suggested(cell)
    if not found:
        return "; expected the time of the row: state skip in [log] if the line is none"
    if len(found) > 1:
        return f"; it may be {' or '.join(f'{day:%d %B %Y}' for _, day in found)}: state format = " + " or ".join(
            f'"{text}"' for text, _ in found
        )
    return f'; state format = "{found[0][0]}" in [log.time]'


def _named(cell: str) -> str:
    return f"{cell!r:.60}" if cell else "the empty cell"


def _read(cell: str, where: Where, i: int, read: Callable[[str], Read], expected: str) -> Read:
    try:
        return read(cell)
    except (ValueError, OverflowError):
        hint = "" if cell else "; state skip in [log] if the line is no row"
        if Marks().plain(cell):
            hint = "; a number? state unit instead of format"
        found = [text for text, _ in suggested(cell)]
        if found and expected not in (repr(text) for text in found):
            hint = "; it fits " + " or ".join(f'format = "{text}"' for text in found)
        raise ValueError(
            f"{where(i)}: {_named(cell)} is not {expected}, as format of [log.time] states{hint}"
        ) from None


def _by_format(form: str) -> Callable[[str], tuple[datetime, int]]:
    whole = re.sub(r"[.,:]?%f", "", form)

    ends_in_fraction = re.search(r"[.,]%f(\s*%[pzZ])?$", form) is not None
    whole_seconds = lru_cache(4096)(lambda text: datetime.strptime(text, whole))  # many stamps share theirs

    def read(text: str) -> tuple[datetime, int]:
        found = _FRACTION.search(text) if ends_in_fraction else None
        if found is not None:
            with suppress(ValueError):
                digits = int(found[1][:12].ljust(12, "0"))
                date = whole_seconds(text[: found.start()] + text[found.end(1) :])
                return date.replace(microsecond=digits // 10**6), digits % 10**6
        text, rest = _microseconds(text) if "%f" in form else (text, 0)
        try:
            return datetime.strptime(text, form), rest
        except ValueError:
            return datetime.strptime(text, whole), 0  # whole seconds may stand without their fraction

    return read


def _microseconds(text: str) -> tuple[str, int]:
    """A text with at most six digits behind the last mark, and the picoseconds that were cut off."""
    found = _FRACTION.search(text)
    if found is None or len(found[1]) <= 6:
        return text, 0
    digits = found[1].ljust(12, "0")
    return f"{text[: found.start(1)]}{digits[:6]}{text[found.end(1) :]}", int(digits[6:12])


def _iso(text: str) -> tuple[datetime, int]:
    found = re.search(r"(?<=:\d\d)[.,](\d+)", text)
    fraction = int(found[1].ljust(12, "0")[:12]) if found else 0
    if found:
        text = text[: found.start()] + text[found.end() :]
    return datetime.fromisoformat(text), fraction


def _dated(parsed: Sequence[tuple[datetime, int]], where: Where, zone: str | None, in_order: bool) -> Stamps:
    local = [date.tzinfo is None for date, _ in parsed]
    if any(local) and not all(local):
        k = local.index(not local[0])
        raise ValueError(f"{where(k)}: some dates say their zone and some do not; expected one of both in all rows")
    dates, rests, notes = [date for date, _ in parsed], [rest for _, rest in parsed], list[str]()
    if not any(local):
        dates = [date.astimezone(UTC).replace(tzinfo=None) for date in dates]
    elif zone is not None:
        dates, notes = to_utc(dates, rests, where, zone, in_order)
    found = [_since(_EPOCH, date, rest) for date, rest in zip(dates, rests, strict=True)]
    return Stamps(found, True, any(local) and zone is None, tuple(notes))


def _since(begin: datetime, date: datetime, rest: int) -> int:
    since = date - begin
    return ((since.days * 86400 + since.seconds) * 10**6 + since.microseconds) * 10**6 + rest


def is_duration(text: str) -> bool:
    """Whether a text is read by the format "duration"."""
    try:
        _duration(text)
    except ValueError:
        return False
    return True


def _duration(text: str) -> int:
    if found := _CLOCK.fullmatch(text):
        if found["ms"] and not found["h"]:
            raise ValueError(text)  # of three parts the last may be seconds
        parts = (
            (found["days"], 86400), (found["h"], 3600), (found["m"] or found["minutes"], 60), (found["s"], 1),
            ((found["ms"] or "")[1:], Decimal("0.001")),
        )  # fmt: skip
        total = sum((_decimal(part) * factor for part, factor in parts if part), Decimal(0))
        return round((-total if found["sign"] == "-" else total) * PICO)
    if text.startswith("P") and (found := _ISO.fullmatch(text)) and any(found.groups()):
        amounts = zip(found.groups(), (86400, 3600, 60, 1), strict=True)
        return round(sum((_decimal(part) * factor for part, factor in amounts if part), Decimal(0)) * PICO)
    amounts_found = _AMOUNT.findall(text)
    if (
        not amounts_found
        or "".join(_AMOUNT.split(text)[::3]).strip()
        or any(unit.lower() not in _NAMED for _, unit in amounts_found)
    ):
        raise ValueError(text)
    return round(sum((_decimal(amount) * UNITS[_NAMED[unit.lower()]] for amount, unit in amounts_found), Decimal(0)))


def _decimal(text: str) -> Decimal:
    return Decimal(text.replace(",", "."))
