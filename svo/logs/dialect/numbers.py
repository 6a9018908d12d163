"""Cells to numbers, by stated rules only."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from svo.checks import Array
from svo.logs.dialect.rules import Channel, Dialect

HEXADECIMAL = {"hex": 0, "hex8": 8, "hex16": 16, "hex32": 32, "hex64": 64}
"""Names of `number` and the bits of their two's complement; 0 is without a sign."""

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_HEX = re.compile(r"(?:0[xX])?([0-9a-fA-F]+)[hH]?", re.ASCII)
_BLANKS = str.maketrans("", "", " \u00a0\u202f\u2009")


@dataclass(frozen=True)
class Marks:
    """How numbers are written.

    Attributes
    ----------
    decimal, thousands, exponent : str
        "" of the last two: there is none, and only e.
    """

    decimal: str = "."
    thousands: str = ""
    exponent: str = ""

    def plain(self, text: str) -> str | None:
        """A number as Python writes it; None for what is no number."""
        if self.thousands:
            whole, mark, rest = text.partition(self.decimal)
            if not self._grouped.fullmatch(whole):
                return None
            text = (
                (whole.translate(_BLANKS) if self.thousands == " " else whole.replace(self.thousands, "")) + mark + rest
            )
        if self.decimal != ".":
            if "." in text:
                return None
            text = text.replace(self.decimal, ".", 1)
        if self.exponent:
            text = text.replace(self.exponent, "e").replace(self.exponent.lower(), "e")
        text = text.replace("\u2212", "-")
        return text if _NUMBER.fullmatch(text) else None

    @property
    def _grouped(self) -> re.Pattern[str]:
        mark = "[ \u00a0\u202f\u2009]" if self.thousands == " " else re.escape(self.thousands)
        return re.compile(rf"[+\-\u2212]?(?:\d{{1,3}}(?:{mark}\d{{3}})+|\d*)")


def marks_of(dialect: Dialect) -> Marks:
    return Marks(dialect.decimal, dialect.thousands, dialect.exponent)


def numbers_of(cells: Sequence[str], where: Callable[[int], str], dialect: Dialect, channel: Channel) -> Array:
    """The numbers in cells, NaN where there is no reading; ``where`` says where a cell stands.

    Raises
    ------
    ValueError
        For text in a number's place that is not stated to be missing.
    """
    missing = {"", *dialect.missing, *channel.missing}
    number = _reader(dialect, channel)
    sentinels = {*_sentinels(dialect, channel), *map(number, missing)}  # -999 is missing however it is written
    values = np.full(len(cells), np.nan)
    for i, cell in enumerate(cells):
        if cell in missing:
            continue
        value = number(cell)
        if value is None:
            if cell.lower() != "nan":
                raise ValueError(f"{where(i)}: {cell!r:.80} is no number{_hint(cell, marks_of(dialect))}")
        elif value not in sentinels:
            values[i] = value
    return values


def _sentinels(dialect: Dialect, channel: Channel) -> set[float]:
    """Numbers that mean no reading; in two's complement 0x8000 of 16 bits is -32768."""
    stated = {*dialect.sentinels, *channel.sentinels}
    bits = HEXADECIMAL.get(channel.number or "hex")
    return stated | {value - 2.0**bits for value in stated if value >= 2.0 ** (bits - 1)} if bits else stated


def _reader(dialect: Dialect, channel: Channel) -> Callable[[str], float | None]:
    if channel.number is not None:
        bits = HEXADECIMAL[channel.number]
        return lambda cell: _hexadecimal(cell, bits)
    marks, unit = marks_of(dialect), channel.unit or ""

    def read(cell: str) -> float | None:
        plain = marks.plain(cell.removesuffix(unit).rstrip() if unit else cell)
        if plain is None:
            return None
        value = float(plain)
        return value if np.isfinite(value) else None

    return read


def _hexadecimal(cell: str, bits: int) -> float | None:
    found = _HEX.fullmatch(cell)
    if found is None:
        return None
    value = int(found[1], 16)
    if bits and value >= 1 << bits:
        return None
    return float(value - (1 << bits) if bits and value >= 1 << (bits - 1) else value)


def _hint(cell: str, marks: Marks) -> str:
    """What is probably the matter, and the key that says so."""
    if marks.plain(cell):
        return ", since it is beyond all floats; list it in missing of [log] if it means that there is no reading"
    if all(mark in cell for mark in ",.") and not marks.thousands:
        last = max(",.", key=cell.rindex)
        other = "," if last == "." else "."
        if Marks(last, other).plain(cell):
            return f'; both marks occur: state decimal = "{last}" and thousands = "{other}" in [log]'
    for mark, name in ((",", "comma"), (".", "point")):
        if mark in cell and mark not in (marks.decimal, marks.thousands) and Marks(mark).plain(cell):
            return f'; a decimal {name}? state decimal = "{mark}" in [log]'
    if re.fullmatch(r"[+-]?[\d.,]+[dDqQ][+-]?\d+", cell):
        return f'; an exponent? state exponent = "{re.sub("[^dDqQ]", "", cell)}" in [log]'
    if re.fullmatch(r"0[xX][0-9a-fA-F]+|(?=.*\d)[0-9a-fA-F]{2,}[hH]?", cell):
        return '; hexadecimal? state number = "hex16" (two\'s complement of 16 bits), or "hex" where there is no sign'
    if re.fullmatch(r"[+-]?(inf(inity)?|∞)|1\.#(INF|QNAN|IND).*", cell, re.IGNORECASE):
        return "; list it in missing of [log] if it means that there is no reading"
    if re.fullmatch(r"[+-]?[\d.,]+(?:[eE][+-]?\d+)?\s*(?:[^\W\d_]|[%°])\D*", cell):
        return "; a unit in the cell? state it as unit of the channel"
    return "; list it in missing of [log] if it means that there is no reading, or in skip if the line is no row"
