"""Secants: of a function phi on [a, b] a slope q, a float, and an interval that contains phi(s) - q s for all s there.

Any slope would be sound, so slopes are computed in floats; what they leave out is bounded with outward rounding. A
chord and the parallel tangent enclose a convex or concave function (Chebyshev's slope, as in affine arithmetic: de
Figueiredo and Stolfi, Numerical Algorithms 37 (2004)); sin and cos take one-sided bounds of second order; what bends
both ways, the signed root and tanh, takes the slope that leaves out least.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from flint import arb

from polytopes.exact import ball_up
from svo.functions.operations import Op
from tests.svo.functions.oracle.intervals import Interval, add, applied, ball_below, down, inv, mul, neg, sqr, sub, up

_GOLDEN = 0.6180339887498949
_PIECE = 0.25  # of a wide argument of sin and cos
_NEAR = 1e-7  # relative width of [a, b] below which a chord's slope is lost to rounding


class Secant(NamedTuple):
    """phi(s) - slope s in rest, and phi(s) in range, for all s of an interval."""

    slope: float
    rest: Interval
    range: Interval


def secant(op: Op, a: Interval) -> Secant:
    """The secant of an operation of one operand.

    Raises
    ------
    NotEnclosed
        If its range is not bounded by floats.
    """
    values = applied(op, a)
    slope, rest = _RULES[op](a, values)
    if not (math.isfinite(slope) and -math.inf < rest[0] <= rest[1] < math.inf):
        return Secant(0.0, values, values)
    return Secant(slope, rest, values)


Rule = Callable[[Interval, Interval], tuple[float, Interval]]


def _at(op: Op, q: float, s: float) -> Interval:
    """phi(s) - q s."""
    return sub(applied(op, (s, s)), mul((q, q), (s, s)))


def _convex(op: Op, a: Interval, q: float, least: float) -> tuple[float, Interval]:
    """Of a convex function whose phi(s) - q s is at least so much everywhere."""
    return q, (least, max(_at(op, q, a[0])[1], _at(op, q, a[1])[1]))


def _concave(op: Op, a: Interval, q: float, most: float) -> tuple[float, Interval]:
    return q, (min(_at(op, q, a[0])[0], _at(op, q, a[1])[0]), most)


def _chord(a: Interval, values: Interval, derivative: Callable[[float], float]) -> float:
    """Slope of an increasing function's chord."""
    middle = 0.5 * a[0] + 0.5 * a[1]
    is_near = a[1] - a[0] <= _NEAR * max(abs(a[0]), abs(a[1]))
    return derivative(middle) if is_near else (values[1] - values[0]) / (a[1] - a[0])


def _sqr(a: Interval, values: Interval) -> tuple[float, Interval]:
    q = a[0] + a[1]
    return _convex(Op.SQR, a, q, -mul((0.25, 0.25), sqr((q, q)))[1])


def _sqrt(a: Interval, values: Interval) -> tuple[float, Interval]:
    total = values[0] + values[1]
    if total <= 1e-160:
        return 0.0, values
    return _concave(Op.SQRT, a, q := 1.0 / total, mul((0.25, 0.25), inv((q, q)))[1])


def _exp(a: Interval, values: Interval) -> tuple[float, Interval]:
    q = _chord(a, values, math.exp)
    if q <= 0.0:
        return 0.0, values
    return _convex(Op.EXP, a, q, ball_below(arb(q) * (1 - arb(q).log())))


def _log(a: Interval, values: Interval) -> tuple[float, Interval]:
    q = _chord(a, values, lambda s: 1.0 / s)
    return _concave(Op.LOG, a, q, ball_up(-arb(q).log() - 1))


def _inv(a: Interval, values: Interval) -> tuple[float, Interval]:
    if a[1] < 0.0:
        q, rest = _inv(neg(a), neg(values))
        return q, neg(rest)
    q = -(1.0 / a[0]) * (1.0 / a[1])
    if not 1e-300 < -q < math.inf:
        return 0.0, values
    return _convex(Op.INV, a, q, ball_below(2 * arb(-q).sqrt()))


def _abs(a: Interval, values: Interval) -> tuple[float, Interval]:
    if a[0] >= 0.0 or a[1] <= 0.0:
        return (1.0 if a[0] >= 0.0 else -1.0), (0.0, 0.0)
    q = (a[1] + a[0]) / (a[1] - a[0])
    low, high = _at(Op.ABS, q, a[0]), _at(Op.ABS, q, a[1])
    return q, (min(0.0, low[0], high[0]), max(0.0, low[1], high[1]))


def _sign(a: Interval, values: Interval) -> tuple[float, Interval]:
    return 0.0, values


def _sroot(a: Interval, values: Interval) -> tuple[float, Interval]:
    if a[0] >= 0.0:
        return _sqrt(a, values)
    if a[1] <= 0.0:
        q, rest = _sqrt(neg(a), neg(values))
        return q, neg(rest)
    largest = math.sqrt(max(-a[0], a[1]))
    if largest <= 1e-150:
        return 0.0, values
    # Between the chord's slope and the steepest that helps; 1.2071 / sqrt(d) is best on [-d, d].
    return _narrowest(lambda q: _signed_root_rest(a, q), 0.5 / largest, 1.7 / largest)


