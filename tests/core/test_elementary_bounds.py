"""The error bounds of `core/tape/README.md`, derived again operation by operation in ball arithmetic.

Each operation adds 2^-53 of its result; everything before the last rounded terms is exact or of the order of 2^-75.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import pytest
from flint import arb, ctx

from tests.core.compiler import CORE
from tests.mutation.plugin import defined

UNIT = arb(2) ** -53
PIECES = 24  # of a binade
STEP = 0.0625 * (1.0 + 2.0**-50)


@dataclass(frozen=True)
class Computed:
    """What is meant, and by how much what is computed may miss it."""

    meant: arb
    error: arb

    @staticmethod
    def number(value: arb | float) -> Computed:
        """A constant, rounded to a double."""
        meant = arb(value)
        return Computed(meant, abs(meant - arb(float(meant))) if not isinstance(value, float) else arb(0))

    def rounded(self) -> Computed:
        return Computed(self.meant, self.error + UNIT * (abs(self.meant) + self.error))

    def __add__(self, other: Computed) -> Computed:
        return Computed(self.meant + other.meant, self.error + other.error).rounded()

    def __mul__(self, other: Computed) -> Computed:
        errors = abs(self.meant) * other.error + abs(other.meant) * self.error + self.error * other.error
        return Computed(self.meant * other.meant, errors).rounded()


def exact(value: arb) -> Computed:
    """What is a double, or a pair, itself."""
    return Computed(value, arb(0))


def horner(x: Computed, coefficients: Sequence[arb]) -> Computed:
    *rest, last = map(Computed.number, coefficients)
    total = last
    for coefficient in reversed(rest):
        total = coefficient + x * total
    return total


def reciprocals(numbers: Sequence[int], alternating: bool = False) -> list[arb]:
    return [(-1 if alternating and i % 2 else 1) / arb(n) for i, n in enumerate(numbers)]


def factorials(first: int, step: int, last: int) -> list[int]:
    return [math.factorial(n) for n in range(first, last + 1, step)]


def exp_beyond(d: Computed) -> Computed:
    return d * d * horner(d, reciprocals(factorials(2, 1, 10)))


def atanh_beyond(s: Computed) -> Computed:
    return exact(2 * s.meant) * (s * s) * horner(s * s, reciprocals(range(3, 24, 2)))


def sin_beyond(d: Computed) -> Computed:
    return d * (d * d) * horner(d * d, reciprocals(factorials(3, 2, 9), alternating=True))


def cos_beyond(d: Computed) -> Computed:
    return d * d * horner(d * d, reciprocals(factorials(2, 2, 10), alternating=True))


def atan_beyond(t: Computed) -> Computed:
    return t * (t * t) * horner(t * t, reciprocals(range(3, 16, 2), alternating=True))


def relative(term: Computed, result: arb) -> float:
    """Of a result, in units of 2^-53: the error of its last term, and of its sum with rests that are exact."""
    total = term + Computed(result * arb(2) ** -49, arb(0))
    return float((total.error / abs(result) / UNIT).upper())


def pieces(low: float, high: float) -> Iterator[arb]:
    """Balls that together cover low .. high, of a small part of a binade each."""
    count = math.ceil(PIECES * math.log2(high / low))
    ends = [low * (high / low) ** (i / count) for i in range(count + 1)]
    for a, b in pairwise(ends):
        yield arb(a).union(arb(b))


def steps(j: int) -> Iterator[arb]:
    """d of the j-th point of a table: of either sign, of the first one downwards in proportion."""
    for d in pieces(2.0**-28 if j == 0 else 2.0**-12, STEP):
        yield d
        if j:
            yield -d


def exp_errors() -> Iterator[float]:
    for d in steps(1):
        yield relative(Computed.number(1.0) * exp_beyond(exact(d)), d.exp())


def tanh_errors() -> Iterator[float]:
    """Of e^2x - 1, whose error is at least that of the quotient."""
    for d in steps(0):
        yield relative(exp_beyond(exact(d)), d)
    for j in range(1, 4):
        for d in steps(j):
            yield relative(exact((arb(j) / 8).exp()) * exp_beyond(exact(d)), (arb(j) / 8 + d).exp() - 1)
    for d in steps(1):  # beyond r = ln 2 / 2 the result is least, and the error largest in proportion, at r = -ln 2 / 2
        yield relative(exact((arb(-3) / 8).exp()) * exp_beyond(exact(d)), arb("0.7071") - 0.5)


def log_errors() -> Iterator[float]:
    """Beside what is a multiple of ln 2 too, the result is at least 0.3465."""
    for s in pieces(2.0**-28, 0.1716):
        yield relative(atanh_beyond(exact(s)), 2 * s if s < 0.17 else arb("0.3465"))


def wave_errors() -> Iterator[float]:
    for j in range(7):
        sine, cosine = (arb(j) / 8).sin(), (arb(j) / 8).cos()
        for d in steps(j):
            risen, fallen = sin_beyond(exact(d)), cos_beyond(exact(d))
            yield relative(exact(sine) * fallen + exact(cosine) * risen if j else risen, (arb(j) / 8 + d).sin())
            yield relative(exact(cosine) * fallen + exact(sine) * risen, (arb(j) / 8 + d).cos())


def angle_errors() -> Iterator[float]:
    for j in range(9):
        for t in steps(j):
            yield relative(atan_beyond(exact(t)), (arb(j) / 8).atan() + t.atan())


BOUNDS = {
    "exponential.c:EXP": (exp_errors, 0.011),
    "exponential.c:TANH": (tanh_errors, 0.17),
    "logarithm.c:LOG": (log_errors, 0.056),
    "waves.c:WAVE": (wave_errors, 0.026),
    "angle.c:ANGLE": (angle_errors, 0.0074),
}


@pytest.mark.parametrize("name", BOUNDS)
def test_the_constant_is_above_what_rounding_can_do(name: str) -> None:
    errors, written = BOUNDS[name]
    file, _, function = name.partition(":")
    constant = float.fromhex(defined(f"core/tape/{file}", f"{function}_ERROR")) * 2.0**53
    with ctx.workprec(120):
        worst = max(errors())
    print(name, worst, constant)
    assert 0.5 * written < worst <= written < 0.9 * constant
    assert f"{written:g}" in (CORE / "tape/README.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("polynomial", "function", "result", "end"),
    [
        (exp_beyond, lambda d: d.exp() - 1 - d, arb.exp, -STEP),
        (exp_beyond, lambda d: d.exp() - 1 - d, arb.exp, STEP),
        (exp_beyond, lambda d: d.exp() - 1 - d, lambda d: d, STEP),
        (atanh_beyond, lambda s: 2 * (s.atanh() - s), lambda s: 2 * s, 0.1716),
        (sin_beyond, lambda d: d - d.sin(), lambda d: d, STEP),
        (cos_beyond, lambda d: 1 - d.cos(), lambda _: arb(1), STEP),
        (atan_beyond, lambda t: t - t.atan(), lambda t: t, STEP),
    ],
)
def test_series_end_where_their_rest_does_not_count(
    polynomial: Callable[[Computed], Computed],
    function: Callable[[arb], arb],
    result: Callable[[arb], arb],
    end: float,
) -> None:
    """At the end of their range: what is left out rises, in proportion too, with every power in it."""
    with ctx.workprec(120):
        x = arb(end)
        assert abs(polynomial(exact(x)).meant - function(x)) < abs(result(x)) * arb(2) ** -64
