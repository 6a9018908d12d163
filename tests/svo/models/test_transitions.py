"""Transitions of nonlinear plants: every state of the box, every w and p lands in A x + a + E (w, p) + [-R, R]."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from svo.checks import Array
from svo.functions import cos, sin
from svo.models.nonlinear import NonlinearModel, Undecided
from svo.models.nonlinear.simulation import integrated
from tests.svo.models.nonlinear_plants import CASES, Case, cstr, pendulum, three_tanks

POINTS = 100  # a transition
SEED = 20_261_129


def points(case: Case, lower: Array, upper: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """States and disturbances at corners and inside."""
    flow = case.model.flow
    ends = [(lower, upper), flow.w]
    share = [rng.uniform(size=(POINTS, len(low))) for low, _ in ends]
    share = [np.where(rng.random((POINTS, 1)) < 0.5, np.round(s), s) for s in share]
    x, w = (low + s * (high - low) for s, (low, high) in zip(share, ends, strict=True))
    return x, w


def landed(case: Case, x: Array, w: Array, u: Array, T: float, rng: np.random.Generator) -> Array:
    """x(T) for each, what varies switching within the sample."""
    flow = case.model.flow
    for piece in range(5):
        if piece:
            other = np.where(rng.random(w.shape) < 0.5, flow.w.lower, flow.w.upper)
            w = np.where(flow.varying, other, w)
        x = integrated(flow, x, w, u, T / 5, 20 if case.smooth else 50)
    return x


@pytest.mark.parametrize("name", CASES)
def test_a_transition_contains_the_plant(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    model, x = case.model, case.x0
    worst = 0.0
    for k in range(5):
        spread = case.spread * 10.0 ** rng.uniform(-2, 0.3)
        lower, upper = x - spread, x + spread
        if model.physical_range is not None:
            lower, upper, _ = model.physical_range.cut(lower, upper)
        u, T = np.array(case.u(7 * k), dtype=float), model.Ts * rng.uniform(0.1, 1.9)
        found = model.transition(lower, upper, u, dt=T)
        starts, w = points(case, lower, upper, rng)
        ends = landed(case, starts, w, u, T, rng)
        rest = ends - starts @ found.A.T - found.a - w @ (found.E * ~model.flow.varying).T
        room = 1e-3 * found.R + 1e-12 * np.abs(ends)  # the integrator's error
        assert (np.abs(rest) <= found.R + room).all(), (k, (np.abs(rest) / found.R).max(axis=0))
        assert (ends >= found.box.lower - room).all()
        assert (ends <= found.box.upper + room).all()
        worst = max(worst, float((np.abs(rest) / found.R).max()))
        x = ends[0]
    assert worst > 0.1  # a bound a hundred times too wide would pass everything else


@pytest.mark.parametrize("name", ["tank", "crane"])
def test_an_output_contains_what_is_measured(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    model = case.model
    lower, upper = case.x0 - case.spread, case.x0 + case.spread
    u = np.array(case.u(3), dtype=float)
    found = model.output(lower, upper, u)
    x, w = points(case, lower, upper, rng)
    y = model.reading.values(np.concatenate([x, w, np.broadcast_to(u, (POINTS, len(u)))], axis=1))
    assert (np.abs(y - x @ found.C.T - found.c - w @ found.F.T) <= found.R + 1e-15).all()
    assert not found.F[:, model.flow.varying].any()


def test_a_linear_plant_is_discretised_with_a_remainder_of_rounding_only() -> None:
    A = np.array([[0.0, 1.0], [-4.0, -0.4]])
    model = NonlinearModel(
        lambda x, u, w: A @ x + np.array([0.0, 1.0]) * (u[0] + w[0]), lambda x: [x[0]], states=["s", "v"], inputs=["u"],
        disturbances=["w"], Ts=0.1, w=[0.5], largest=([-9, -9], [9, 9]),
    )  # fmt: skip
    found = model.transition([1.0, -2.0], [3.0, 2.0], [0.7])
    joint = expm(np.block([[A, np.array([[0.0], [1.0]])], [np.zeros((1, 3))]]) * 0.1)
    assert np.abs(found.A - joint[:2, :2]).max() < 1e-14
    assert found.E[:, 0] == pytest.approx(joint[:2, 2], abs=1e-14)
    assert found.a == pytest.approx(joint[:2, 2] * 0.7, abs=1e-13)
    assert (found.R < 1e-12).all()


def test_a_discrete_map_is_linearised_as_it_is() -> None:
    model = NonlinearModel(
        lambda x, w: [1.0 - 1.4 * x[0] ** 2 + x[1] + w[0], 0.3 * x[0]], lambda x: [x[0]], states=["x", "y"],
        disturbances=["w"], w=[0.01], largest=([-2, -2], [2, 2]), continuous=False,
    )  # fmt: skip
    found = model.transition([0.4, 0.1], [0.6, 0.2])
    assert np.abs(found.A - [[-1.4, 1.0], [0.3, 0.0]]).max() < 1e-12
    assert found.R[0] == pytest.approx(1.4 * 0.1**2 / 2, rel=1e-6)
    assert found.R[1] < 1e-14
    with pytest.raises(ValueError, match=r"dt is 0\.1; expected None for a model in discrete time"):
        model.transition([0.4, 0.1], [0.6, 0.2], dt=0.1)


def test_what_varies_inside_a_sample_is_not_held() -> None:
    def oscillator(varying):
        return NonlinearModel(
            lambda x, w: [x[1], w[0]], lambda x: [x[0]], states=["s", "v"], disturbances=["w"], Ts=1.0, w=[1.0],
            varying=varying, largest=([-9, -9], [9, 9]),
        )  # fmt: skip

    still, moving = (oscillator(v).transition([0, 0], [0, 0]) for v in ((), "w"))
    assert still.E[:, 0] == pytest.approx([0.5, 1.0])
    assert (still.R < 1e-12).all()
    assert moving.E[:, 0] == pytest.approx([0.0, 0.0])
    assert np.abs(moving.R - [0.5, 1.0]).max() < 1e-9


@pytest.mark.parametrize("case", [cstr(), three_tanks(), pendulum()])
def test_a_remainder_shrinks_with_the_set(case: Case) -> None:
    u = np.array(case.u(0), dtype=float)
    sizes = [case.model.transition(case.x0 - s * case.spread, case.x0 + s * case.spread, u).R for s in (1.0, 0.1)]
    assert (sizes[1] < sizes[0]).all()


def test_a_state_that_is_pulled_back_is_enclosed_by_its_own_ends() -> None:
    """A stiff reaction: nothing leaves [0, 1], though |f| is up to 31 there."""
    model = NonlinearModel(
        lambda x: [60.0 * (0.5 - x[0]) - x[0] ** 3, x[0] - 0.1 * x[1]], lambda x: x, states=["a", "b"], Ts=0.05,
        largest=([-9, -9], [9, 9]),
    )  # fmt: skip
    h = model.Ts / 8
    box = model.transition([0.0, 2.0], [1.0, 3.0], dt=h).within
    assert box.lower[0] == pytest.approx(0.0, abs=1e-9)
    assert box.upper[0] == pytest.approx(1.0, abs=1e-9)
    x = np.array([[a, b] for a in (0.0, 0.4, 1.0) for b in (2.0, 3.0)])
    for _ in range(10):
        x = integrated(model.flow, x, np.zeros((6, 0)), np.zeros(0), h / 10, 10)
        assert ((x >= box.lower) & (x <= box.upper)).all()


@pytest.mark.parametrize("growth", [lambda s, mu: mu * s / (0.2 + s), lambda s, mu: mu * (s / (s + 0.2))])
def test_a_quotient_keeps_what_its_parts_have_in_common(growth) -> None:
    """Monod's growth, whose numerator and denominator rise together; as a product with 1 / (K + s) it is far wider."""

    def model(rate):
        return NonlinearModel(
            lambda x, p: [rate(x[0], p[0])], lambda x: x, states=["s"], parameters={"mu": (0.48, 0.52)},
            Ts=1.0, largest=([0], [9]), continuous=False,
        )  # fmt: skip

    one, other = model(growth), model(lambda s, mu: mu * s * (1.0 / (0.2 + s)))
    for low, high in (0.2, 0.4), (0.1, 1.0), (0.0, 8.0):
        ours, product = one.transition([low], [high]), other.transition([low], [high])
        s = np.linspace(low, high, 50)
        for mu in (0.48, 0.5, 0.52):
            rest = mu * s / (0.2 + s) - s * ours.A[0, 0] - ours.a[0] - mu * ours.E[0, 0]
            assert (np.abs(rest) <= ours.R[0] + 1e-15).all()
        q = 0.2 / ((0.2 + low) * (0.2 + high))  # of the chord, to which the curve's largest distance is known
        chord = 0.5 * 0.5 * (np.sqrt(1.0 / (0.2 + low)) - np.sqrt(1.0 / (0.2 + high))) ** 2 * 0.2
        mixed = 0.5 * 0.02 * q * (high - low)
        assert ours.R[0] < 1.3 * (chord + mixed) + 1e-9, (low, high)
        assert ours.R[0] < 0.6 * product.R[0]


