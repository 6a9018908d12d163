"""The rows of linearisations that a window is given have few digits; what was dropped is in their remainder."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import pytest

from svo import NonlinearModel
from svo.checks import Array
from svo.models.nonlinear import Span, Undecided
from tests.svo.models.nonlinear_plants import CASES, Case
from tests.svo.models.short_transition import moved

SEED = 20_261_129
GROWTH = 1.02  # of remainders: 2^-6 for digits, 2^-8 for those of their own


def boxes(case: Case, rng: np.random.Generator) -> Iterator[tuple[Span, Array]]:
    for k in range(12):
        spread = case.spread * 10.0 ** rng.choice([-6.0, -2.0, -1.0, 0.0])
        centre = case.x0 + case.spread * rng.normal(size=len(case.x0))
        yield Span(centre - spread, centre + spread), np.array(case.u(7 * k), dtype=float)


def exact(row: Array) -> list[Fraction]:
    return [Fraction(float(v)) for v in row]


def miss(long: tuple[Array, float], short: tuple[Array, float], box: list[tuple[float, float]]) -> Fraction:
    """How far two rows (coefficients, constant) are apart at most, over a box: at one of its corners."""
    difference = [a - b for a, b in zip(exact(long[0]), exact(short[0]), strict=True)]
    middles = [(Fraction(low) + Fraction(high)) / 2 for low, high in box]
    reach = [(Fraction(high) - Fraction(low)) / 2 for low, high in box]
    at_middle = Fraction(long[1]) - Fraction(short[1]) + sum(d * c for d, c in zip(difference, middles, strict=True))
    return abs(at_middle) + sum(abs(d) * r for d, r in zip(difference, reach, strict=True))


def digits(values: Array) -> int:
    return sum(len(float(v).hex().split("p")[0].partition(".")[2].rstrip("0")) for v in values.ravel() if v)


@pytest.mark.parametrize("name", CASES)
def test_what_short_transitions_drop_is_in_their_remainder(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    model, n = case.model, len(case.x0)
    w, nw = model.flow.w, len(model.flow.varying)
    written, all_of_them = 0, 0
    for box, u in boxes(case, rng):
        try:
            long = model.kernel.transition(*box, u, model.Ts)
            short, _ = moved(model, box, box, u)
        except Undecided:
            continue
        E, R = short.E[:, :nw], np.diag(short.E[:, nw:])
        assert (short.E[:, nw:] == np.diag(R)).all()
        sides = list(zip(np.concatenate([box.lower, w.lower]), np.concatenate([box.upper, w.upper]), strict=True))
        for i in range(n):
            one = np.concatenate([long.A[i], long.E[i]]), float(long.a[i])
            other = np.concatenate([short.A[i], E[i]]), float(short.a[i])
            assert miss(one, other, sides) + Fraction(float(long.R[i])) <= Fraction(float(R[i]))
            assert R[i] <= GROWTH * long.R[i] + 1e-300
        written += digits(np.hstack([short.A, E, short.a[:, None], R[:, None]]))
        all_of_them += digits(np.hstack([long.A, long.E, long.a[:, None], long.R[:, None]]))
    assert written < 0.85 * all_of_them


@pytest.mark.parametrize("name", CASES)
def test_what_short_outputs_drop_is_in_their_noise(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    model = case.model
    w, nw = model.flow.w, len(model.flow.varying)
    nothing = np.full(model.n_outputs, np.nan)
    for box, u in boxes(case, rng):
        try:
            long = model.output(*box, u)
            short, _ = model.kernel.measured(box, nothing, u)
        except Undecided:
            continue
        sides = list(zip(np.concatenate([box.lower, w.lower]), np.concatenate([box.upper, w.upper]), strict=True))
        for i in range(model.n_outputs):
            one = np.concatenate([long.C[i], long.F[i]]), float(long.c[i])
            other = np.concatenate([short.C[i], short.F[i, :nw]]), float(short.c[i])
            least = miss(one, other, sides) + Fraction(float(long.R[i])) + Fraction(float(model.noise[i]))
            assert least <= Fraction(float(short.n[i]))
            assert short.n[i] <= (model.noise[i] + GROWTH * long.R[i]) * (1.0 + 1e-15)


@pytest.mark.parametrize("power", [-300, 0, 300])
def test_what_is_exact_keeps_its_digits(power: int) -> None:
    """The remainder of a linear plant is rounding: no digit is worth less than that."""
    unit = 2.0**power
    model = NonlinearModel(
        lambda x: [0.3 * x[0] + 0.1 * x[1], 0.7 * x[1]], lambda x: [x[0]], states=["a", "b"], continuous=False,
        Ts=1.0, n=0.1 * unit, largest=([-2e9 * unit] * 2, [2e9 * unit] * 2),
    )  # fmt: skip
    box = Span(np.array([-1.0, 1.0]) * unit, np.array([0.5, 3.0]) * unit)
    short, _ = moved(model, box, box, np.zeros(0))
    assert (short.A == [[0.3, 0.1], [0.0, 0.7]]).all()
    assert (np.diag(short.E) <= 1e-13 * unit).all()


def test_a_box_without_an_inside_keeps_its_digits() -> None:
    model = NonlinearModel(
        lambda x: [x[0] * x[0] / 3.0],
        lambda x: [x[0]],
        states=["a"],
        Ts=1.0,
        n=0.1,
        continuous=False,
        largest=([-9], [9]),
    )
    box = Span(np.array([0.7]), np.array([0.7]))
    short, _ = moved(model, box, box, np.zeros(0))
    long = model.transition([0.7], [0.7])
    exact_value = Fraction(0.7) ** 2 / 3
    said = Fraction(float(short.A[0, 0])) * Fraction(0.7) + Fraction(float(short.a[0]))
    assert abs(exact_value - said) <= Fraction(float(short.E[0, 0]))
    assert short.A[0, 0] == pytest.approx(long.A[0, 0])
