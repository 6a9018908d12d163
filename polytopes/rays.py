"""Rays shot at a set, and its gauge: questions on a line, answered row by row in rationals."""

from dataclasses import dataclass
from fractions import Fraction
from math import inf

import numpy as np

from polytopes.checks import Floats
from polytopes.exact_sides import exact_forms
from polytopes.inclusion import half_spaces
from polytopes.rows import Rows
from polytopes.shown import Shown
from polytopes.support import known_nonempty


@dataclass(frozen=True, eq=False)
class Chord(Shown):
    """The part ``{x + t v : enter <= t <= leave}`` of a ray, t >= 0, that lies in a set.

    Attributes
    ----------
    enter, leave : float
        Nearest floats; `leave` is inf where the ray stays inside.
    entered, left : int or None
        The row that is crossed there, of A or from m on of C; None where the ray begins or does not end.
    """

    enter: float
    leave: float
    entered: int | None
    left: int | None


def chord(P: Rows, x: Floats, v: Floats) -> Chord | None:
    """Where the ray ``{x + t v : t >= 0}`` enters and leaves P; None if it misses it.

    ``t <= (b - a'x) / a'v`` where ``a'v > 0``, and >= where it is negative; exact.
    """
    normals, sides = half_spaces(P)
    enter, leave = Fraction(0), Fraction(0)
    entered: int | None = None
    left: int | None = None
    rates, places = exact_forms(normals, v), exact_forms(normals, x)
    for i, (rate, place, side) in enumerate(zip(rates, places, sides.tolist(), strict=True)):
        slack = Fraction(side) - place
        if rate == 0:
            if slack < 0:
                return None
        elif rate > 0:
            if left is None or slack / rate < leave:
                leave, left = slack / rate, i
        elif slack / rate > enter:
            enter, entered = slack / rate, i
    if left is not None and leave < enter:
        return None
    m, q = P.b.size, P.d.size
    names = [None if i is None else i if i < m + q else i - q for i in (entered, left)]
    return Chord(float(enter), inf if left is None else float(leave), *names)


def gauges(P: Rows, points: Floats) -> Floats:
    """``inf {s >= 0 : x in s P}`` for each of k points (k, n), to the nearest float; inf where no multiple holds it.

    Every row ``a'x <= s b`` is a bound of s; the recession cone of the set is where the gauge is 0.
    """
    if not known_nonempty(P):
        return np.full(len(points), inf)
    normals, sides = half_spaces(P)
    return np.array([_gauge(exact_forms(normals, x), sides) if x.any() else 0.0 for x in points])


def _gauge(places: list[Fraction], sides: Floats) -> float:
    least, most = Fraction(0), Fraction(-1)
    limited = False
    for place, side in zip(places, map(Fraction, sides.tolist()), strict=True):
        if side > 0:
            least = max(least, place / side)
        elif side < 0:
            most, limited = (min(most, place / side) if limited else place / side), True
        elif place > 0:
            return inf
    return _nearest(least) if not limited or (least <= most and most > 0) else inf


def _nearest(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return inf
