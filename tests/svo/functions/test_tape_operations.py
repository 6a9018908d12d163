"""Tapes: every operation contains what ball arithmetic gives, and keeps what its rule promises."""

from __future__ import annotations

import numpy as np
import pytest

from svo import functions as F
from svo.functions.expression import Recorder, variables
from svo.functions.operations import Op
from svo.functions.tape import Tape, Unenclosed
from tests.svo.functions.operations_in_balls import OPERATIONS, examine


def traced(function, n: int) -> Tape:
    recorder = Recorder()
    rows = function(variables(recorder, 0, n))
    return Tape.of(recorder, [recorder.constant(row) for row in rows], n)


def over(tape: Tape, lower, upper):
    return tape.forms(np.array(lower, dtype=float), np.array(upper, dtype=float), tape.variables)


@pytest.mark.parametrize("op", OPERATIONS)
def test_an_operation_contains_what_balls_give(op: Op) -> None:
    count = examine(op, np.random.default_rng([7, op]), 120)
    assert count["points"] > 100
    assert not {what: n for what, n in count.items() if what.startswith("outside")}


@pytest.mark.parametrize(
    ("function", "lower", "upper", "half_width"),
    [
        (F.sqrt, 1.0, 3.0, 0.0245),
        (F.abs, -0.5, 1.5, 0.375),
        (F.sroot, -4.0, 4.0, 0.2071 * 2.0),
        (lambda s: s * s, -1.0, 1.0, 0.5),
        (F.tanh, -5.0, 5.0, 0.76),
        (lambda s: F.max(s, 0.0), -1.0, 1.0, 0.25),
    ],
)
def test_a_secant_leaves_out_no_more_than_it_must(function, lower, upper, half_width) -> None:
    form = over(traced(lambda z: [function(z[0])], 1), [lower], [upper])
    assert 0.5 * (form.high[0] - form.low[0]) <= half_width * 1.005


def test_one_reads_the_other() -> None:
    """sign(e) sqrt(|e|) is the signed root, with constants and other factors in between too."""
    plain = over(traced(lambda z: [3.0 * F.sroot(1962.0 * (z[0] - z[1]))], 2), [1, 1], [2, 2])
    for written in (
        lambda e: 3.0 * F.sign(e) * F.sqrt(1962.0 * F.abs(e)),
        lambda e: F.sqrt(abs(e) * 1962.0) * (F.sign(e) * 3.0),
        lambda e: F.sign(e) * (3.0 * F.sqrt(1962.0 * abs(e))),
        lambda e: 3.0 * F.sign(e) * F.sqrt(2.0 * (981.0 * abs(e))),
        lambda e: F.sqrt(3924.0 * abs(e) / 2.0) * F.sign(e) * 3.0,
    ):
        form = over(traced(lambda z, written=written: [written(z[0] - z[1])], 2), [1, 1], [2, 2])
        assert form.high[0] - form.low[0] == pytest.approx(plain.high[0] - plain.low[0], rel=1e-9)


def test_a_negative_factor_inside_the_root_is_no_signed_root() -> None:
    with pytest.raises(Unenclosed):
        over(traced(lambda z: [F.sign(z[0]) * F.sqrt(-2.0 * abs(z[0]))], 1), [-1], [1])


def test_what_two_forms_share_cancels() -> None:
    form = over(traced(lambda z: [F.exp(z[0]) - F.exp(z[0]) + 2.0 * z[1] - z[1]], 2), [0, 0], [1, 1])
    assert form.g.ravel() == pytest.approx([0.0, 1.0], abs=1e-15)


def test_a_product_keeps_the_sign_of_its_squares() -> None:
    form = over(traced(lambda z: [(z[0] + 1.0) * (z[0] + 2.0)], 1), [-1], [1])
    assert form.high[0] - form.low[0] == pytest.approx(1.0, rel=1e-9)


def test_a_piece_need_be_defined_only_where_it_holds() -> None:
    tape = traced(lambda z: [F.piecewise(z[0], [0.0], [F.sqrt(-z[0]), F.log(z[0] + 1.0)])], 1)
    for lower, upper, most in ((1.0, 2.0, np.log(3.0)), (-4.0, -1.0, 2.0)):
        assert over(tape, [lower], [upper]).upper[0] == pytest.approx(most)
        assert tape.ranges(np.array([lower]), np.array([upper]))[1][0] == pytest.approx(most)
    for evaluate in (over, lambda tape, *ends: tape.ranges(*map(np.array, ends))):
        with pytest.raises(Unenclosed, match="in sqrt: its argument may be negative"):
            evaluate(tape, [-1.0], [1.0])