@pytest.mark.parametrize(
    ("wave", "low", "high"), [(sin, -1.5, 1.5), (cos, 0.1, 3.0), (sin, -0.3, 0.9), (cos, -2.0, 3.5)]
)
def test_a_wave_over_a_wide_interval_leaves_out_little_more_than_it_must(wave, low: float, high: float) -> None:
    model = NonlinearModel(
        lambda x: [wave(x[0])], lambda x: x, states=["s"], Ts=1.0, largest=([-9], [9]), continuous=False
    )
    found, s = model.transition([low], [high]), np.linspace(low, high, 4001)
    slopes = np.linspace(-1.0, 1.0, 2001)[:, None]
    rest = wave(s) - slopes * s
    least = 0.5 * float((rest.max(axis=1) - rest.min(axis=1)).min())
    assert (np.abs(wave(s) - found.A[0, 0] * s - found.a[0]) <= found.R[0]).all()
    assert found.R[0] < least + 0.02


def test_a_face_of_the_physical_range_may_be_touched() -> None:
    """A level that may be zero is enclosed although the root has no slope there."""
    model = NonlinearModel(
        lambda h, u: [(u[0] - 0.1 * sqrt_of(h[0])) / 5.0], lambda h: h, states=["h"], inputs=["Q"], Ts=1.0,
        physical=([0.0], [10.0]),
    )  # fmt: skip
    found = model.transition([0.0], [0.3], [0.5])
    assert np.isfinite(found.R).all()
    with pytest.raises(
        Undecided, match="substeps would be needed: the equation of h is not enclosed, in sqrt: its argument"
    ):
        NonlinearModel(model.f, model.h, states=["h"], inputs=["Q"], largest=([0], [10])).transition(
            [0.0], [0.3], [0.0]
        )


