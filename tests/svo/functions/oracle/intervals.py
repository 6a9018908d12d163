"""Intervals of floats that contain every value of an operation: rounded outward, elementary functions by balls.

IEEE sums, products, quotients and square roots are rounded to nearest, so the float next to a result is a bound.
Nothing is proven of the machine's `sin` or `exp`; those are python-flint's balls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from flint import arb

from polytopes.exact import ball_up
from svo.functions.operations import Op

Interval = tuple[float, float]

WHOLE_TURN: Interval = (-math.nextafter(math.pi, 4.0), math.nextafter(math.pi, 4.0))
_INF = math.inf
_TINY = 5e-324
_PI = arb.pi()


class NotEnclosed(ArithmeticError):
    """An operation has no bounded range over its operands: the argument says why."""


def down(x: float) -> float:
    """The float below."""
    return math.nextafter(x, -_INF)


def up(x: float) -> float:
    """The float above."""
    return math.nextafter(x, _INF)


def add(a: Interval, b: Interval) -> Interval:
    """All sums; exact where a float is."""
    return _sum_below(a[0], b[0]), -_sum_below(-a[1], -b[1])


def _sum_below(x: float, y: float) -> float:
    total = x + y
    part = total - x
    lost = (x - (total - part)) + (y - part)  # exactly what rounding took (Knuth's two-sum)
    return total if lost >= 0.0 else down(total)


def neg(a: Interval) -> Interval:
    """All opposites."""
    return -a[1], -a[0]


def sub(a: Interval, b: Interval) -> Interval:
    """All differences."""
    return add(a, (-b[1], -b[0]))


def mul(a: Interval, b: Interval) -> Interval:
    """All products; a product with zero is exact."""
    products = (a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1])
    low, high = min(products), max(products)
    if low == 0.0:
        below = 0.0 if (a[0] >= 0.0 and b[0] >= 0.0) or (a[1] <= 0.0 and b[1] <= 0.0) or _has_zero(a, b) else -_TINY
    else:
        below = down(low)
    if high == 0.0:
        above = 0.0 if (a[0] >= 0.0 and b[1] <= 0.0) or (a[1] <= 0.0 and b[0] >= 0.0) or _has_zero(a, b) else _TINY
    else:
        above = up(high)
    return below, above


def _has_zero(a: Interval, b: Interval) -> bool:
    return a == (0.0, 0.0) or b == (0.0, 0.0)


def sqr(a: Interval) -> Interval:
    """All squares."""
    low, high = _magnitudes(a)
    return (max(0.0, down(low * low)) if low > 0.0 else 0.0), (up(high * high) if high > 0.0 else 0.0)


def inv(a: Interval) -> Interval:
    """All reciprocals."""
    if a[0] <= 0.0 <= a[1]:
        raise NotEnclosed("it divides by a range that contains zero")
    return down(1.0 / a[1]), up(1.0 / a[0])


def div(a: Interval, b: Interval) -> Interval:
    """All quotients."""
    return mul(a, inv(b))


def sqrt(a: Interval) -> Interval:
    """All roots."""
    if a[0] < 0.0:
        raise NotEnclosed("its argument may be negative")
    return max(0.0, down(math.sqrt(a[0]))) if a[0] > 0.0 else 0.0, up(math.sqrt(a[1])) if a[1] > 0.0 else 0.0


def sroot(a: Interval) -> Interval:
    """All signed roots."""
    low = -sqrt((-a[0], -a[0]))[1] if a[0] < 0.0 else sqrt((a[0], a[0]))[0]
    return low, -sqrt((-a[1], -a[1]))[0] if a[1] < 0.0 else sqrt((a[1], a[1]))[1]


def exp(a: Interval) -> Interval:
    """All exponentials."""
    return max(0.0, ball_below(arb(a[0]).exp())), ball_up(arb(a[1]).exp())


def log(a: Interval) -> Interval:
    """All logarithms."""
    if a[0] <= 0.0:
        raise NotEnclosed("its argument may be zero or negative")
    return ball_below(arb(a[0]).log()), ball_up(arb(a[1]).log())


def tanh(a: Interval) -> Interval:
    """All hyperbolic tangents."""
    return max(-1.0, ball_below(arb(a[0]).tanh())), min(1.0, ball_up(arb(a[1]).tanh()))


def sin(a: Interval) -> Interval:
    """All sines."""
    return _wave(a, arb(a[0]).sin(), arb(a[1]).sin(), arb(0.25))


def cos(a: Interval) -> Interval:
    """All cosines."""
    return _wave(a, arb(a[0]).cos(), arb(a[1]).cos(), arb(0.0))


def _wave(a: Interval, first: arb, last: arb, crest: arb) -> Interval:
    """Range of a wave between its values at the ends; its crests are at crest + k turns, its troughs half a turn on."""
    low = max(-1.0, min(ball_below(first), ball_below(last)))
    high = min(1.0, max(ball_up(first), ball_up(last)))
    if a[0] == a[1]:
        return low, high
    begin, end = arb(a[0]) / (2 * _PI) - crest, arb(a[1]) / (2 * _PI) - crest
    if _may_hold_integer(begin, end):
        high = 1.0
    if _may_hold_integer(begin - 0.5, end - 0.5):
        low = -1.0
    return low, high


def _may_hold_integer(begin: arb, end: arb) -> bool:
    first, last = begin.lower().ceil(), end.upper().floor()
    return not first > last


def absolute(a: Interval) -> Interval:
    """All absolute values."""
    return _magnitudes(a)


def _magnitudes(a: Interval) -> Interval:
    low, high = abs(a[0]), abs(a[1])
    return (0.0 if a[0] <= 0.0 <= a[1] else min(low, high)), max(low, high)


def sign(a: Interval) -> Interval:
    """All signs; at zero every number between -1 and 1, as a switch that slides takes them (Filippov)."""
    return (1.0 if a[0] > 0.0 else -1.0), (-1.0 if a[1] < 0.0 else 1.0)


def maximum(a: Interval, b: Interval) -> Interval:
    """All larger ones of two."""
    return max(a[0], b[0]), max(a[1], b[1])


def atan2(y: Interval, x: Interval) -> Interval:
    """All angles of (x, y); over the cut, and at the origin, all of a turn."""
    over_cut, at_origin = x[0] < 0.0 and y[0] < 0.0 <= y[1], x[0] <= 0.0 <= x[1] and y[0] <= 0.0 <= y[1]
    if over_cut or at_origin:
        return WHOLE_TURN
    # The angle is monotone along each edge of a box that leaves out the cut and the origin.
    corners = [arb.atan2(arb(v), arb(u)) for v in y for u in x]
    return min(map(ball_below, corners)), max(map(ball_up, corners))


def select(t: Interval, below: Interval | None, above: Interval | None) -> Interval:
    """The second where the first is below zero, else the third; None is a piece without a bounded range."""
    pieces = [piece for piece, may_hold in ((below, t[0] < 0.0), (above, t[1] >= 0.0)) if may_hold]
    if None in pieces:
        raise NotEnclosed("a piece that may hold has no bounded range")
    ends = [end for piece in pieces if piece is not None for end in piece]
    return min(ends), max(ends)


def ball_below(value: arb) -> float:
    """The largest float that is not above any number of a ball."""
    return -ball_up(-value)


OPERATIONS: Mapping[Op, Callable[..., Interval]] = {
    Op.NEG: neg, Op.ADD: add, Op.SUB: sub, Op.MUL: mul, Op.SQR: sqr, Op.INV: inv, Op.SQRT: sqrt, Op.EXP: exp,
    Op.LOG: log, Op.SIN: sin, Op.COS: cos, Op.TANH: tanh, Op.ABS: absolute, Op.SIGN: sign, Op.SROOT: sroot,
    Op.MAX: maximum, Op.ATAN2: atan2, Op.SELECT: select, Op.DIV: div,
}  # fmt: skip


def applied(op: Op, *operands: Interval | None) -> Interval:
    """The range of an operation; of a piece that has none, None.

    Raises
    ------
    NotEnclosed
        If it is not bounded by floats.
    """
    low, high = OPERATIONS[op](*operands)
    if not (-_INF < low <= high < _INF):
        raise NotEnclosed("its range is beyond all floats")
    return low, high
