"""Loggers that say in their first lines who wrote the file: what is known of their dialects, for proposals."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from svo.logs.dialect.numbers import Marks

_DATE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?")


@dataclass(frozen=True)
class Signature:
    """A logger's dialect.

    Attributes
    ----------
    called : str
    separator : str or None
    keys : mapping of str to str
        Lines of `[log]`, by key, as TOML values.
    time : str or None
        The value of `time`.
    header, first_row : int or None
    units : mapping of int to str
        Of columns, by position.
    """

    called: str
    separator: str | None = None
    keys: dict[str, str] = field(default_factory=dict)
    time: str | None = None
    header: int | None = None
    first_row: int | None = None
    units: dict[int, str] = field(default_factory=dict)


def signature_of(lines: Sequence[str]) -> Signature | None:
    """The logger whose signature is in the first lines."""
    first = lines[0]
    if first.startswith("LabVIEW Measurement"):
        return _labview(lines)
    if first.startswith(('"TOA5"', "TOA5")):
        units = {i: cell.strip('" ') for i, cell in enumerate(lines[2].split(","))} if len(lines) > 2 else {}
        time = '{ column = "TIMESTAMP", format = "iso" }'
        return Signature("TOA5", ",", {}, time, 2, 5, units)
    if first.startswith(("#group", "#datatype", "#default")):
        keys = {"skip": '["^#"]', "long": '{ tag = "_field", value = "_value" }'}
        return Signature("annotated CSV", ",", keys, '{ column = "_time", format = "iso" }')
    return None


def _labview(lines: Sequence[str]) -> Signature:
    said: dict[str, list[str]] = {}
    ends = [i for i, line in enumerate(lines) if line.startswith("***End_of_Header***")]
    separator = "," if any(line.replace(",", "\t").startswith("Separator\tComma") for line in lines[:12]) else "\t"
    for line in lines[: (ends or [0])[-1]]:
        key, *values = line.split(separator)
        said[key] = [value.strip() for value in values]  # what the last header says

    def first(key: str) -> str:
        return next(iter(said.get(key, [])), "")

    decimal = first("Decimal_Separator") or "."
    step, time = Marks(decimal).plain(first("Delta_X")), None
    if first("X_Columns") == "No" and step is not None:
        start = f"{first('Date').replace('/', '-')}T{first('Time')}".replace(",", ".")[:26]
        time = f"{{ start = {start if _DATE.fullmatch(start) else 0}, step = {float(step):.12g} }}"
    units = {i + 1: unit for i, unit in enumerate(said.get("Y_Unit_Label", [])) if unit}
    keys = {"decimal": '","'} if decimal == "," else {}
    return Signature("LabVIEW measurement file", separator, keys, time, ends[-1] + 2 if ends else None, None, units)
