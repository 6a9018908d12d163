"""Each operation of a tape beside ball arithmetic of 300 bits: the referee of intervals and linear forms."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable

import numpy as np
from flint import arb, ctx

from svo.checks import Array
from svo.functions.expression import Expression, Recorder, variables
from svo.functions.operations import Op
from svo.functions.tape import Tape, Unenclosed

BITS = 300
POINTS = 6  # of each box
ALIKE = 3  # boxes of the same tape
KINDS = ("plain", "plain", "plain", "extreme", "extreme", "turn", "unit")
EXTREMES = (0.0, 5e-324, 2.3e-308, 1e-160, 1e-30, 1e17, 1e160, 1e300, 1.7e308)
OPERATIONS = [op for op in Op if op.operands and op is not Op.CONSTANT and op is not Op.VARIABLE]


def _sroot(s: arb) -> arb:
    return s.sqrt() if s >= 0 else -(-s).sqrt()


IN_BALLS: dict[Op, Callable[..., arb]] = {
    Op.NEG: lambda s: -s, Op.ADD: lambda s, t: s + t, Op.SUB: lambda s, t: s - t, Op.MUL: lambda s, t: s * t,
    Op.SQR: lambda s: s * s, Op.INV: lambda s: 1 / s, Op.SQRT: arb.sqrt, Op.EXP: arb.exp, Op.LOG: arb.log,
    Op.SIN: arb.sin, Op.COS: arb.cos, Op.TANH: arb.tanh, Op.ABS: abs, Op.SIGN: arb.sgn, Op.SROOT: _sroot,
    Op.MAX: lambda s, t: s if s >= t else t, Op.ATAN2: lambda y, x: arb.atan2(y, x),
    Op.SELECT: lambda t, s, r: s if t < 0 else r, Op.DIV: lambda s, t: s / t,
}  # fmt: skip


def draw_box(rng: np.random.Generator, kind: str) -> tuple[float, float]:
    """Ends of an interval: a point, narrow, wide, through zero or with an end there."""
    if kind == "extreme":
        low, high = sorted(float(v) for v in rng.choice(EXTREMES, 2) * rng.choice([-1.0, 1.0], 2))
    elif kind == "turn":  # a few doubles about a multiple of a quarter turn, or zero
        middle = (
            float(rng.integers(-(2 ** int(rng.integers(1, 53))), 2**52 // 2 ** int(rng.integers(0, 52)))) * math.pi / 2
        )
        step = math.ulp(middle) * 2.0 ** rng.integers(0, 30)
        low, high = middle - step * float(rng.integers(0, 3)), middle + step * float(rng.integers(0, 3))
    else:
        size = 2.0 ** float(rng.integers(-300, 301)) if kind == "unit" else 10.0 ** rng.uniform(-6, 6)
        middle = size * rng.choice([-1.0, 1.0])
        width = size * rng.choice([0.0, 1e-14, 1e-6, 0.03, 0.5, 1.0, 3.0])
        low, high = middle - width, middle + width
    if rng.uniform() < 0.3:
        low, high = (high, high) if rng.uniform() < 0.2 else (max(low, 0.0), max(high, 0.0))
    return low, high


def examine(op: Op, rng: np.random.Generator, boxes: int, points: int = POINTS) -> Counter[str]:
    """An operation of single variables, or of sums of two, over random boxes, at random points and corners of each."""
    count: Counter[str] = Counter()
    with ctx.workprec(BITS):
        for box in range(boxes):
            if box % ALIKE == 0:
                tape, arguments = _one(op, rng, summed=rng.uniform() < 0.5)
            kind = str(rng.choice(KINDS))
            ends = np.array([draw_box(rng, kind) for _ in range(tape.variables)])
            lower, upper = ends[:, 0].copy(), ends[:, 1].copy()
            try:
                tape.ranges(lower, upper)
                tape.forms(lower, upper, tape.variables)
            except Unenclosed:
                count["refused"] += 1
                continue
            count += _compare(op, tape, arguments, lower, upper, rng, points)
    return count


def _one(op: Op, rng: np.random.Generator, summed: bool) -> tuple[Tape, Array]:
    """A tape of the operation; its operands as rows of coefficients of the variables."""
    nz = op.operands + summed
    rows = np.eye(op.operands, nz)
    rows[:, -1] += summed * rng.choice([-1.0, 0.0, 0.5, 2.0], op.operands)
    recorder = Recorder()
    z = variables(recorder, 0, nz)
    operands: list[Expression] = []
    for row in rows:
        terms = [v * c for v, c in zip(z, row.tolist(), strict=True) if c]
        operands.append(sum(terms[1:], start=terms[0]))
    return Tape.of(recorder, [recorder.put(op, *operands)], nz), rows


def _compare(
    op: Op, tape: Tape, arguments: Array, lower: Array, upper: Array, rng: np.random.Generator, points: int
) -> Counter[str]:
    count: Counter[str] = Counter()
    (low,), (high,) = tape.ranges(lower, upper)
    forms = tape.forms(lower, upper, tape.variables)
    for point in range(points):
        share = rng.integers(0, 2, len(lower)) if point < 3 else rng.uniform(size=len(lower))
        z = np.clip((1.0 - share) * lower + share * upper, lower, upper)
        exact = [arb(v) for v in z.tolist()]
        rows = [zip(row, exact, strict=True) for row in arguments.tolist()]
        value = IN_BALLS[op](*(sum((arb(c) * v for c, v in row), arb(0)) for row in rows))
        if not value.is_finite():
            continue
        count["points"] += 1
        steps = zip(forms.g[0].tolist(), exact, forms.centre.tolist(), strict=True)
        rest = value - arb(float(forms.k[0])) - sum((arb(g) * (v - arb(c)) for g, v, c in steps), arb(0))
        count["outside the interval"] += int(value < low or value > high)
        count["outside the form's range"] += int(value < float(forms.lower[0]) or value > float(forms.upper[0]))
        count["outside the form"] += int(rest < float(forms.low[0]) or rest > float(forms.high[0]))
    return count
