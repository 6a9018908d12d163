"""Rational numbers that a user gives as `fractions.Fraction`: rows and points are taken exactly, in integers.

A row may be multiplied by a positive number, so that ``[1/3, 1] x <= 1/7`` is a row of floats, ``[7, 21] x <= 3``.
"""

import sys
from collections.abc import Sequence
from fractions import Fraction
from math import gcd, lcm
from typing import Any

import numpy as np

from polytopes.checks import Floats
from polytopes.double_description import Integers
from polytopes.integers import are_floats, as_floats, trailing_zeros

_LARGEST = 1024  # bits of the largest float
_MOST_DIGITS = 5000  # of the exponent of ten of a decimal; 10 to a long one takes for ever


def hold_fractions(*parts: Any) -> bool:
    """Whether lists, tuples or arrays of objects hold a Fraction."""
    return any(map(_holds, parts))


def _holds(part: Any) -> bool:
    if part is None:
        return False
    if isinstance(part, np.ndarray):
        return part.dtype == object and any(isinstance(v, Fraction) for v in part.flat)
    return isinstance(part, Fraction) or (isinstance(part, list | tuple) and any(_holds(v) for v in part))


def exact_table(name: str, value: Any) -> list[list[Fraction]]:
    """Rows of numbers as fractions, each exactly; all of one length.

    Raises
    ------
    TypeError, ValueError
        If an entry is no number, or rows differ in length.
    """
    rows = [exact_numbers(f"{name}[{i}]", row) for i, row in enumerate(value)]
    if len({len(row) for row in rows}) > 1:
        raise ValueError(f"{name} is no array: rows differ in length. Expected numbers in rows of one length.")
    return rows


def exact_numbers(name: str, value: Any) -> list[Fraction]:
    """Numbers as fractions."""
    if not isinstance(value, list | tuple | np.ndarray):
        raise TypeError(f"{name} is a {type(value).__name__}; expected a sequence of numbers.")
    found = []
    for v in value:
        if not isinstance(v, int | float | Fraction | np.integer | np.floating):
            raise TypeError(f"{name} holds a {type(v).__name__}; expected real numbers.")
        if isinstance(v, float | np.floating) and not np.isfinite(v):
            raise ValueError(f"{name} holds {v}; expected finite numbers beside fractions.")
        found.append(v if isinstance(v, Fraction) else Fraction(v.item() if isinstance(v, np.generic) else v))
    return found


def rows_of_floats(names: str, A: Any, b: Any) -> tuple[Floats, Floats]:
    """Rows ``A x <= b`` (or with =) of fractions as floats, each multiplied by a positive number.

    Raises
    ------
    ValueError
        If a shape does not fit, or a row is no multiple of floats.
    """
    table, sides = exact_table(names[0], A), exact_numbers(names[1], b)
    if len(table) != len(sides):
        raise ValueError(
            f"{names[1]} has shape ({len(sides)},); expected ({len(table)},), one entry per row of {names[0]}."
        )
    rows = [
        row_of_floats(f"row {i} of {names[0]}", [*row, side])
        for i, (row, side) in enumerate(zip(table, sides, strict=True))
    ]
    found = np.array(rows).reshape(len(rows), -1)
    return found[:, :-1], found[:, -1]


def exact_vector(name: str, value: Any, n: int) -> list[Fraction]:
    """n numbers as fractions; TypeError or ValueError otherwise."""
    numbers = exact_numbers(name, value)
    if len(numbers) != n:
        raise ValueError(f"{name} has shape ({len(numbers)},); expected ({n},).")
    return numbers


def box_of_fractions(lower: Any, upper: Any) -> tuple[Floats, Floats]:
    """Rows A and b of a box whose bounds have fractions among them, exactly; errors as of `rows_of_floats`."""
    low = exact_numbers("lower", lower)
    high = exact_vector("upper", upper, len(low))
    axes = np.eye(len(low))
    return rows_of_floats("Ab", [*axes, *(0.0 - axes)], [*high, *(-v for v in low)])


def row_of_floats(what: str, row: Sequence[Fraction]) -> Floats:
    """A row times a positive number that makes floats of it; ValueError if there is none."""
    whole = primitive_row(row)
    if are_floats(whole):
        return as_floats(whole, whole)
    longest, shortest = max(map(abs, whole)).bit_length(), min(trailing_zeros(v) for v in whole if v)
    middle = max((longest + shortest) // 2, longest - _LARGEST)  # the least entries may be subnormal
    scaled = [v / Fraction(2) ** middle for v in whole]
    if max(abs(v) for v in scaled) > sys.float_info.max or any(Fraction(float(v)) != v for v in scaled):
        raise ValueError(f"{what} is no multiple of floats; round it first.")
    return np.array([float(v) for v in scaled])


def nearest_row(what: str, row: Sequence[Fraction]) -> Floats:
    """The same, or else the nearest floats; ValueError if one is beyond all floats, or becomes zero."""
    try:
        return row_of_floats(what, row)
    except ValueError:
        pass
    try:
        made = np.array([float(v) for v in row])
    except OverflowError:
        made = np.zeros(len(row))
    if any(u and not v for u, v in zip(row, made.tolist(), strict=True)):
        raise ValueError(f"{what} has a number beyond all floats.")
    return made


def number_of_text(text: str) -> Fraction:
    """An integer, a fraction or a decimal as it stands; ValueError for one with an exponent that no float has."""
    _, _, exponent = text.lower().partition("e")
    if exponent and abs(int(exponent)) > _MOST_DIGITS:
        raise ValueError(f"{text!r} is beyond all floats")
    return Fraction(text)


def primitive_row(row: Sequence[Fraction]) -> list[int]:
    """The row times a positive number, as integers without a common divisor."""
    common = lcm(*(v.denominator for v in row))
    whole = [int(v * common) for v in row]
    divisor = gcd(*whole) or 1
    return [v // divisor for v in whole]


def integers_of(rows: Sequence[Sequence[int]], width: int) -> Integers:
    """Rows of integers (m, width) as an array of objects."""
    return np.array(rows, dtype=object).reshape(len(rows), width)