def _narrowest(rest: Callable[[float], Interval], low: float, high: float) -> tuple[float, Interval]:
    """The slope with the narrowest rest, whose width is a convex function of the slope: golden sections."""
    p, q = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_p, at_q = rest(p), rest(q)
    for _ in range(10):
        if _width(at_p) < _width(at_q):
            high, q, at_q = q, p, at_p
            p = high - _GOLDEN * (high - low)
            at_p = rest(p)
        else:
            low, p, at_p = p, q, at_q
            q = low + _GOLDEN * (high - low)
            at_q = rest(q)
    return (p, at_p) if _width(at_p) < _width(at_q) else (q, at_q)


def _signed_root_rest(a: Interval, q: float) -> Interval:
    """Rest of the signed root over an interval around zero: extremes at its ends and at s = +-1 / (4 q^2)."""
    low, high = _at(Op.SROOT, q, a[0]), _at(Op.SROOT, q, a[1])
    peak = mul((0.25, 0.25), inv((q, q)))[1]
    turn = down(0.25 / up(q * q))  # not above the point of the peak
    least = -peak if -a[0] > turn else 0.0
    most = peak if a[1] > turn else 0.0
    return min(least, low[0], high[0]), max(most, low[1], high[1])


def _tanh(a: Interval, values: Interval) -> tuple[float, Interval]:
    chord = _chord(a, values, lambda s: 1.0 / math.cosh(min(abs(s), 300.0)) ** 2)
    if not a[0] < 0.0 < a[1]:  # it bends one way
        return chord, _tanh_rest(a, chord)
    q, rest = _narrowest(lambda q: _tanh_rest(a, q), 0.0, 1.0)
    return (q, rest) if _width(rest) < _width(values) else (0.0, values)


def _tanh_rest(a: Interval, q: float) -> Interval:
    """Rest of tanh: extremes at the ends and where its derivative is q."""
    low, high = _at(Op.TANH, q, a[0]), _at(Op.TANH, q, a[1])
    least, most = min(low[0], high[0]), max(low[1], high[1])
    if 0.0 < q < 1.0:
        slow = (1 - arb(q)).sqrt()
        turn = slow.atanh()
        peak = ball_up(slow - arb(q) * turn)
        if not math.isfinite(peak):  # q is too small to say where
            return -math.inf, math.inf
        most = max(most, peak) if not (turn > a[1] or turn < a[0]) else most
        least = min(least, -peak) if not (-turn > a[1] or -turn < a[0]) else least
    return least, most


def _sin(a: Interval, values: Interval) -> tuple[float, Interval]:
    m = arb(middle := 0.5 * a[0] + 0.5 * a[1])
    return _narrower(a, Op.SIN, _second_order(a, values, middle, m.sin(), m.cos(), neg(values)))


def _cos(a: Interval, values: Interval) -> tuple[float, Interval]:
    m = arb(middle := 0.5 * a[0] + 0.5 * a[1])
    return _narrower(a, Op.COS, _second_order(a, values, middle, m.cos(), -m.sin(), neg(values)))


def _narrower(a: Interval, op: Op, one: tuple[float, Interval]) -> tuple[float, Interval]:
    """Second order on each of many pieces of a wide interval, where that is narrower."""
    width = a[1] - a[0]
    if not (0.5 < width <= 32 * _PIECE and max(abs(a[0]), abs(a[1])) < 2.0**30):
        return one
    count = math.ceil(width / _PIECE)
    step = width / count
    reach = up(0.5 * step + 4.0 * 2.0**-52 * max(abs(a[0]), abs(a[1])))
    half = mul((0.5, 0.5), sqr((reach, reach)))[1]
    parts = []
    for i in range(count):
        c = a[0] + (i + 0.5) * step
        sine, cosine = applied(Op.SIN, (c, c)), applied(Op.COS, (c, c))
        value, slope = (sine, cosine) if op is Op.SIN else (cosine, neg(sine))
        parts.append((c, value, slope, mul((0.0, half), neg(add(value, (-reach, reach))))))

    def rest(q: float) -> Interval:
        ends = []
        for c, value, slope, bend in parts:
            tilt = up(max(map(abs, sub(slope, (q, q)))) * reach)
            ends += add(add(sub(value, mul((q, q), (c, c))), (-tilt, tilt)), bend)
        return min(ends), max(ends)

    many = _narrowest(rest, -1.0, 1.0)
    return many if _width(many[1]) < _width(one[1]) else one


def _second_order(
    a: Interval, values: Interval, middle: float, value: arb, slope: arb, bend: Interval
) -> tuple[float, Interval]:
    """From value and slope at the middle and a range of the second derivative; the range alone where it is narrower."""
    q = float(slope.mid())
    off = slope - arb(q)
    reach = up(max(a[1] - middle, middle - a[0]))
    tilt = mul((-reach, reach), (ball_below(off), ball_up(off)))
    curve = mul((0.0, mul((0.5, 0.5), sqr((reach, reach)))[1]), bend)
    anchor = value - arb(q) * arb(middle)
    rest = add(add((ball_below(anchor), ball_up(anchor)), tilt), (min(0.0, curve[0]), max(0.0, curve[1])))
    return (q, rest) if _width(rest) < _width(values) else (0.0, values)


def _width(rest: Interval) -> float:
    return rest[1] - rest[0]


_RULES: Mapping[Op, Rule] = {
    Op.SQR: _sqr, Op.SQRT: _sqrt, Op.EXP: _exp, Op.LOG: _log, Op.INV: _inv, Op.ABS: _abs, Op.SIGN: _sign,
    Op.SROOT: _sroot, Op.TANH: _tanh, Op.SIN: _sin, Op.COS: _cos,
}  # fmt: skip
