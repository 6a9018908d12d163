"""Upper bounds of linear forms from multipliers, whatever is rounded on the way: the compiled `dual_bound` in numpy.

For x with ``A x <= b`` and y >= 0, ``c'x <= y'b + |c - A'y|'|x|``: a bound of |x| makes it a bound of ``c'x``, and the
same bounds along the axes prove one of |x|.
"""

from dataclasses import dataclass

import numpy as np

from polytopes import kernel
from polytopes.affine import exact_sums
from polytopes.checks import Floats

_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class Bounds:
    """``c'x <= values - spare + beside'|x|`` for k forms c and all x of a set: arrays (k,), (k,) and (k, n)."""

    values: Floats
    spare: Floats
    beside: Floats

    def widened(self, values: Floats, beside: Floats) -> "Bounds":
        """The bounds with errors (k,) and (k, n) added to both."""
        sides = np.where(beside > 0.0, (self.beside + beside) * (1.0 + 1e-9), self.beside)
        return Bounds(_raised(self.values, self.spare, values * (1.0 + 1e-9)), np.zeros_like(self.spare), sides)

    def gaps(self, forms: Floats, points: Floats, reach: Floats) -> tuple[Floats, Floats, Floats]:
        """Upper bounds (k,) of the forms (k, n) where ``|x| <= reach`` (n,), inf where nothing bounds them.

        How far they are above the values at the points (k, n), and the sizes of the terms of both come with them.
        """
        return kernel.gaps(forms, points, (self.values, self.spare, self.beside), reach)


def _raised(values: Floats, spare: Floats, more: Floats) -> Floats:
    """Floats that are at least ``values - spare + more``."""
    with np.errstate(over="ignore", invalid="ignore"):  # beyond floats: no bound
        return np.where(more > spare, np.nextafter(values + more, np.inf), values)


def equality_multipliers(C: Floats, d: Floats, forms: Floats) -> Floats:
    """Multipliers (k, q) with which the rows of ``C x = d`` add up to forms (k, n) in their span, up to rounding.

    Solved in units in which the rows are even: least squares of rows as given drop those that are small beside others.
    """
    if not (d.size and len(forms)):
        return np.zeros((len(forms), d.size))
    rows, columns = kernel.exponents(C, d)
    even = np.ldexp(np.ldexp(C, rows[:, None]), columns)
    found = np.linalg.lstsq(even.T, np.ldexp(forms, columns).T, rcond=None)[0].T
    return np.asarray(np.ldexp(found, rows))


def multiplier_bounds(AT: Floats, b: Floats, c: Floats, y: Floats) -> Bounds:
    """Bounds of one form c (n,) by any multipliers y >= 0 (m,) of the rows; exact where no sum is rounded."""
    used = np.flatnonzero(y)
    table = np.hstack([AT.T, b[:, None]])[used]
    sums = y[used] @ table
    reach = np.abs(y[used]) @ np.abs(table)
    reach[:-1] += np.abs(c)
    errors = (used.size + 4) * _EPS * reach
    given = np.append(c, 0.0)
    for j in np.flatnonzero(reach):
        if exact_sums(y[None, used], given[None, j], table[:, [j]], reach[None, [j]])[0, 0]:
            errors[j] = 0.0
    beside = np.abs(given - sums)[:-1]
    beside = np.where(errors[:-1] > 0.0, np.nextafter(beside + errors[:-1], np.inf), beside)
    value = np.nextafter(sums[-1] + errors[-1], np.inf) if errors[-1] > 0.0 else sums[-1]
    return Bounds(np.array([value]), np.zeros(1), beside[None])


def proved_reach(along: Bounds) -> Floats:
    """Bounds (n,) of |x| from those along the axes and against them (2 n forms); inf where none is proved.

    Of ``|x| <= v + G |x|`` with small G follows a bound of |x| itself, whichever x it is.
    """
    n = along.beside.shape[1]
    values = np.maximum(np.maximum(along.values[:n], along.values[n:]), 0.0)
    slopes = np.maximum(along.beside[:n], along.beside[n:])
    known = np.isfinite(values) & np.isfinite(slopes).all(axis=1)
    while known.any() and (slopes[known][:, ~known] > 0.0).any():
        known &= ~(slopes[:, ~known] > 0.0).any(axis=1)
    reach = np.full(n, np.inf)
    if known.any():
        inside = slopes[np.ix_(known, known)]
        if inside.sum(axis=1).max() < 0.25:  # so that max |x| <= max v / (1 - 1/4)
            reach[known] = (values[known] + inside.sum(axis=1) * 2.0 * values[known].max()) * (1.0 + 8.0 * _EPS)
    return reach
