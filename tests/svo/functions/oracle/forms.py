"""Linear forms with remainders: v(z) in k + g (z - c) + [rest], and v(z) in [range], for all z of a box with centre c.

k and g are floats and exact by definition: what rounding took from them is in the remainder. Each operation is bounded
by an interval and by its form, and each cuts the other. A product keeps the sign of its squares, (z_j - c_j)^2 >= 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from svo.functions.operations import Op
from tests.svo.functions.oracle.intervals import (
    WHOLE_TURN,
    Interval,
    NotEnclosed,
    add,
    applied,
    inv,
    maximum,
    mul,
    neg,
    sqr,
    sub,
    up,
)
from tests.svo.functions.oracle.secants import secant

_EPS = 2.0**-52  # twice what one rounding takes, so that bounds of rounding may be rounded too
_TINY = 2.0**-1022  # more than what products lose that are no normal floats


Vector = Sequence[float]  # few numbers: Python's own are faster than arrays


class Form(NamedTuple):
    """k + g (z - c) + rest, and range."""

    k: float
    g: Vector
    rest: Interval
    range: Interval


class Box(NamedTuple):
    """What forms are about: the coordinates z, their centre c, and bounds of |z - c|."""

    centre: Vector
    radius: Vector
    tiny: float

    @classmethod
    def between(cls, lower: Vector, upper: Vector) -> Box:
        """All z between two bounds (m,), finite."""
        ends = list(zip(lower, upper, strict=True))
        centre = [0.5 * low + 0.5 * high for low, high in ends]
        radius = [up(max(high - c, c - low)) for c, (low, high) in zip(centre, ends, strict=True)]
        return cls(centre, radius, _TINY * (1.0 + sum(radius)))

    def reach(self, g: Vector) -> float:
        """Bound of |g (z - c)|, up to rounding."""
        return sum([abs(v) * r for v, r in zip(g, self.radius, strict=True)])

    def rounded(self, k: float, g: Vector, rest: Interval, values: Interval, size: float) -> Form:
        """A form whose k, g and rest are sums in floats of terms of this size in all, each rounded a few times."""
        lost = (len(g) + 8) * _EPS * size + self.tiny
        return self.cut(Form(k, g, (rest[0] - lost, rest[1] + lost), values))

    def cut(self, form: Form) -> Form:
        """Range and rest, each cut by what the other says."""
        k, g, rest, (low, high) = form
        reach = self.reach(g)
        lost = (len(g) + 4) * _EPS * (abs(k) + reach + max(-rest[0], rest[1], abs(low), abs(high))) + self.tiny
        below, above = k - reach - lost, k + reach + lost
        rest = max(rest[0], low - above - lost), min(rest[1], high - below + lost)
        return Form(k, g, rest, (max(low, below + rest[0]), min(high, above + rest[1])))

    def coordinate(self, j: int, lower: float, upper: float) -> Form:
        """z_j itself."""
        g = [0.0] * len(self.centre)
        g[j] = 1.0
        return Form(self.centre[j], g, (0.0, 0.0), (lower, upper))

    def constant(self, values: Interval) -> Form:
        """A number between two floats."""
        k = 0.5 * values[0] + 0.5 * values[1]
        rest = sub(values, (k, k)) if values[0] < values[1] else (0.0, 0.0)
        return Form(k, [0.0] * len(self.centre), rest, values)

    # -- operations ------------------------------------------------------------------------------

    def applied(self, op: Op, *of: Form) -> Form:
        """The form of an operation.

        Raises
        ------
        NotEnclosed
            If its range over the box is not bounded by floats.
        """
        form = _RULES[op](self, *of) if op in _RULES else self.elementary(op, *of)
        if not math.isfinite(form.k + form.rest[0] + form.rest[1] + self.reach(form.g)):
            raise NotEnclosed("its range is beyond all floats")
        return form

    def elementary(self, op: Op, a: Form) -> Form:
        """By the secant of a function of one operand."""
        return self.sloped(a, *secant(op, a.range))

    def sloped(self, a: Form, slope: float, rest: Interval, values: Interval) -> Form:
        """A function whose value is slope * a + rest."""
        middle = 0.5 * rest[0] + 0.5 * rest[1]
        g, (low, high) = [slope * v for v in a.g], _ends(slope, a.rest)
        size = abs(slope * a.k) + 2.0 * max(-rest[0], rest[1], 0.0) + max(-low, high) + self.reach(g)
        return self.rounded(slope * a.k + middle, g, (low + rest[0] - middle, high + rest[1] - middle), values, size)

    def opposite(self, a: Form) -> Form:
        """-a, exactly."""
        return Form(-a.k, [-v for v in a.g], neg(a.rest), neg(a.range))

    def total(self, a: Form, b: Form) -> Form:
        """a + b."""
        rest = a.rest[0] + b.rest[0], a.rest[1] + b.rest[1]
        size = self.size(a) + self.size(b)
        g = [v + w for v, w in zip(a.g, b.g, strict=True)]
        return self.rounded(a.k + b.k, g, rest, add(a.range, b.range), size)

    def difference(self, a: Form, b: Form) -> Form:
        """a - b."""
        return self.total(a, self.opposite(b))

    def size(self, a: Form) -> float:
        """Bound of the terms of a form."""
        return abs(a.k) + self.reach(a.g) + max(-a.rest[0], a.rest[1])

    def product(self, a: Form, b: Form) -> Form:
        """a b."""
        p, q = ([v * r for v, r in zip(of.g, self.radius, strict=True)] for of in (a, b))
        squares = [s * t for s, t in zip(p, q, strict=True)]
        mixed = sum([abs(p[i] * q[j] + p[j] * q[i]) for i in range(len(p)) if p[i] or q[i] for j in range(i)])
        largest_a, largest_b = max(-a.rest[0], a.rest[1]), max(-b.rest[0], b.rest[1])
        cross = sum(map(abs, p)) * largest_b + sum(map(abs, q)) * largest_a + mixed
        corners = [s * t for s in a.rest for t in b.rest]
        ends = _ends(a.k, b.rest), _ends(b.k, a.rest), (min(corners), max(corners))
        low = sum([e[0] for e in ends]) + sum([min(s, 0.0) for s in squares]) - cross
        high = sum([e[1] for e in ends]) + sum([max(s, 0.0) for s in squares]) + cross
        g = [a.k * w + b.k * v for v, w in zip(a.g, b.g, strict=True)]
        size = (len(p) + 4.0) * self.size(a) * self.size(b)
        return self.rounded(a.k * b.k, g, (low, high), mul(a.range, b.range), size)

    def quotient(self, a: Form, b: Form) -> Form:
        """a / b = q + (a - q b) / b, with q of the centres and with q of the slopes; or the product with 1 / b."""
        over = self.applied(Op.INV, b)
        best = self.product(a, over)
        p, r = ([v * w for v, w in zip(of.g, self.radius, strict=True)] for of in (a, b))
        squares = sum([v * v for v in r])
        along = sum([v * w for v, w in zip(p, r, strict=True)]) / squares if squares else math.inf
        for q in (a.k / b.k if b.k else math.inf, along):
            if abs(q) < 1e300:
                left = self.difference(a, self.sloped(b, q, (0.0, 0.0), mul((q, q), b.range)))
                other = self.total(self.constant((q, q)), self.product(left, over))
                best, worse = sorted((best, other), key=lambda form: form.rest[1] - form.rest[0])
                best = self._within(best, worse.range)
        return best

    def maximum(self, a: Form, b: Form) -> Form:
        """The larger one of two: b + max(a - b, 0)."""
        gap = self.difference(a, b)
        low, high = gap.range
        if low >= 0.0 or high <= 0.0:
            return a if low >= 0.0 else b
        slope = high / (high - low)
        ends = sub((0.0, 0.0), mul((slope, slope), (low, low))), sub((high, high), mul((slope, slope), (high, high)))
        rest = min(0.0, ends[0][0], ends[1][0]), max(0.0, ends[0][1], ends[1][1])
        return self._within(self.total(b, self.sloped(gap, slope, rest, (0.0, high))), maximum(a.range, b.range))

    def _within(self, form: Form, values: Interval) -> Form:
        low, high = form.range
        return self.cut(form._replace(range=(max(low, values[0]), min(high, values[1]))))

    def chosen(self, t: Form, below: Form | None, above: Form | None) -> Form:
        """One form where t is below zero, the other elsewhere; where t may be both, either."""
        both = applied(Op.SELECT, t.range, below and below.range, above and above.range)
        if below is None or above is None or not t.range[0] < 0.0 <= t.range[1]:
            form = below if t.range[1] < 0.0 else above
            assert form is not None  # `applied` has refused what it needs and is not there
            return form
        gap = self.difference(below, above).range
        share = 0.5 * max(abs(gap[0]), abs(gap[1]))
        return self.sloped(self.total(below, above), 0.5, (-share, share), both)

    def angle(self, y: Form, x: Form) -> Form:
        """atan2(y, x), by one-sided bounds of second order; its range alone where that is narrower, or at the cut."""
        values = applied(Op.ATAN2, y.range, x.range)
        flat = self.cut(self.constant(values))
        if values == WHOLE_TURN:
            return flat
        u, v = (0.5 * r[0] + 0.5 * r[1] for r in (x.range, y.range))
        dx, dy = (up(max(r[1] - m, m - r[0])) for r, m in ((x.range, u), (y.range, v)))
        along_x, along_y, bend = _bend_of_angle(x.range, y.range, dx, dy, u, v)
        if bend is None:
            return flat
        here = applied(Op.ATAN2, (v, v), (u, u))
        off = add(mul((-dx, dx), along_x.error), mul((-dy, dy), along_y.error))
        start = sub(sub(here, mul(_point(along_x.value), (u, u))), mul(_point(along_y.value), (v, v)))
        rest = add(add(start, off), bend)
        part = self.sloped(x, along_x.value, (0.0, 0.0), mul(_point(along_x.value), x.range))
        form = self._within(self.total(part, self.sloped(y, along_y.value, rest, _loose(y, along_y, rest))), values)
        return form if form.rest[1] - form.rest[0] < flat.rest[1] - flat.rest[0] else flat


class _Slope(NamedTuple):
    """A float, and what it misses of a derivative."""

    value: float
    error: Interval


def _point(value: float) -> Interval:
    return value, value


def _loose(a: Form, slope: _Slope, rest: Interval) -> Interval:
    return add(mul(_point(slope.value), a.range), rest)


def _slope(derivative: Interval) -> _Slope:
    value = 0.5 * derivative[0] + 0.5 * derivative[1]
    return _Slope(value, sub(derivative, (value, value)))


def _bend_of_angle(
    x: Interval, y: Interval, dx: float, dy: float, u: float, v: float
) -> tuple[_Slope, _Slope, Interval | None]:
    """The derivatives of atan2 at (u, v), and half its second differential over a box with these half-widths."""
    flat = _Slope(0.0, (0.0, 0.0))
    squares = add(sqr(x), sqr(y))
    middle = add(sqr((u, u)), sqr((v, v)))
    if not (squares[0] > 1e-150 and middle[0] > 1e-150):
        return flat, flat, None
    per, over = inv(middle), sqr(inv(squares))
    twice_xy = mul((2.0, 2.0), mul(mul(x, y), over))
    mixed = mul(sub(sqr(y), sqr(x)), over)  # d2 atan2 / dx dy; the others are 2 x y / rho^4 and its opposite
    xx, yy = (0.0, sqr((dx, dx))[1]), (0.0, sqr((dy, dy))[1])
    corner = mul((dx, dx), (dy, dy))[1]
    half = add(mul(twice_xy, sub(xx, yy)), mul((2.0, 2.0), mul(mixed, (-corner, corner))))
    bend = mul((0.5, 0.5), half)
    largest = mul(mul((0.5, 0.5), add(xx, yy)), inv(squares))[1]  # the eigenvalues of the Hessian are +-1 / rho^2
    return _slope(neg(mul((v, v), per))), _slope(mul((u, u), per)), (max(bend[0], -largest), min(bend[1], largest))


def _ends(slope: float, rest: Interval) -> Interval:
    first, last = slope * rest[0], slope * rest[1]
    return min(first, last), max(first, last)


_RULES: Mapping[Op, Callable[..., Form]] = {
    Op.NEG: Box.opposite, Op.ADD: Box.total, Op.SUB: Box.difference, Op.MUL: Box.product, Op.MAX: Box.maximum,
    Op.SELECT: Box.chosen, Op.ATAN2: Box.angle, Op.DIV: Box.quotient,
}  # fmt: skip
