"""What varies inside a sample of a continuous plant: against piecewise exponentials of the plant itself."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import expm

from polytopes import HPolytope
from svo import ConstrainedZonotopeObserver, UncertainModel, Uncertainty, WindowObserver
from svo.models.discretisation import left_out, vary_in, wandering, zero_order_hold
from svo.models.inside_sample import departure, growth, kept
from svo.models.remainder import remainder_bound

Array = NDArray[np.float64]
PARTS = 12
INTEGRATOR: dict[str, Any] = {
    "A": [[0.0, 1.0], [0.0, 0.0]], "B": [[0.0], [1.0]], "C": np.eye(2), "E": [[0.0], [1.0]], "w": [1.0], "Ts": 0.5,
}  # fmt: skip


def flow(A: Array, rate: Array, x: Array, t: float) -> Array:
    n = len(x)
    joint = expm(np.block([[A, rate[:, None]], [np.zeros((1, n + 1))]]) * t)
    return np.asarray(joint[:n, :n] @ x + joint[:n, n])


class Plant:
    """Random dx/dt = A x + B u + a + E w + Delta_i (...), with w and Delta at corners, switching inside the sample."""

    def __init__(self, seed: int, Ts: float, varying: tuple[str, ...]) -> None:
        self.rng, self.Ts, self.varying = np.random.default_rng(seed), Ts, varying
        rng, n = self.rng, int(self.rng.integers(1, 4))
        shapes = {"A": (n, n), "B": (n, 2), "a": (n,), "E": (n, 2)}
        self.parts = [{k: rng.normal(size=shape) for k, shape in shapes.items()} for _ in range(3)]
        self.parts[0]["A"] *= rng.choice([0.2, 1.0, 5.0])
        self.parts[0]["A"] -= rng.choice([0.0, 8.0]) * np.eye(n)
        for item, name in ((1, "a"), (2, "A")):
            self.parts[item][name][:] = 0.0
        self.parts[1]["A"] *= rng.integers(2)  # without it only what varies is left out
        self.parts[1]["E"] *= rng.integers(2)
        self.bounds = np.array([[-0.5, 1.5], [0.1, 0.2]])
        self.w = np.array([-0.5, 0.2]), np.array([1.0, 0.4])
        self.x, self.u = rng.normal(size=n), rng.normal(size=2)

    def model(self, units: Array, reach: Array) -> UncertainModel:
        """The discrete model of the plant with its states in other units."""
        into = {"A": units[:, None] / units, "a": units}
        nominal, *items = [{k: v * into.get(k, units[:, None]) for k, v in p.items() if v.any()} for p in self.parts]
        uncertainties = [Uncertainty(**v, bounds=tuple(b)) for v, b in zip(items, self.bounds.tolist(), strict=True)]
        return UncertainModel.from_continuous(
            **nominal, C=np.eye(len(units)), w=self.w, Ts=self.Ts, varying=self.varying, uncertainties=uncertainties,
            remainder={"states": units * reach, "inputs": np.abs(self.u)},
        )  # fmt: skip

    def signals(self) -> tuple[Array, Array, Array]:
        """Lengths of the parts of the sample (PARTS,), w (PARTS, 2) and Delta (PARTS, 2)."""
        lengths = self.rng.dirichlet(np.ones(PARTS)) * self.Ts
        w = np.where(self.rng.random((PARTS, 2)) < 0.5, *self.w)
        delta = np.where(self.rng.random((PARTS, 2)) < 0.5, *self.bounds.T)
        if self.rng.random() < 0.7:  # all together, at most two switches: the worst for a product
            high = np.roll(np.arange(PARTS) < self.rng.integers(PARTS + 1), self.rng.integers(PARTS))[:, None]
            lengths[:] = self.Ts / PARTS
            w, delta = np.where(high, *self.w), np.where(high, *self.bounds.T)
        for names, signal in (("w", w), ("Delta", delta)):
            for j in range(2):
                if not {"all", names, f"{names}[{j}]"} & set(self.varying):
                    signal[:, j] = signal[0, j]
        return lengths, w, delta

    def way(self, lengths: Array, w: Array, delta: Array) -> Array:
        """States at ends and inside of the parts."""
        states = [self.x]
        for length, disturbance, values in zip(lengths, w, delta, strict=True):
            sums = {k: sum(f * p[k] for f, p in zip((1.0, *values), self.parts, strict=True)) for k in "ABaE"}
            rate, start = sums["B"] @ self.u + sums["a"] + sums["E"] @ disturbance, states[-1]
            states += [flow(sums["A"], rate, start, t) for t in np.linspace(0, length, 6)[1:]]
        return np.array(states)


VARYING: list[tuple[str, ...]] = [(), ("w",), ("Delta",), ("all",), ("w[0]", "Delta[1]")]


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 1.0), st.sampled_from(VARYING))
def test_the_next_state_is_within_the_remainder(seed: int, Ts: float, varying: tuple[str, ...]) -> None:
    """With the means over the sample of what varies; the oracle is the exponential of each part of the sample."""
    plant = Plant(seed, Ts, varying)
    lengths, w, delta = plant.signals()
    way, n = plant.way(lengths, w, delta), len(plant.x)
    units = 2.0 ** plant.rng.integers(-20, 21, n)
    model = plant.model(units, 1.02 * np.abs(way).max(axis=0))
    means = lengths @ w / Ts, lengths @ delta / Ts
    known = np.concatenate([units * plant.x, plant.u, [1.0], means[0], np.zeros(n)])
    stack = model.stack()[:, :n]
    ours = (stack[0] + np.tensordot(means[1], stack[1:], axes=1)) @ known
    rounding = 1e-12 * np.abs(stack).sum(axis=0) @ np.abs(known)
    assert (np.abs(units * way[-1] - ours) <= model.bounds()[1][2:] + rounding).all()


def test_a_delta_that_moves_inside_the_sample_leaves_a_set_that_was_made_for_held_ones() -> None:
    """dx/dt = Delta B u: without A the held remainder is 0, and what moves is outside it."""
    item = Uncertainty(B=[[0.0], [1.0]], bounds=(-1.0, 1.0))
    arguments = INTEGRATOR | {"uncertainties": [item], "E": None, "w": None}
    reach = {"states": [9.0, 9.0], "inputs": [1.0]}
    held = UncertainModel.from_continuous(**arguments, remainder=reach)
    assert held.bounds()[1].tolist() == [0.0, 0.0]
    varying = UncertainModel.from_continuous(**arguments, remainder=reach, varying="Delta")
    x = flow(np.array(INTEGRATOR["A"]), np.array([0.0, 2.0]), np.zeros(2), 0.25)  # Delta = 1, then -1; u = 1
    x = flow(np.array(INTEGRATOR["A"]), np.array([0.0, 0.0]), x, 0.25)
    mean = held.block("B") @ [1.0]
    assert x[1] == pytest.approx(mean[1])
    assert x[0] - mean[0] == pytest.approx(varying.bounds()[1][0], rel=1e-8)
    assert varying.bounds()[1][1] == 0.0


@pytest.mark.parametrize("observer", [WindowObserver, ConstrainedZonotopeObserver])
def test_a_square_wave_inside_the_sample(observer: Any) -> None:
    """Falsifies a healthy double integrator whose w is held, as the documentation says; not one whose w varies."""
    A, Ts = np.array(INTEGRATOR["A"]), INTEGRATOR["Ts"]
    start = HPolytope.box([-1e-3, -1e-3], [1e-3, 1e-3])
    for varying, expected in (((), "falsified"), ("w", "consistent")):
        model = UncertainModel.from_continuous(**INTEGRATOR, n=[1e-3, 1e-3], varying=varying)
        watching, x, verdicts = observer(model, start), np.zeros(2), []
        watching.update(y0=x)
        for _ in range(40):
            x = flow(A, np.array([0.0, 1.0]), x, Ts / 2)
            x = flow(A, np.array([0.0, -1.0]), x, Ts / 2)
            verdicts.append(watching.step(u=[0.0], y=x).verdict)
        assert verdicts[-1] == expected
        assert expected == "falsified" or set(verdicts) == {"consistent"}


def test_a_measured_disturbance_that_varies_has_a_value_at_the_sample_and_a_mean() -> None:
    arguments = INTEGRATOR | {
        "C": [[1.0, 0.0]],
        "F": [[0.3]],
        "names": {"disturbances": ["gust"], "states": ["p", "v"]},
    }
    held = UncertainModel.from_continuous(**arguments)
    varying = UncertainModel.from_continuous(**arguments, varying=["gust"])
    assert held.n_disturbances == 1
    assert varying.names is not None
    names = ["gust", "mean of gust", "remainder of p", "remainder of v"]
    assert varying.names["disturbances"] == names
    assert varying.block("E")[:, 0].tolist() == [0.0, 0.0]
    assert varying.block("F").tolist() == [[0.3, 0.0, 0.0, 0.0]]
    assert varying.block("E")[1, 1] == pytest.approx(0.5)


def test_a_measured_delta_that_varies_has_a_value_at_the_sample_and_a_mean() -> None:
    item = Uncertainty(B=[[0.0], [0.1]], D=[[0.2], [0.0]], name="gain")
    arguments = INTEGRATOR | {"uncertainties": [item], "remainder": {"states": [9.0, 9.0], "inputs": [2.0]}}
    assert len(UncertainModel.from_continuous(**arguments).uncertainties) == 1
    output, state = UncertainModel.from_continuous(**arguments, varying="Delta").uncertainties
    assert (output.B, state.D) == (None, None)
    assert np.array_equal(output.D, item.D)
    assert np.allclose(state.B, [[0.1 / 8], [0.05]])


@pytest.mark.parametrize("seed", range(20))
def test_no_bound_is_below_its_formula_in_exact_arithmetic(seed: int) -> None:
    """Where A is nilpotent every integral is a polynomial, and rounding alone would put half of them too low."""
    rng = np.random.default_rng(seed)
    Ts, e, size, gain = (float(v) for v in rng.uniform(0.01, 1.0, 4))
    exact = [Fraction(v) for v in (Ts, e, size, gain)]
    plant = UncertainModel(
        [[0.0, 1.0], [0.0, 0.0]], None, np.eye(2), E=[[0.0], [e]], w=[size], Ts=Ts,
        uncertainties=[Uncertainty(A=[[0.0, 0.0], [gain, 0.0]], bounds=(0.0, 1.0))],
    )  # fmt: skip
    t, e_, r, g = exact
    _, _, rest = wandering(plant, np.array([True]))
    assert Fraction(float(rest[0])) >= e_ * r * t**2 / 2  # int_0^Ts |t e| dt r
    width = left_out(plant, np.array([1.0, 1.0]), np.zeros(0), vary_in(plant, ()))
    # growth [[t^2/2, t^3/6], [0, t^2/2]] times gain (0, g) times speed (|v|, e r + g |p|)
    assert Fraction(float(width[0])) >= t**3 / 6 * g
    assert Fraction(float(width[1])) >= t**2 / 2 * g
    assert width[0] <= float(t**3 / 6 * g) * (1 + 1e-8)


@pytest.mark.parametrize("seed", range(8))
def test_the_integrals_are_tight(seed: int) -> None:
    """Against sums over a fine grid, which may be below by what the grid misses."""
    rng = np.random.default_rng(seed)
    n, Ts = 3, float(rng.choice([0.01, 0.3, 2.0]))
    A, M = rng.normal(size=(n, n)) - rng.choice([0, 5]) * np.eye(n), rng.normal(size=(n, 2))
    t = (np.arange(2000) + 0.5) / 2000 * Ts
    step, values = expm(A * Ts / 2000), [expm(A * t[0])]
    for _ in t[1:]:
        values.append(step @ values[-1])
    along = np.array(values)
    for held in (kept(A, M, Ts), zero_order_hold(A, M, Ts)[1], np.zeros_like(M)):
        found = departure(A, M, held, Ts)
        sums = np.abs(along @ M - held / Ts).mean(axis=0) * Ts
        assert (found >= sums * (1 - 1e-5)).all()
        assert (found <= sums * 1.02 + 1e-3 * Ts * sums.max()).all()
    metzler = np.where(np.eye(n, dtype=bool), A, np.abs(A))
    sums = sum(expm(metzler * (Ts - s)) * s for s in (t[4::10] + t[5::10]) / 2) * Ts / 200
    np.testing.assert_allclose(growth(A, Ts), sums, rtol=1e-3, atol=1e-6 * Ts**2)


def test_what_decays_stays_small() -> None:
    """dx/dt = -10 x over 1 s: through exp(|A| t) the bound would be of the order of 2202."""
    assert growth(np.array([[-10.0]]), 1.0)[0, 0] == pytest.approx((np.exp(-10.0) - 1 + 10.0) / 100, rel=1e-12)
    found = remainder_bound([[-10.0]], None, Ts=1.0, x=[1.0], uncertainties=[Uncertainty(A=[[1.0]], bounds=(0.0, 1.0))])
    assert found[0] < 1.1


def test_powers_of_two_on_the_states_change_no_bit_of_a_bound() -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 5))
        A, M, d = rng.normal(size=(n, n)), rng.normal(size=(n, 2)), 2.0 ** rng.integers(-60, 61, n)
        held = zero_order_hold(A, M, 0.3)[1]
        scaled = departure(d[:, None] * A / d, d[:, None] * M, d[:, None] * held, 0.3)
        assert np.array_equal(scaled, d[:, None] * departure(A, M, held, 0.3))
        assert np.array_equal(growth(d[:, None] * A / d, 0.3), d[:, None] * growth(A, 0.3) / d)


@pytest.mark.parametrize(
    ("varying", "error", "message"),
    [
        ("gust", ValueError, r"varying names 'gust'; expected any of all, w, Delta, w\[0\], Delta\[0\], mass"),
        (["w", 3], TypeError, "varying is .*; expected names such as"),
        (True, TypeError, "varying is True; expected names"),
        ("w[1]", ValueError, r"varying names 'w\[1\]'"),
        ("mass", ValueError, r"remainder is missing"),
    ],
)
def test_mistakes_about_what_varies_are_named(varying: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        UncertainModel.from_continuous(
            **INTEGRATOR, uncertainties=[Uncertainty(B=[[0.0], [0.1]], name="mass")], varying=varying
        )


def moving_gain(seed: int, count: int) -> tuple[Array, Array]:
    """dx/dt = [[0, 1], [-4, -0.5]] x + [0, w + (1 + Delta) u] with Delta and w switching inside the samples: u, x."""
    rng, x, A = np.random.default_rng(seed), np.zeros(2), np.array([[0.0, 1.0], [-4.0, -0.5]])
    u, states = rng.choice([-1.0, 1.0], (count, 1)), [np.zeros(2)]
    for k in range(count):
        for length in rng.dirichlet(np.ones(4)) * 0.2:
            delta, w = rng.choice([-0.3, 0.3]), rng.choice([-0.1, 0.1])
            x = flow(A, np.array([0.0, w + (1 + delta) * u[k, 0]]), x, length)
        states.append(x)
    return u, np.array(states)


@pytest.mark.parametrize(("varying", "most"), [("all", 0), ((), 120)])
def test_the_state_stays_in_the_set_while_delta_moves_inside_the_samples(varying: Any, most: int) -> None:
    """Without measurements the set of every sample is one transition wide; held Deltas lose the state, as stated."""
    outside = 0
    for seed in range(3):
        u, states = moving_gain(seed, 40)
        model = UncertainModel.from_continuous(
            [[0.0, 1.0], [-4.0, -0.5]], [[0.0], [1.0]], np.eye(2), Ts=0.2, E=[[0.0], [1.0]], w=[0.1], n=[1e-3, 1e-3],
            uncertainties=[Uncertainty(B=[[0.0], [1.0]], bounds=(-0.3, 0.3), name="gain")],
            remainder={"states": [9.0, 9.0], "inputs": [1.0]}, varying=varying,
        )  # fmt: skip
        for k in range(40):
            observer = WindowObserver(model, HPolytope.box(states[k] - 1e-9, states[k] + 1e-9), horizon=1)
            observer.update(y0=[np.nan, np.nan])
            step = observer.step(u=u[k], y=[np.nan, np.nan])
            rows = np.vstack([np.eye(2), -np.eye(2), [[10.0, -1.0], [-10.0, 1.0]]])
            outside += int((rows @ states[k + 1] > step.support(rows) + 1e-9).any())
    assert outside <= most
    assert varying or outside > 10
