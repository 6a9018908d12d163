"""The core's elementary functions beside balls of python-flint: hard arguments, and what an interval must contain."""

from __future__ import annotations

import ctypes
import math
import struct
from collections import Counter
from collections.abc import Callable, Iterable
from functools import cache

import numpy as np
from flint import arb, ctx

from polytopes.native import Real, function
from svo.checks import Array

BITS = 200
LARGEST = 1.7976931348623157e308


class Interval(ctypes.Structure):
    """The core's `fdi_interval`."""

    _fields_ = (("low", Real), ("high", Real))
    low: float
    high: float


UNARY = ("exp", "log", "sin", "cos", "tanh")
AT: dict[str, Callable[..., Interval]] = {
    **{name: function(f"fdi_{name}_at", Real, returns=Interval) for name in UNARY},
    "atan2": function("fdi_atan2_at", Real, Real, returns=Interval),
}
OVER: dict[str, Callable[..., Interval]] = {
    **{name: function(f"fdi_{name}_over", Interval, returns=Interval) for name in UNARY},
    "atan2": function("fdi_atan2_over", Interval, Interval, returns=Interval),
}
IN_BALLS: dict[str, Callable[..., arb]] = {
    **{name: getattr(arb, name) for name in UNARY},
    "atan2": arb.atan2,
}
SWITCHES = (
    1.0, math.sqrt(2.0), math.sqrt(0.5), math.pi, math.pi / 2, math.pi / 4, 0.785, math.log(2.0), math.log(2.0) / 2,
    19.0, 9.5, 2.0**-27, 2.0**-26, 709.782712893384, 708.3964185322641, 744.4400719213812, 745.2, 5e-324, 2.0**-1022,
    LARGEST, *(j / 16 for j in range(1, 17)),
)  # fmt: skip
"""Where a computation takes another branch, or comes to its end."""


def beside(x: float, count: int = 2) -> list[float]:
    """The double, and those next to it on both sides."""
    below, above = [x], [x]
    for _ in range(count):
        below.append(math.nextafter(below[-1], -math.inf))
        above.append(math.nextafter(above[-1], math.inf))
    return [v for v in {*below, *above} if math.isfinite(v)]


@cache
def nearest_to_quarter_turns() -> tuple[float, ...]:
    """Of each binade from 1 on, the doubles nearest to a multiple of pi/2: from continued fractions (Kahan 1983)."""
    with ctx.workprec(3000):
        ratios = [(e, 2 / arb.pi() * arb(2) ** e) for e in range(-52, 972)]
        return tuple(math.ldexp(q, e) for e, ratio in ratios for q in _denominators(ratio) if q >= 2**52)


def _denominators(value: arb) -> list[int]:
    """Of the convergents of a number, below 2^53."""
    before, last, found = 1, 0, []
    while True:
        whole = int(value.floor().unique_fmpz())
        before, last = last, whole * last + before
        if last >= 2**53:
            return found
        found.append(last)
        value = 1 / (value - whole)


def draw(name: str, rng: np.random.Generator, count: int) -> list[tuple[float, ...]]:
    """Arguments of a function: of any bits, of ordinary size, near a switch, and near multiples of pi/2."""
    columns = [_numbers(rng, count, name) for _ in range(2 if name == "atan2" else 1)]
    if name == "atan2":
        x = columns[1]
        near = rng.uniform(size=count) < 0.4  # quotients that are no further from one than a few binades
        ratio = rng.choice([-1.0, 1.0], count) * np.exp2(rng.uniform(-30, 30, count))
        columns[0] = np.where(near, np.clip(ratio * np.clip(x, -1e290, 1e290), -LARGEST, LARGEST), columns[0])
    return list(zip(*(column.tolist() for column in columns), strict=True))


def draw_worst(name: str, rng: np.random.Generator, count: int) -> list[tuple[float, ...]]:
    """Arguments at which the computed values are least accurate: furthest from the points of the tables."""
    size = np.where(rng.uniform(size=count) < 0.5, rng.uniform(0.03, 0.0625, count), rng.uniform(0.0625, 0.08, count))
    if name == "atan2":
        x = rng.uniform(1.0, 2.0, count)
        return list(zip((x * size).tolist(), x.tolist(), strict=True))
    values = {"log": np.sqrt(2.0) * np.exp2(rng.uniform(-0.1, 0.1, count)), "tanh": size / 2.0}.get(name, size)
    return [(v,) for v in values.tolist()]


def _numbers(rng: np.random.Generator, count: int, name: str) -> Array:
    kinds = [
        rng.integers(0, 2**64, count, dtype=np.uint64).view(np.float64),
        rng.choice([-1.0, 1.0], count) * np.exp2(rng.uniform(-40, 12, count)),
        rng.uniform(-800.0, 800.0, count),
        rng.choice([-1.0, 1.0], count) * rng.choice([v for s in SWITCHES for v in beside(s, 20)], count),
        rng.integers(-(2**30), 2**30, count) * (math.pi / 2),
    ]
    values = np.choose(rng.integers(0, len(kinds), count), kinds)
    values[~np.isfinite(values)] = LARGEST
    return np.abs(values) if name == "log" else values


def examine(name: str, arguments: Iterable[tuple[float, ...]]) -> Counter[str]:
    """How many values are outside of their intervals, and how many doubles apart the ends of these are."""
    count: Counter[str] = Counter()
    with ctx.workprec(BITS):
        for given in arguments:
            found, exact = AT[name](*given), IN_BALLS[name](*map(arb, given))
            if not exact.is_finite():
                continue  # where it has no value, or none of any size
            count["points"] += 1
            count["outside"] += is_outside(found, exact)
            count[f"{steps_between(found.low, found.high)} apart"] += 1
    return count


def is_outside(interval: Interval, exact: arb) -> bool:
    """Whether a number that a ball contains cannot be in the interval."""
    return bool(exact < arb(interval.low)) or bool(exact > arb(interval.high))


def steps_between(low: float, high: float) -> int:
    """How many steps from double to double lead from one to the other."""
    (first,), (last,) = (struct.unpack("<q", struct.pack("<d", v)) for v in (low, high))
    first, last = (v if v >= 0 else -(v + 2**63) for v in (first, last))
    return last - first