def sqrt_of(v):
    from svo.functions import sqrt

    return sqrt(1962.0 * v)


def test_what_leaves_the_valid_range_says_which_state() -> None:
    model = pendulum(valid=([-1.0, -2.0], [1.0, 2.0])).model
    model.transition([0.1, 0.0], [0.2, 0.1], [0.0])
    with pytest.raises(Undecided, match=r"rate may be in .*, outside valid = \[-2, 2\]") as caught:
        model.transition([0.1, 1.9], [0.2, 1.95], [9.0])
    assert caught.value.coordinate == 1


def test_a_step_that_is_too_long_is_undecided() -> None:
    model = NonlinearModel(lambda x: [x[0] * x[0]], lambda x: x, states=["x"], largest=([0], [9]))
    model.transition([1.0], [1.1], dt=0.5)
    with pytest.raises(Undecided, match="more than 200 substeps would be needed"):
        model.transition([1.0], [1.1], dt=1.5)  # at 1 / 1.1 it is infinite


def test_a_transition_shows_itself_in_a_line() -> None:
    case = three_tanks()
    shown = repr(case.model.transition(case.x0 - 1.0, case.x0 + 1.0, case.u(0)))
    assert shown.startswith("Transition(A=array (3, 3), a=[")
    assert len(shown) < 400
