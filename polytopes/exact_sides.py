"""Rows whose right-hand sides are known exactly, as floats: exact where they are floats, and rounded up elsewhere.

A set whose rows keep their normals and move by exact amounts (shifted, scaled, cut, shrunk) so contains the exact one,
and is the same wherever its numbers are floats.
"""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from polytopes.checks import Floats
from polytopes.integers import exact_product, up
from polytopes.rows import Table

_LARGEST = 2**1023


def exact_forms(rows: Floats, x: Floats | Sequence[Fraction]) -> list[Fraction]:
    """``rows x`` (m,) exactly, of rows (m, n) and a vector (n,) of floats or fractions."""
    if not isinstance(x, np.ndarray):
        return [exact_form(row, x) for row in rows]
    values, certain = exact_product(rows, x[:, None])
    return [
        Fraction(value) if sure else exact_form(row, x)
        for row, value, sure in zip(rows, values[:, 0].tolist(), certain[:, 0], strict=True)
    ]


def exact_form(row: Floats, x: Floats | Sequence[Fraction]) -> Fraction:
    """``row'x`` exactly."""
    pairs = zip(row.tolist(), x.tolist() if isinstance(x, np.ndarray) else x, strict=True)
    return sum((Fraction(u) * Fraction(v) for u, v in pairs if u and v), Fraction(0))


def with_sides(A: Floats, sides: Sequence[Fraction], C: Floats, values: Sequence[Fraction]) -> Table:
    """Rows of ``A x <= sides``, ``C x = values``, sides rounded up; an equality that is no float becomes two rows."""
    inner = [_row(row, side) for row, side in zip(A, sides, strict=True)]
    fixed: list[Floats] = []
    for row, value in zip(C, values, strict=True):
        above, below = _row(row, value), _row(-row, -value)
        if (above == -below).all():
            fixed.append(above)
        else:
            inner += [above, below]
    inequalities, equalities = (np.array(part).reshape(-1, A.shape[1] + 1) for part in (inner, fixed))
    return inequalities[:, :-1], inequalities[:, -1], equalities[:, :-1], equalities[:, -1]


def _row(row: Floats, side: Fraction) -> Floats:
    """A row ``[a, b]``, multiplied by the denominator of b if it stays exact then, else b rounded up."""
    bound = _rounded_up(side)
    if bound != side and max(side.denominator, abs(side.numerator)) < _LARGEST:
        factor, whole = side.denominator, float(side.numerator)
        with np.errstate(over="ignore"):
            scaled = row * float(factor)
        if np.isfinite(scaled).all() and whole == side.numerator and _is_multiple(scaled, row, factor):
            return np.append(scaled, whole)
    return np.append(row, bound)


def _is_multiple(scaled: Floats, row: Floats, factor: int) -> bool:
    return all(Fraction(u) == Fraction(v) * factor for u, v in zip(scaled.tolist(), row.tolist(), strict=True))


def _rounded_up(side: Fraction) -> float:
    """The least float not below a number; +inf, which bounds nothing, beyond floats."""
    if abs(side) < _LARGEST:
        return up(side)
    return math.inf if side > 0 else -float(_LARGEST)
