"""The core's exponential of a matrix and its integral: within their bounds, entry by entry, of what balls say."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from scipy.linalg import expm

from polytopes import native
from polytopes.exact import ball_matrix
from svo.checks import Array
from tests.svo.functions.oracle.exponential import carried

CASES = 150
REACH = 2.0**36  # units that a state is away from zero: a trillion times as wide as the set is about the most
_room = native.function("fdi_exponential_room", native.Integer, returns=native.Integer)
_take = native.function(
    "fdi_exponential", native.Integer, native.Given, native.Real, native.Given, native.Real, native.Real,
    native.Address, native.Entries,
)  # fmt: skip


def draw(rng: np.random.Generator) -> tuple[Array, float, Array, float]:
    """J of any pattern, h, units, and the norm of J h in these units, at most 1."""
    n = int(rng.integers(1, 6))
    J = rng.normal(size=(n, n)) * (rng.random((n, n)) < rng.choice([0.3, 1.0]))
    J = rng.choice([J, np.triu(J, 1), -np.abs(J), np.zeros((n, n))])
    unit = 2.0 ** rng.integers(-300, 300, n) if rng.random() < 0.5 else np.ones(n)
    h = 2.0 ** float(rng.integers(-8, 4))
    size = max(float(np.abs(J).sum(axis=1).max()) * h, 1e-300)
    norm = float(rng.choice([1.0, 0.3, 1e-3]))
    J = J * (norm / size) * (1.0 - 1e-12)
    return J * unit[:, None] / unit, h, unit, norm


def taken(J: Array, h: float, unit: Array, norm: float) -> Array:
    n = len(J)
    found = np.empty((5, n, n))
    _take(n, J, h, unit, norm, REACH, native.scratch(_room(n)), found)
    return found


@pytest.mark.parametrize("seed", range(3))
def test_balls_are_within_the_bounds_of_each_entry(seed: int) -> None:
    rng = np.random.default_rng([20_261_129, seed])
    for _ in range(CASES):
        J, h, unit, norm = draw(rng)
        n = len(J)
        plain, shape = J * unit / unit[:, None], unit[:, None] / unit  # exact: balls in these units would be too wide
        move, gain, move_error, gain_error, carry = taken(J, h, unit, norm) / shape
        with ctx.workprec(400):
            joint = (ball_matrix(np.block([[plain, np.eye(n)], [np.zeros((n, 2 * n))]])) * arb(h)).exp()
            for i in range(n):
                for j in range(n):
                    assert abs(joint[i, j] - arb(move[i, j])) <= arb(move_error[i, j])
                    assert abs(joint[i, n + j] - arb(gain[i, j])) <= arb(gain_error[i, j])
        assert (carry >= carried(plain, h) * (1.0 - 1e-15)).all()


def test_bounds_are_a_few_roundings_of_the_terms() -> None:
    rng = np.random.default_rng(20_261_129)
    for _ in range(CASES):
        J, h, unit, norm = draw(rng)
        plain, shape = J * unit / unit[:, None], unit[:, None] / unit
        _, _, move_error, gain_error, carry = taken(J, h, unit, norm) / shape
        terms = expm(np.abs(plain) * h)
        left_out = 1e-28  # of the series, in units of the states
        assert (move_error <= 2e-14 * terms + left_out).all()
        assert (gain_error <= h * (2e-14 * terms + left_out)).all()
        assert (carry <= carried(plain, h) + 2.1 * gain_error).all()


def test_what_is_left_out_of_the_series_is_in_the_bound() -> None:
    """A chain so slow that its second link is the first term left out, which no rounding hides."""
    a = 2.0**-50
    J = np.diag([a, a], 1)
    move, gain, move_error, gain_error, carry = taken(J, 1.0, np.ones(3), a)
    assert move[0, 2] == 0.0
    assert move_error[0, 2] >= a * a / 2.0 - move[0, 2]
    assert gain_error[0, 2] >= a * a / 6.0 - gain[0, 2]
    assert carry[0, 2] >= a * a / 6.0
    assert move_error[0, 2] < 2.0**-97


def test_what_underflow_takes_is_in_the_bound() -> None:
    """A product that is no normal double loses more than its roundings."""
    h, slope, unit = 0.3, 2.0**-1040, np.array([2.0**-1000, 1.0])  # so that the rest of the series hides nothing
    move, gain, move_error, gain_error, _ = taken(np.array([[0.0, slope], [0.0, 0.0]]), h, unit, 2.0**-41)
    exact = Fraction(slope) * Fraction(h)
    assert abs(exact - Fraction(float(move[0, 1]))) > Fraction(move[0, 1]) * Fraction(2.0**-53)
    assert abs(exact - Fraction(float(move[0, 1]))) <= Fraction(float(move_error[0, 1]))
    assert abs(exact * Fraction(h) / 2 - Fraction(float(gain[0, 1]))) <= Fraction(float(gain_error[0, 1]))