def test_pieces_over_a_jump_hold_both() -> None:
    tape = traced(lambda z: [F.piecewise(z[0], [0.0, 1.0], [z[0], 5.0 + z[0], -z[0]])], 1)
    form = over(tape, [-1.0], [0.5])
    z = np.linspace(-1.0, 0.5, 301)[:, None]
    rest = tape.values(z)[:, 0] - form.k[0] - (z - form.centre) @ form.g[0]
    assert form.low[0] <= rest.min() <= rest.max() <= form.high[0]
    assert form.lower[0] <= -1.0 < 5.5 <= form.upper[0]


def test_the_whole_turn_at_the_cut_of_atan2() -> None:
    tape = traced(lambda z: [F.atan2(z[0], z[1])], 2)
    for lower, upper in (([-0.1, -2.0], [0.1, -1.0]), ([0.0, 0.0], [1.0, 1.0]), ([-1.0, -1.0], [0.0, 3.0])):
        form = over(tape, lower, upper)
        assert form.lower[0] <= -np.pi < np.pi <= form.upper[0]
    small = over(tape, [0.9, 39.0], [1.1, 41.0])
    assert small.high[0] - small.low[0] < 2e-4


@pytest.mark.parametrize(
    ("function", "why"),
    [
        (lambda z: 1.0 / z[0], "divides by a range that contains zero"),
        (lambda z: F.sqrt(z[0]), "may be negative"),
        (lambda z: F.log(z[0] + 1.0), "zero or negative"),
        (lambda z: F.exp(1000.0 + z[0]), "beyond all floats"),
        (lambda z: (z[0] * 1e300) * (z[0] * 1e300), "beyond all floats"),
    ],
)
def test_what_has_no_bounded_range_says_why_and_where(function, why) -> None:
    tape = traced(lambda z: [z[0], function(z)], 1)
    for evaluate in (tape.ranges, lambda lower, upper: tape.forms(lower, upper, 1)):
        with pytest.raises(Unenclosed, match=why) as caught:
            evaluate(np.array([-1.0]), np.array([1.0]))
        assert caught.value.row == 1


def test_units_that_are_powers_of_two_scale_forms_to_the_bit() -> None:
    def flow(unit):
        return lambda z: [F.sroot((z[0] - z[1]) * unit) * F.sqrt(z[1] * unit) + z[0] * unit * z[1] * unit]

    one = over(traced(flow(1.0), 2), [0.5, 0.25], [1.5, 0.75])
    other = over(traced(flow(2.0**-40), 2), [0.5 * 2.0**40, 0.25 * 2.0**40], [1.5 * 2.0**40, 0.75 * 2.0**40])
    assert np.array_equal(other.g * 2.0**40, one.g)
    assert np.array_equal(other.k, one.k)


def test_vectors_are_arrays_of_expressions() -> None:
    A = np.array([[1.0, 2.0], [0.0, -3.0]])

    def f(z):
        p, q = A @ z
        return [p**2 / 4.0 + np.float64(2.0) * q, F.sin(z)[1] ** 3 + 2.0**q]

    z = np.array([[0.3, -0.7], [1.2, 0.4]])
    p, q = A @ z.T
    expected = np.stack([p**2 / 4 + 2 * q, np.sin(z[:, 1]) ** 3 + 2.0**q], axis=1)
    assert traced(f, 2).values(z) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("function", "error", "why"),
    [
        (lambda z: z[0] if z[0] > 0 else -z[0], TypeError, "no truth value"),
        (lambda z: __import__("math").sin(z[0]), TypeError, "not math"),
        (lambda z: z[0] + "a", TypeError, "expected a finite number"),
        (lambda z: z[0] + float("nan"), TypeError, "expected a finite number"),
        (lambda z: F.log(z[0] * 0.0 + F.sqrt(Recorder().variable(0))), ValueError, "another function"),
        (lambda z: z[0] / 0.0, ValueError, "contains zero"),
        (lambda z: F.piecewise(z[0], [1.0, 0.0], [1, 2, 3]), ValueError, "increasing"),
    ],
)
def test_what_cannot_be_traced_is_one_error(function, error, why) -> None:
    with pytest.raises(error, match=why):
        traced(lambda z: [function(z)], 1)


def test_a_decimal_constant_that_is_folded_keeps_its_rounding() -> None:
    """1/3 is no float: the tape keeps an interval, so that x/3 is enclosed."""
    form = over(traced(lambda z: [z[0] / 3.0], 1), [3.0], [3.0])
    assert form.lower[0] < 1.0 < form.upper[0]
