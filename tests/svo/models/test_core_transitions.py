"""Transitions of the core beside those of Python's rules in balls, and in units that are powers of two."""

from __future__ import annotations

import pickle
from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx

from polytopes.exact import ball_matrix
from svo.checks import Array
from svo.functions import sqrt
from svo.models.nonlinear import NonlinearModel, Span, Transition, Undecided
from tests.svo.functions.oracle.evaluation import Evaluation
from tests.svo.functions.oracle.output import cut, linear_output
from tests.svo.functions.oracle.transition import of_model
from tests.svo.models.nonlinear_plants import CASES, Case, three_tanks

SEED = 20_261_129
ROUNDINGS = 2.0**-46  # of the largest terms: what an exponential in doubles takes, and one in balls does not


def answer(ask, *arguments) -> Transition | str:
    try:
        found: Transition = ask(*arguments)
    except Undecided as error:
        return str(error)
    return found


def boxes(case: Case, rng: np.random.Generator, count: int):
    """Boxes about the first state: tiny, of the plant's size, and far too wide; and inputs."""
    for k in range(count):
        spread = case.spread * 10.0 ** rng.choice([-6.0, -1.0, 0.0, 0.7, 2.5])
        centre = case.x0 + case.spread * rng.normal(size=len(case.x0))
        yield centre - spread, centre + spread, np.array(case.u(7 * k), dtype=float)


