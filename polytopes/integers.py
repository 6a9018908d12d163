"""Floats as integers and back: every float is an integer times a power of two."""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from polytopes import kernel
from polytopes.checks import Floats
from polytopes.double_description import Integers, primitive
from polytopes.errors import UndecidedError

SHORT = 2**32
"""Rows whose primitive integers stay below are short: sets of short rows are computed with exactly."""

_LARGE = 32  # bits
_BITS = 53  # of a float
_EXACT = 2.0**_BITS
_HALF_EXACT = 2.0**26
_PARTS = 2.0**13
_FARTHEST = 1000  # powers of two that a float may be multiplied by


def integer_rows(table: Floats) -> Integers:
    """Each row (m, n) as primitive integers, up to a positive factor; machine integers where all of them fit."""
    if not table.size:
        return np.zeros(table.shape, dtype=np.int64)
    small = kernel.integer_rows(table)
    if small is not None:
        return small
    lowest, highest = lowest_bit(table).min(axis=1, initial=0), np.frexp(table)[1].max(axis=1, initial=0)
    if (lowest > -_FARTHEST).all() and (highest - lowest < _FARTHEST).all():
        whole = np.ldexp(table, -lowest[:, None])
        return primitive(np.array([[int(v) for v in row] for row in whole.tolist()], dtype=object))
    rows = np.zeros(table.shape, dtype=object)
    for i, values in enumerate(table.tolist()):
        ratios = [v.as_integer_ratio() for v in values]
        common = max((q for _, q in ratios), default=1)
        rows[i] = [p * (common // q) for p, q in ratios]
    return primitive(rows)


def lowest_bit(table: Floats) -> NDArray[np.int64]:
    """Exponent of the lowest bit of each entry; 0 for a zero."""
    parts, exponents = np.frexp(np.abs(table))
    whole = (parts * _EXACT).astype(np.int64)
    trailing = np.frexp((whole & -whole).astype(np.float64))[1] - 1
    return np.where(whole == 0, 0, trailing + exponents.astype(np.int64) - _BITS)


def short(rows: Integers) -> bool:
    """Whether rows are so short that results in their integers are, as a rule, floats again."""
    return rows.dtype != object and int(np.abs(rows).max(initial=0)) < SHORT


def is_short(*tables: Floats) -> bool:
    """Whether the rows ``A x <= b`` of tables A, b, C, d, ... are short."""
    pairs = zip(tables[::2], tables[1::2], strict=True)
    return all(short(integer_rows(np.hstack([rows, sides[:, None]]))) for rows, sides in pairs)


def exact_product(A: Floats, M: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """``A M`` and, for each entry, whether no rounding can have happened: all terms are multiples of one power of two
    and, together, below 2^53 of it.
    """
    rows, columns = lowest_bit(A).min(axis=1, initial=0), lowest_bit(M).min(axis=0, initial=0)
    with np.errstate(over="ignore", invalid="ignore"):
        limit, reach = np.ldexp(_EXACT, rows[:, None] + columns[None]), np.abs(A) @ np.abs(M)
        return A @ M, (reach <= limit) & (reach < np.inf)


def whole(table: Floats, terms: int) -> bool:
    """Whether entries are so small multiples of 2^-13 that sums of so many of their products with others are floats."""
    with np.errstate(over="ignore"):
        parts = table * _PARTS
    return bool(np.abs(parts).max(initial=0.0) * terms < _HALF_EXACT and (parts == np.rint(parts)).all())


def rounded_difference(first: Floats, second: Floats, difference: Floats) -> Floats:
    """What was rounded in ``first - second`` (Knuth's sum of two floats)."""
    part = difference - first
    lost: Floats = (first - (difference - part)) - (second + part)
    return lost


def are_floats(row: Sequence[int]) -> bool:
    """Whether each integer is a float, up to one power of two for all of them."""
    return all(v == 0 or abs(v).bit_length() - trailing_zeros(v) <= 53 for v in row) and _span(row) < _FARTHEST


def trailing_zeros(v: int) -> int:
    """Exponent of the lowest bit of an integer that is not zero."""
    return (v & -v).bit_length() - 1


def _span(row: Sequence[int]) -> int:
    lengths = [abs(v).bit_length() for v in row if v]
    return max(lengths, default=0)


def whole_numbers(vector: Floats) -> tuple[NDArray[np.object_], int]:
    """Integers and an exponent k >= 0: the floats are the integers over 2^k."""
    ratios = [v.as_integer_ratio() for v in vector.tolist()]
    exponent = max(q.bit_length() - 1 for _, q in ratios)
    return np.array([p << (exponent - (q.bit_length() - 1)) for p, q in ratios], dtype=object), exponent


def up(value: Fraction | float) -> float:
    """The least float not below a number."""
    try:
        nearest = float(value)
    except OverflowError:
        return math.inf if value > 0 else -float(np.finfo(np.float64).max)
    return nearest if nearest >= value else float(np.nextafter(nearest, np.inf))


def as_floats(row: list[int], normal: list[int]) -> Floats:
    """Integers to the nearest floats; over a power of two, if those of the normal are large."""
    largest = max(abs(v) for v in normal).bit_length()
    divisor = 1 << largest if largest > _LARGE else 1
    return np.array([v / divisor for v in row], dtype=np.float64)


def floats_of_points(points: Integers) -> Floats:
    """Points ``[x, t]`` (k, n + 1) to the nearest floats x / t (k, n)."""
    try:
        values = [[v / row[-1] for v in row[:-1]] for row in points.tolist()]
    except OverflowError:
        raise UndecidedError("a point of the answer is beyond all floats; use other units.") from None
    return np.array(values, dtype=np.float64).reshape(len(points), points.shape[1] - 1)


def floats_of_directions(rays: Integers) -> Floats:
    """Directions (r, n) to the nearest floats, large ones over a power of two."""
    return np.array([as_floats(row, row) for row in rays.tolist()]).reshape(rays.shape)
