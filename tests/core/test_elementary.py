"""The core's elementary functions: intervals that contain what balls give, at every argument, and are narrow."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from flint import arb, ctx

from tests.core.compiler import CORE
from tests.core.elementary_in_balls import (
    AT,
    BITS,
    IN_BALLS,
    LARGEST,
    OVER,
    SWITCHES,
    UNARY,
    Interval,
    beside,
    draw,
    draw_worst,
    examine,
    is_outside,
    nearest_to_quarter_turns,
    steps_between,
)
from tests.svo.functions.oracle import intervals

INF = math.inf
TINY = 5e-324


def ends(interval: Interval) -> tuple[float, float]:
    return interval.low, interval.high


@pytest.mark.parametrize("name", AT)
def test_a_value_is_inside_and_the_ends_are_at_most_two_doubles_apart(name: str) -> None:
    count = examine(name, draw(name, np.random.default_rng([3, *name.encode()]), 12_000))
    assert count["points"] > 10_000
    assert count["outside"] == 0
    assert count["1 apart"] > 0.8 * count["points"]
    most = {"exp": 4, "atan2": 3}.get(name, 2)
    assert {what for what in count if "apart" in what} <= {f"{k} apart" for k in range(most + 1)}


@pytest.mark.parametrize("name", AT)
def test_a_value_is_inside_where_rounding_is_worst(name: str) -> None:
    assert examine(name, draw_worst(name, np.random.default_rng([9, *name.encode()]), 12_000))["outside"] == 0


@pytest.mark.parametrize("name", AT)
def test_beside_the_arguments_at_which_another_branch_begins(name: str) -> None:
    numbers = [sign * v for s in SWITCHES for v in beside(s, 3) for sign in (1.0, -1.0) if name != "log" or sign > 0]
    if name == "atan2":
        arguments = [(y, x) for y in numbers for x in (1.0, -1.0, 0.7, 1e-300, 1e300)]
        arguments += [(y, y * (1.0 + 2.0**-52)) for y in numbers if abs(y) < LARGEST]
    else:
        arguments = [(v,) for v in numbers]
    assert examine(name, arguments)["outside"] == 0


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_beside_multiples_of_a_quarter_turn(name: str) -> None:
    count = examine(name, ((sign * v,) for x in nearest_to_quarter_turns() for v in beside(x) for sign in (1.0, -1.0)))
    assert count["points"] > 6000
    assert count["outside"] == 0
    assert count["1 apart"] + count["2 apart"] == count["points"]


def test_no_double_is_within_2_to_the_minus_62_of_whole_quarter_turns() -> None:
    """The premise of the reduction: below, two of its words could be zero. From 1 on; below it there is no multiple."""
    with ctx.workprec(1300):
        quarters = [arb(x) * 2 / arb.pi() for x in nearest_to_quarter_turns()]
        distance = [float(abs(q - (q + 0.5).floor())) for q in quarters]
    assert len(distance) > 600
    assert 2.0**-62 < min(distance) < 2.0**-60


@pytest.mark.parametrize("name", ["exp", "log"])
def test_ordinary_arguments_of_each_binade(name: str) -> None:
    exponents = np.repeat(np.arange(-1074, 1024), 3)
    rng = np.random.default_rng(5)
    x = np.ldexp(rng.uniform(1.0, 2.0, len(exponents)), exponents)
    assert examine(name, zip(x.tolist()))["outside"] == 0


def test_exact_values_are_points() -> None:
    assert ends(AT["exp"](0.0)) == (1.0, 1.0)
    assert ends(AT["log"](1.0)) == ends(AT["sin"](-0.0)) == ends(AT["tanh"](0.0)) == (0.0, 0.0)
    assert ends(AT["cos"](0.0)) == (1.0, 1.0)
    for x in (TINY, 1.0, LARGEST):
        assert ends(AT["atan2"](0.0, x)) == ends(AT["atan2"](-0.0, x)) == (0.0, 0.0)
        pi, half = math.pi, math.pi / 2
        assert ends(AT["atan2"](0.0, -x)) == ends(AT["atan2"](-0.0, -x)) == (pi, math.nextafter(pi, 4.0))
        assert ends(AT["atan2"](x, 0.0)) == (half, math.nextafter(half, 4.0))
        assert ends(AT["atan2"](-x, -0.0)) == (-math.nextafter(half, 4.0), -half)


@pytest.mark.parametrize("x", [TINY, 2.0**-1022, 1e-200, 2.0**-500, 2.0**-60, 2.0**-28, math.nextafter(2.0**-27, 0.0)])
def test_small_arguments(x: float) -> None:
    """0 < x - x^3/3 < tanh x, sin x < x."""
    for name in ("sin", "tanh"):
        assert ends(AT[name](x)) == (math.nextafter(x, 0.0), x)
        assert ends(AT[name](-x)) == (-x, -math.nextafter(x, 0.0))
    low, high = ends(AT["exp"](x))
    assert low <= 1.0 + x <= high <= 1.0 + x + 2.0**-51
    assert high > 1.0
    assert ends(AT["exp"](-x))[0] < 1.0
    assert ends(AT["cos"](x))[0] < 1.0 == ends(AT["cos"](x))[1]
    low, high = ends(AT["atan2"](x, 1.0))
    assert low < x <= high


def test_what_is_beyond_doubles() -> None:
    last = 709.782712893384
    assert ends(AT["exp"](last))[1] < INF
    for x in (math.nextafter(last, INF), 710.0, LARGEST, INF):
        assert ends(AT["exp"](x)) == (LARGEST, INF)
    for x in (-745.3, -800.0, -LARGEST, -INF):
        assert ends(AT["exp"](x)) == (0.0, TINY)
    low, high = ends(AT["exp"](-745.1))
    assert 0.0 <= low <= TINY <= high <= 4 * TINY
    for x in (0.0, -0.0, -TINY, -1.0, INF, math.nan):
        assert ends(AT["log"](x)) == (-INF, INF)
    for name in ("sin", "cos"):
        for x in (INF, -INF, math.nan):
            assert ends(AT[name](x)) == (-1.0, 1.0)
    for x in (19.0, 1e300, INF):
        assert ends(AT["tanh"](x)) == (math.nextafter(1.0, 0.0), 1.0)
    assert ends(AT["tanh"](math.nan)) == (-1.0, 1.0)
    assert ends(AT["exp"](math.nan)) == (-INF, INF)
    for y, x in ((0.0, 0.0), (-0.0, -0.0), (math.nan, 1.0), (1.0, INF)):
        assert ends(AT["atan2"](y, x)) == intervals.WHOLE_TURN


def test_the_sides_of_an_angle_are_those_of_its_mirror_images() -> None:
    rng = np.random.default_rng(8)
    for y, x in np.exp2(rng.uniform(-400, 400, (200, 2))).tolist():
        low, high = ends(AT["atan2"](y, x))
        assert ends(AT["atan2"](-y, x)) == (-high, -low)
    for x in rng.uniform(-1e6, 1e6, 200).tolist():
        for name in ("sin", "tanh"):
            low, high = ends(AT[name](x))
            assert ends(AT[name](-x)) == (-high, -low)
        assert ends(AT["cos"](x)) == ends(AT["cos"](-x))


def drawn_range(rng: np.random.Generator) -> tuple[float, float]:
    middle = rng.choice([0.0, rng.uniform(-30.0, 30.0), rng.choice(SWITCHES[:13]), 1e6 * rng.normal()])
    width = rng.choice([0.0, 1e-14, 1e-3, 1.0, math.pi / 2, math.pi, 5.0, 2.0 * math.pi, 20.0]) * rng.uniform(0.9, 1.1)
    low, high = middle - 0.5 * width, middle + 0.5 * width
    kind = rng.integers(0, 6)
    return (0.0, high - low) if kind == 0 else (low - high, 0.0) if kind == 1 else (low, high)


@pytest.mark.parametrize("name", UNARY)
def test_a_range_is_that_of_balls(name: str) -> None:
    rng, python = np.random.default_rng([4, *name.encode()]), getattr(intervals, name)
    with ctx.workprec(BITS):
        for _ in range(1500):
            low, high = drawn_range(rng)
            if name == "log":
                low, high = abs(low) + 1e-300, abs(low) + 1e-300 + (high - low)
            if name == "exp":
                low, high = max(min(low, 700.0), -700.0), max(min(high, 700.0), -700.0)
            _same(ends(OVER[name](Interval(low, high))), python((low, high)))


def test_a_range_of_angles_is_that_of_balls() -> None:
    rng = np.random.default_rng(6)
    with ctx.workprec(BITS):
        for _ in range(3000):
            y, x = drawn_range(rng), drawn_range(rng)
            _same(ends(OVER["atan2"](Interval(*y), Interval(*x))), intervals.atan2(y, x))


def _same(ours: tuple[float, float], best: tuple[float, float]) -> None:
    """No end is inside of the best ends that are doubles, or three doubles outside; or a hair below an extreme."""
    below, above = steps_between(ours[0], best[0]), steps_between(best[1], ours[1])
    assert 0 <= below <= 3 or ours[0] == -1.0 < best[0] < -1.0 + 2e-6, (ours, best)
    assert 0 <= above <= 3 or ours[1] == 1.0 > best[1] > 1.0 - 2e-6, (ours, best)


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_extremes_inside_a_range_of_any_size_are_found(name: str) -> None:
    """Ranges that end one double on either side of a multiple of pi/2, up to the largest doubles."""
    with ctx.workprec(BITS):
        for x in nearest_to_quarter_turns():
            low, high = beside(x, 1)[1], beside(x, 1)[2]
            low, high = sorted((low, high))
            found = OVER[name](Interval(low, high))
            if high - low < 2e-3:
                assert ends(found)[1] - ends(found)[0] < 1.1 * (high - low)
            for share in (0.0, 0.3, 0.5, 0.9, 1.0):
                assert not is_outside(found, IN_BALLS[name](arb(low) + arb(share) * (arb(high) - arb(low))))


def test_a_range_without_an_end_is_everything() -> None:
    for low, high in ((-INF, INF), (0.0, INF), (math.nan, 1.0), (0.0, math.nan), (-LARGEST, LARGEST)):
        for name in ("sin", "cos"):
            assert ends(OVER[name](Interval(low, high))) == (-1.0, 1.0)
    assert ends(OVER["log"](Interval(0.0, 1.0))) == (-INF, INF)
    assert ends(OVER["exp"](Interval(-1.0, 710.0)))[1] == INF


def hexadecimals(file: str, name: str) -> list[float]:
    """All hexadecimal floats, and the 0.0 and 1.0, of a table in a file of the core."""
    text = (CORE / "tape" / file).read_text("utf-8").partition(f" {name}")[2].partition(";")[0]
    return [float.fromhex(v) for v in re.findall(r"-?0x[\d.a-f]+p[+-]\d+|(?<=[{ ])[01]\.0(?=[,}])", text)]


@pytest.mark.parametrize(
    ("file", "name", "values"),
    [
        ("exponential.c", "TABLE[]", lambda e: [(arb(j) / e).exp() for j in range(-3, 4)]),
        ("waves.c", "TABLE[][2]", lambda e: [f(arb(j) / e) for j in range(7) for f in (arb.sin, arb.cos)]),
        ("angle.c", "TABLE[]", lambda e: [(arb(j) / e).atan() for j in range(9)]),
        ("angle.c", "HALF_TURN", lambda _: [arb.pi()]),
        ("angle.c", "QUARTER_TURN", lambda _: [arb.pi() / 2]),
        ("quarter_turns.c", "HALF_PI", lambda _: [arb.pi() / 2]),
    ],
)
def test_tables_are_pairs_within_2_to_the_minus_105(file: str, name: str, values) -> None:
    with ctx.workprec(BITS):
        exact, found = values(8), hexadecimals(file, name)
        assert len(found) == 2 * len(exact)
        for value, high, low in zip(exact, found[::2], found[1::2], strict=True):
            assert abs(value - arb(high) - arb(low)) <= abs(value) * arb(2) ** -105


def test_the_logarithm_of_two_is_split_exactly() -> None:
    with ctx.workprec(BITS):
        for file in ("exponential.c", "logarithm.c"):
            (high,), (low,) = hexadecimals(file, "LN2_HIGH"), hexadecimals(file, "LN2_LOW")
            assert abs(arb(2).log() - arb(high) - arb(low)) <= arb(2) ** -86
            for part in (high, low):
                assert (1074 * int(math.ldexp(part, 85))).bit_length() <= 96
                assert all(math.fmod(k * part, part) == 0.0 for k in (1, 1074, 1023, 700))


def test_the_words_of_two_over_pi() -> None:
    text = (CORE / "tape/quarter_turns.c").read_text("utf-8").partition("TWO_OVER_PI[]")[2].partition(";")[0]
    words = [int(word, 16) for word in re.findall(r"0x[\da-f]{8}", text)]
    with ctx.workprec(1500):
        exact = int((2 / arb.pi() * arb(2) ** (32 * (len(words) - 2))).floor().unique_fmpz())
    assert words[:2] == [0, 0]
    assert sum(word << 32 * i for i, word in enumerate(reversed(words))) == exact
    assert len(words) == (2046 - 1075 + 62) // 32 + 7  # as many as the largest double needs