@pytest.mark.parametrize("name", CASES)
def test_transitions_are_those_of_balls_but_for_rounding(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    model, wide = case.model, np.subtract(case.model.start_range.upper, case.model.start_range.lower)
    undecided = 0
    for lower, upper, u in boxes(case, rng, 20):
        T = model.Ts * rng.uniform(0.1, 1.9)
        here = answer(model.kernel.transition, lower, upper, u, T)
        there = answer(of_model, model, lower, upper, u, T)
        if isinstance(there, str) or isinstance(here, str):
            undecided += 1
            if not (isinstance(here, str) and "wider than largest" in here):
                assert here == there
            continue
        size = np.abs(there.A) @ np.maximum(np.abs(lower), np.abs(upper)) + np.abs(there.a)
        assert here.substeps == there.substeps
        assert (1.02 * there.R + ROUNDINGS * size >= here.R).all()
        assert (np.abs(here.box.lower - there.box.lower) <= 1e-9 * wide).all()
        assert (np.abs(here.box.upper - there.box.upper) <= 1e-9 * wide).all()
        assert (np.abs(here.within.lower - there.within.lower) <= 1e-9 * wide).all()
        assert (np.abs(here.within.upper - there.within.upper) <= 1e-9 * wide).all()
        assert pytest.approx(there.A, rel=1e-9, abs=1e-12) == here.A
    assert undecided < 15


@pytest.mark.parametrize("name", CASES)
def test_outputs_and_what_readings_leave_of_a_box_are_those_of_balls(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    model, flow = case.model, case.model.flow
    tape = Evaluation(model.reading)
    for lower, upper, u in boxes(case, rng, 10):
        x = case.x0 + case.spread * rng.uniform(-1.0, 1.0, len(case.x0))
        y = model.reading.values(np.concatenate([x, flow.w.lower, u])) + model.noise * rng.uniform(
            -1, 1, len(model.noise)
        )
        try:
            here, left = model.kernel.measured(Span(lower, upper), y, u)
            there = linear_output(tape, flow.w, ~flow.varying, Span(lower, upper), u, model.outputs or ())
        except Undecided:
            continue
        first = model.output(lower, upper, u)
        assert pytest.approx(there.C, rel=1e-9, abs=1e-12) == first.C
        assert (first.R <= 1.02 * there.R + 1e-13).all()
        assert (here.n <= (model.noise + 1.02 * first.R) * (1.0 + 1e-15)).all()  # in fewer digits
        assert (here.n >= model.noise).all()
        assert np.array_equal(here.A, np.eye(len(lower)))
        again = model.kernel.cut(Span(lower, upper), y, first)
        cut_there = cut(Span(lower, upper), y, there, flow.w, model.noise)
        assert (again is None) == (cut_there is None)
        if cut_there is not None and again is not None:
            room = 1e-9 * (upper - lower)
            for mine, its in zip(again, cut_there, strict=True):
                assert (np.abs(mine - its) <= room).all()
            assert (left.lower >= again.lower).all()
            assert (left.upper <= again.upper).all()
        if (x >= lower).all() and (x <= upper).all() and not flow.varying.any():
            assert (left.lower <= x).all()
            assert (x <= left.upper).all()


def rounded_linear(rng: np.random.Generator, n: int, continuous: bool) -> tuple[Array, NonlinearModel]:
    J = rng.normal(size=(n, n))
    return J, NonlinearModel(
        lambda x: list(J @ x), lambda x: [x[0]], states=[f"x{i}" for i in range(n)], Ts=0.25, continuous=continuous,
        largest=([-1e9] * n, [1e9] * n),
    )  # fmt: skip


def test_what_rounding_takes_of_a_linear_map_is_in_its_remainder() -> None:
    """Exactly, in fractions; without the bounds of rounding some points lie outside."""
    rng, worst = np.random.default_rng(SEED), 0.0
    for _ in range(40):
        J, model = rounded_linear(rng, 3, continuous=False)
        x = rng.normal(size=3) * 10.0 ** rng.integers(-3, 6, 3)
        found = model.transition(x, x)
        for i in range(3):
            exact = sum(Fraction(v) * Fraction(s) for v, s in zip(J[i].tolist(), x.tolist(), strict=True))
            said = sum(Fraction(v) * Fraction(s) for v, s in zip(found.A[i].tolist(), x.tolist(), strict=True))
            miss = abs(exact - said - Fraction(float(found.a[i])))
            assert miss <= Fraction(float(found.R[i]))
            worst = max(worst, float(miss / Fraction(float(found.R[i]))))
            assert Fraction(float(found.box.lower[i])) <= exact <= Fraction(float(found.box.upper[i]))
    assert worst > 0.01


def test_what_rounding_takes_of_a_linear_flow_is_in_its_remainder() -> None:
    rng = np.random.default_rng(SEED)
    for _ in range(40):
        J, model = rounded_linear(rng, 3, continuous=True)
        x = rng.normal(size=3) * 10.0 ** rng.integers(-3, 6, 3)
        found = model.transition(x, x)
        with ctx.workprec(300):
            end = (ball_matrix(J) * arb(0.25)).exp() * ball_matrix(x[:, None])
            said = ball_matrix(found.A) * ball_matrix(x[:, None]) + ball_matrix(found.a[:, None])
            for i in range(3):
                assert abs(end[i, 0] - said[i, 0]) <= arb(float(found.R[i]))
                assert arb(float(found.box.lower[i])) <= end[i, 0] <= arb(float(found.box.upper[i]))


def test_a_box_holds_what_no_double_does() -> None:
    """A step whose sum is rounded back to where it began."""
    for first, step in ((1e16, 1.0), (-1e16, -1.0), (1e300, 1e283)):
        model = NonlinearModel(
            lambda x, step=step: [step], lambda x: x, states=["x"], largest=([-2e300], [2e300]), Ts=1.0
        )  # fmt: skip
        found = model.transition([first], [first])
        end = Fraction(first) + Fraction(step)
        assert first + step == first
        assert Fraction(float(found.box.lower[0])) <= end <= Fraction(float(found.box.upper[0]))
        assert abs(end - Fraction(float(found.A[0, 0])) * Fraction(first) - Fraction(float(found.a[0]))) <= found.R[0]


@pytest.mark.parametrize("power", [-300, -40, 40, 300])
def test_units_that_are_powers_of_two_scale_a_transition(power: int) -> None:
    """Levels in 2^-power cm: remainders too, where balls would lose all digits."""
    unit = 2.0**power
    plain = three_tanks().model

    def scaled(h, u, w):
        return [row * unit for row in plain.f([v / unit for v in h], u, [v / unit for v in w])]

    other = NonlinearModel(
        scaled, lambda h: h, states=plain.states, inputs=plain.inputs, disturbances=plain.disturbances, Ts=5.0,
        n=0.2 * unit, w=[0.003 * unit] * 3, physical=([0] * 3, [62 * unit] * 3),
    )  # fmt: skip
    lower, upper = np.array([20.0, 18.0, 19.0]), np.array([20.5, 18.25, 20.25])
    one = plain.transition(lower, upper, [30.0, 20.0])
    two = other.transition(lower * unit, upper * unit, [30.0, 20.0])
    assert two.R / unit == pytest.approx(one.R, rel=1e-9)
    assert two.a / unit == pytest.approx(one.a, rel=1e-12)
    assert np.abs(two.A - one.A).max() < 1e-12


def test_states_in_units_far_apart_do_not_matter() -> None:
    case = CASES["cstr"]()
    plain, unit = case.model, np.array([2.0**-200, 2.0**150])

    def scaled(x, u, w):
        rows = plain.f([x[0] / unit[0], x[1] / unit[1]], w=[w[0] / unit[0], w[1] / unit[1]], u=u)
        return [row * v for row, v in zip(rows, unit.tolist(), strict=True)]

    other = NonlinearModel(
        scaled, lambda x: [x[1]], states=plain.states, inputs=plain.inputs, disturbances=plain.disturbances, Ts=0.05,
        n=0.2 * unit[1], w=np.array([0.005, 0.5]) * unit, physical=tuple(end * unit for end in plain.physical),
        largest=tuple(end * unit for end in plain.largest),
    )  # fmt: skip
    lower, upper = case.x0 - case.spread, case.x0 + case.spread
    one, two = plain.transition(lower, upper, [300.0]), other.transition(lower * unit, upper * unit, [300.0])
    assert two.R / unit == pytest.approx(one.R, rel=1e-6)
    assert two.A / (unit[:, None] / unit) == pytest.approx(one.A, rel=1e-9)


def test_a_remainder_beyond_largest_is_undecided() -> None:
    model = NonlinearModel(
        lambda x: [x[0] ** 2], lambda x: x, states=["x"], Ts=0.3, largest=([-1e-6], [1e-6]),
    )  # fmt: skip
    with pytest.raises(Undecided, match="the remainder of x is wider than largest") as caught:
        model.transition([-0.1], [1.0])
    assert caught.value.coordinate == 0


def test_a_set_that_leaves_what_is_physical_is_undecided() -> None:
    model = NonlinearModel(
        lambda x, u: [u[0] - x[0]], lambda x: x, states=["h"], inputs=["Q"], Ts=1.0, physical=([0.0], [1.0])
    )
    with pytest.raises(Undecided, match="no h of the set stays within the physical range"):
        model.transition([0.1], [0.2], [-3.0])


def test_where_no_box_is_found_the_state_that_leaves_it_is_named() -> None:
    model = NonlinearModel(
        lambda x: [-x[0], 5000.0 * (x[0] - x[1])], lambda x: x, states=["slow", "fast"], n=0.1, jitter=1.0,
        largest=([-9, -9], [9, 9]),
    )  # fmt: skip
    with pytest.raises(Undecided, match=r"would be needed: no box was found .* within 0.00391 s, fast leaves all"):
        model.transition([0.5, 0.5], [0.6, 0.6])
    box, nothing = np.array([[0.5, 0.5], [0.6, 0.6]]), np.zeros(0)
    with pytest.raises(Undecided, match=r"no box was found .* within 1 s of a reading, (slow|fast) leaves all"):
        model.output_near(*box, nothing, (nothing, nothing))


def test_a_copy_of_a_model_has_a_kernel_of_its_own() -> None:
    model = three_tanks().model
    lower, upper = np.array([20.0, 18.0, 19.0]), np.array([20.5, 18.25, 20.25])
    first = model.transition(lower, upper, [30.0, 20.0])
    again = pickle.loads(pickle.dumps(model.kernel))
    del model
    other = again.transition(lower, upper, np.array([30.0, 20.0]), 5.0)
    assert all(np.array_equal(mine, its) for mine, its in zip(first[:4], other[:4], strict=True))


def test_a_discrete_model_says_what_is_not_enclosed() -> None:
    model = NonlinearModel(
        lambda x: [sqrt(x[0])], lambda x: [1.0 / x[0]], states=["x"], outputs=["inverse"], continuous=False,
        largest=([0], [9]),
    )  # fmt: skip
    with pytest.raises(Undecided, match=r"^the equation of x is not enclosed, in sqrt: its argument may be negative"):
        model.transition([-1.0], [1.0])
    with pytest.raises(Undecided, match=r"^the output inverse is not enclosed, in 1 / \(...\): it divides by a range"):
        model.output([-1.0], [1.0])
