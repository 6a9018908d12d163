"""Random tapes beside ball arithmetic: rows at random points of random boxes, inside the core's forms and ranges."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from flint import arb, ctx

from svo.checks import Array
from svo.functions.expression import Recorder, variables
from svo.functions.operations import Op
from svo.functions.tape import Tape, Unenclosed
from tests.svo.functions.operations_in_balls import BITS, IN_BALLS, OPERATIONS

POINTS = 8  # of each box
CONSTANTS = (0.1, 0.5, 1.0 / 3.0, 2.0, -1.0, 3.0, 1e-3, 40.0)


def draw_tape(rng: np.random.Generator) -> Tape:
    """Of a few variables, and slots that read any earlier ones."""
    nz, count = int(rng.integers(1, 5)), int(rng.integers(2, 14))
    recorder = Recorder()
    made: list[Any] = list(variables(recorder, 0, nz))
    while len(made) < nz + count:
        op = OPERATIONS[int(rng.integers(len(OPERATIONS)))]
        recent = made[-3:] if rng.random() < 0.6 else made
        of = [recent[int(rng.integers(len(recent)))], *rng.choice(np.array(made, dtype=object), op.operands - 1)]
        if op.operands > 1 and rng.random() < 0.3:
            of[-1] = recorder.constant(float(rng.choice(CONSTANTS)))
        made.append(recorder.put(op, *of))
    return Tape.of(recorder, made[-2:], nz)


def in_balls(tape: Tape, z: list[arb]) -> list[arb | None]:
    """The rows at a point; None where one has no value there, or one that 300 bits do not tell."""
    found: list[arb | None] = []
    for op, of, (low, high) in zip(tape.op.tolist(), tape.operands.tolist(), tape.constants.tolist(), strict=True):
        operands = [found[j] for j in of[: Op(op).operands]]
        value: arb | None = None
        if op == Op.VARIABLE:
            value = z[of[0]]
        elif op == Op.CONSTANT:
            value = arb(low).union(arb(high))
        elif op == Op.SELECT and operands[0] is not None:
            value = operands[1] if operands[0] < 0 else operands[2] if operands[0] >= 0 else None
        elif all(v is not None for v in operands) and (op != Op.MAX or _are_ordered(*operands)):
            value = IN_BALLS[Op(op)](*operands)
        found.append(value if value is not None and value.is_finite() else None)
    return [found[j] for j in tape.outputs.tolist()]


def _are_ordered(a: arb, b: arb) -> bool:
    return bool(a >= b) or bool(a < b)


def examine(rng: np.random.Generator, boxes: int, points: int = POINTS) -> Counter[str]:
    """Random tapes, each over a box."""
    count: Counter[str] = Counter()
    with ctx.workprec(BITS):
        for _ in range(boxes):
            tape = draw_tape(rng)
            middle = rng.normal(size=tape.variables) * 10.0 ** rng.integers(-2, 2)
            width = np.abs(rng.normal(size=tape.variables)) * rng.choice([0.0, 1e-12, 1e-3, 0.1, 1.0])
            lower, upper = middle - width, middle + width
            free = int(rng.integers(0, tape.variables + 1))
            lower[free:] = upper[free:]  # known ones, as inputs are
            try:
                forms = tape.forms(lower, upper, free)
                ranges = tape.ranges(lower, upper)
            except Unenclosed:
                count["refused"] += 1
                continue
            for point in range(points):
                share = rng.integers(0, 2, len(lower)) if point < 3 else rng.uniform(size=len(lower))
                _compare(tape, forms, ranges, np.clip((1.0 - share) * lower + share * upper, lower, upper), count)
    return count


def _compare(tape: Tape, forms: Any, ranges: tuple[Array, Array], z: Array, count: Counter[str]) -> None:
    exact = [arb(v) for v in z.tolist()]
    for row, value in enumerate(in_balls(tape, exact)):
        if value is None:
            continue
        count["points"] += 1
        terms = zip(forms.g[row].tolist(), exact, forms.centre.tolist(), strict=False)
        rest = value - arb(float(forms.k[row])) - sum((arb(g) * (v - arb(c)) for g, v, c in terms), arb(0))
        for what, of, low, high in (
            ("interval", value, ranges[0], ranges[1]),
            ("form's range", value, forms.lower, forms.upper),
            ("form", rest, forms.low, forms.high),
        ):
            count[f"outside the {what}"] += bool(of < float(low[row]) or of > float(high[row]))
