"""Fault objects: what they do to a run is explained, sample by sample, by the model that they give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo.faults import ActuatorFault, Exponential, Intermittent, PlantFault, Ramp, SensorFault, Step
from svo.models.model import UncertainModel, Uncertainty

SENSOR_KINDS = ("bias", "drift", "scaling", "hard")
ACTUATOR_KINDS = (
    "loss", "floating", "hard-over", "oscillatory-solid", "oscillatory-liquid", "locking", "runaway",
    "noise",
)  # fmt: skip
TRAVEL = (-3.0, 2.0)
START = 0.4


def random_model(rng: np.random.Generator, scheduled: bool, polytope: bool = False) -> UncertainModel:
    """A plant with every block of the model form present, and up to two uncertainties in most of them."""
    n, nu, ny, nw = rng.integers(1, 4), rng.integers(1, 3), rng.integers(1, 4), rng.integers(1, 3)
    shapes = {"A": (n, n), "B": (n, nu), "a": (n,), "E": (n, nw)}
    shapes |= {"C": (ny, n), "D": (ny, nu), "c": (ny,), "F": (ny, nw)}

    def block(name: str) -> Any:
        level, slope = rng.normal(size=(2, *shapes[name]))
        return (lambda s: level + s * slope) if scheduled else level

    def uncertainty(index: int) -> Uncertainty:
        chosen = [name for name in shapes if rng.random() < 0.7]
        lo, hi = np.sort(rng.normal(size=2))
        return Uncertainty(**{name: block(name) for name in chosen}, bounds=(lo, hi), name=f"u{index}")

    w = HPolytope.box(-np.ones(nw), np.full(nw, 0.5)) if polytope else (-np.ones(nw), np.full(nw, 0.5))
    noise = rng.uniform(0, 0.1, ny)
    return UncertainModel(
        **{name: block(name) for name in shapes},
        w=w,
        n=(lambda s: noise * (1 + s)) if scheduled else noise,
        Ts=0.1,
        schedule=0.5,
        names={"disturbances": [f"d{i}" for i in range(nw)]},
        uncertainties=[uncertainty(i) for i in range(rng.integers(0, 3))],
    )


@dataclass
class Draw:
    """One sample of everything that the nominal plant leaves open."""

    x: np.ndarray
    u: np.ndarray
    w: np.ndarray
    noise: np.ndarray
    deltas: np.ndarray
    schedule: float


def draw(model: UncertainModel, rng: np.random.Generator) -> Draw:
    schedule = rng.uniform(0, 1)
    lower, upper, noise = model.bounds(schedule)
    return Draw(
        x=rng.normal(size=model.n_states),
        u=rng.uniform(*TRAVEL, size=model.n_inputs),
        w=rng.choice([lower, upper]),
        noise=noise * rng.choice([-1, 1], size=noise.shape),
        deltas=np.array([rng.choice(q.bounds) for q in model.uncertainties]),
        schedule=schedule,
    )


def evaluate(model: UncertainModel, sample: Draw, deltas: np.ndarray, u: np.ndarray, w: np.ndarray) -> np.ndarray:
    """[x(k+1); y(k)] without noise."""
    total = np.tensordot(np.concatenate([[1.0], deltas]), model.stack(sample.schedule), axes=1)
    return total @ np.concatenate([sample.x, u, [1.0], w])


def full_deltas(model: UncertainModel, nominal: UncertainModel, sample: Draw, delta: float | None) -> np.ndarray:
    """Nominal Deltas, then the fault's, then its products with the nominal ones, found by their names."""
    by_name = dict(zip([q.name for q in nominal.uncertainties], sample.deltas, strict=True))
    values = list(sample.deltas)
    for extra in model.uncertainties[len(values) :]:
        factor = by_name[extra.name.split(" x ")[0]] if " x " in extra.name else 1.0
        assert delta is not None
        values.append(factor * delta)
    for value, q in zip(values, model.uncertainties, strict=True):
        assert q.bounds[0] - 1e-12 <= value <= q.bounds[1] + 1e-12
    return np.array(values)


def assert_explained(
    model: UncertainModel, sample: Draw, deltas: np.ndarray, w: np.ndarray, next_state: np.ndarray, y: np.ndarray
) -> None:
    """The model with these Deltas and w gives this x(k+1), and y within its noise."""
    lower, upper, noise = model.bounds(sample.schedule)
    assert (w >= lower - 1e-12).all()
    assert (w <= upper + 1e-12).all()
    n = model.n_states
    explained = evaluate(model, sample, deltas, sample.u, w)
    np.testing.assert_allclose(explained[:n], next_state, atol=1e-9)
    assert (np.abs(y - explained[n:]) <= noise + 1e-9).all()


def achieved_deflection(
    kind: str, u: np.ndarray, p: float, since: float, magnitude: Any, held: np.ndarray, v: np.ndarray
) -> np.ndarray:
    """The table of the docstring, written once more."""
    match kind:
        case "loss":
            return (1 - p * magnitude) * u
        case "floating":
            return (1 - p) * u
        case "hard-over":
            return (1 - p) * u + p * magnitude
        case "oscillatory-solid":
            return (1 - p) * u + p * v
        case "oscillatory-liquid" | "noise":
            return u + v
        case "locking":
            return (1 - p) * u + p * held
    return np.clip(held + magnitude * since, *TRAVEL) if p else u


def some_channels(rng: np.random.Generator, count: int) -> tuple[int, ...]:
    return tuple(int(i) for i in rng.permutation(count)[: rng.integers(1, count + 1)])


def some_profile(rng: np.random.Generator) -> Any:
    return rng.choice([Step(START), Ramp(START, 2.0), Exponential(START, 0.7), Intermittent(START, 0.5, duty=0.4)])


seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=60, deadline=None)


@few
@given(seed=seeds, kind=st.sampled_from(SENSOR_KINDS), scheduled=st.booleans())
def test_a_faulty_sensor_is_explained_by_its_model(seed: int, kind: Any, scheduled: bool) -> None:
    rng = np.random.default_rng(seed)
    nominal = random_model(rng, scheduled)
    where, size, profile = some_channels(rng, nominal.n_outputs), float(rng.normal() * 2), some_profile(rng)
    fault = SensorFault(where, kind, size, profile)
    model = fault.model(nominal)
    for t in np.arange(0, 3, 0.3):
        sample, p = draw(nominal, rng), float(profile.value(t))
        clean = evaluate(nominal, sample, sample.deltas, sample.u, sample.w)
        healthy = clean[nominal.n_states :] + sample.noise
        faulty = healthy.copy()
        for i in where:
            faulty[i] = {
                "bias": healthy[i] + p * size,
                "drift": healthy[i] + p * size,
                "scaling": (1 + p * size) * healthy[i],
                "hard": (1 - p) * healthy[i] + p * size,
            }[kind]
        np.testing.assert_allclose(fault.corrupt(t, healthy), faulty, atol=1e-12)
        for y, delta in ((faulty, float(fault.delta(t))), (healthy, 0.0)):
            deltas = full_deltas(model, nominal, sample, delta)
            assert_explained(model, sample, deltas, sample.w, clean[: nominal.n_states], y)


@few
@given(seed=seeds, kind=st.sampled_from(ACTUATOR_KINDS), scheduled=st.booleans(), polytope=st.booleans())
def test_a_faulty_actuator_is_explained_by_its_model(seed: int, kind: Any, scheduled: bool, polytope: bool) -> None:
    rng = np.random.default_rng(seed)
    nominal = random_model(rng, scheduled, polytope)
    where = some_channels(rng, nominal.n_inputs)
    magnitude = {"loss": rng.uniform(0.01, 1), "locking": None, "floating": None}.get(kind, rng.uniform(0.1, 4))
    fault = ActuatorFault(
        where,
        kind,
        magnitude,
        Step(START) if kind == "runaway" else some_profile(rng),
        travel=TRAVEL if kind in ("locking", "runaway") else None,
        frequency_hz=1.3 if kind.startswith("oscillatory") else None,
        seed=5 if kind == "noise" else None,
    )
    model, held = fault.model(nominal), rng.uniform(*TRAVEL, size=nominal.n_inputs)
    for t in np.arange(0, 3, 0.3):
        sample, p = draw(nominal, rng), float(fault.profile.value(t))
        u, moved = sample.u[list(where)], sample.u.copy()
        wave = float(np.sin(2 * np.pi * 1.3 * max(t - START, 0)))
        amplitude = {"oscillatory-solid": 1.0, "oscillatory-liquid": p}.get(kind)
        v = np.zeros(0) if amplitude is None else np.full(len(where), amplitude * magnitude * wave)
        if kind == "noise":
            v = (fault.corrupt(t, 0 * sample.u) - 0 * sample.u)[list(where)]
            assert (np.abs(v) <= p * magnitude).all()
        moved[list(where)] = achieved_deflection(kind, u, p, t - START, magnitude, held[list(where)], v)
        np.testing.assert_allclose(fault.corrupt(t, sample.u, held), moved, atol=1e-12)
        for achieved, delta in ((moved, float(fault.delta(t))), (sample.u, 0.0)):
            truth = evaluate(nominal, sample, sample.deltas, achieved, sample.w)
            if kind in ("locking", "runaway"):
                v = achieved[list(where)]
            elif delta == 0.0:
                v = 0 * v
            y = truth[nominal.n_states :] + sample.noise
            deltas = full_deltas(model, nominal, sample, delta)
            assert_explained(model, sample, deltas, np.concatenate([sample.w, v]), truth[: nominal.n_states], y)


@few
@given(seed=seeds, scheduled=st.booleans())
def test_a_faulty_plant_is_explained_by_its_model(seed: int, scheduled: bool) -> None:
    rng = np.random.default_rng(seed)
    nominal = random_model(rng, scheduled)
    slope = rng.normal(size=(nominal.n_states, nominal.n_states))
    direction = Uncertainty(A=(lambda s: s * slope) if scheduled else slope, c=rng.normal(size=nominal.n_outputs))
    fault = PlantFault(direction, float(rng.normal()), some_profile(rng))
    model = fault.model(nominal)
    for t in np.arange(0, 3, 0.3):
        sample = draw(nominal, rng)
        clean = evaluate(nominal, sample, sample.deltas, sample.u, sample.w)
        matrix = sample.schedule * slope if scheduled else slope
        size = fault.magnitude * float(fault.profile.value(t))
        dx, dy = fault.perturbation(nominal, t, sample.x, sample.u, sample.w, schedule=sample.schedule)
        np.testing.assert_allclose(dx, size * matrix @ sample.x, atol=1e-12)
        np.testing.assert_allclose(dy, size * np.asarray(direction.c), atol=1e-12)
        deltas = full_deltas(model, nominal, sample, float(fault.delta(t)))
        truth = clean + np.concatenate([dx, dy])
        y = truth[nominal.n_states :] + sample.noise
        assert_explained(model, sample, deltas, sample.w, truth[: nominal.n_states], y)


@pytest.mark.parametrize("kind", ACTUATOR_KINDS)
def test_a_whole_run_is_corrupted_as_its_samples_are(kind: Any) -> None:
    rng, t = np.random.default_rng(0), np.arange(30) * 0.1
    u = rng.uniform(*TRAVEL, size=(30, 2))
    fault = ActuatorFault(
        1,
        kind,
        None if kind in ("locking", "floating") else 0.8,
        Step(0.7),
        travel=TRAVEL if kind in ("locking", "runaway") else None,
        frequency_hz=0.5 if kind.startswith("oscillatory") else None,
        seed=5 if kind == "noise" else None,
    )
    whole = fault.corrupt(t, u)
    by_sample = np.array([fault.corrupt(tk, uk, held=u[6]) for tk, uk in zip(t, u, strict=True)])
    np.testing.assert_array_equal(whole, by_sample)
    np.testing.assert_array_equal(whole[:7], u[:7])
    np.testing.assert_array_equal(whole[:, 0], u[:, 0])
    if kind == "locking":
        np.testing.assert_array_equal(whole[7:, 1], np.full(23, u[6, 1]))
    if kind == "runaway":
        np.testing.assert_allclose(whole[7:10, 1], np.minimum(u[6, 1] + 0.8 * (t[7:10] - 0.7), TRAVEL[1]))


def test_noise_is_uniform_the_same_for_the_same_time_and_another_for_another_seed() -> None:
    t, u = np.arange(2000) * 0.01, np.ones((2000, 2))
    found = [ActuatorFault(0, "noise", 0.5, Step(1.0), seed=seed).corrupt(t, u)[:, 0] - 1.0 for seed in (3, 3, 4)]
    np.testing.assert_array_equal(found[0], found[1])
    assert not np.array_equal(found[0], found[2])
    assert (found[0][:100] == 0).all()
    assert np.abs(found[0]).max() <= 0.5
    assert np.std(found[0][100:]) == pytest.approx(0.5 / np.sqrt(3), rel=0.05)
    assert abs(np.corrcoef(found[0][100:-1], found[0][101:])[0, 1]) < 0.1


def test_a_runaway_stops_at_its_travel() -> None:
    fault = ActuatorFault(0, "runaway", -5.0, Step(1.0), travel=(-25.0, 25.0))
    t = np.arange(0, 12, 0.5)
    achieved = fault.corrupt(t, np.full((t.size, 1), 10.0))[:, 0]
    np.testing.assert_allclose(achieved, np.where(t < 1, 10.0, np.maximum(10 - 5 * (t - 1), -25)))


def test_a_missing_reading_stays_missing() -> None:
    for kind in SENSOR_KINDS:
        corrupted = SensorFault(0, kind, 2.0, Ramp(0.0, 1.0)).corrupt(0.5, [np.nan, 1.0])
        assert np.isnan(corrupted[0])
        assert corrupted[1] == 1.0


def test_known_models_of_the_eclipse_faults() -> None:
    """Widened noise, and Uncertainty(B = -B_eta, bounds = (0, 0.5))."""
    B = np.array([[1.0, 2.0], [3.0, 4.0]])
    nominal = UncertainModel(np.eye(2), B, np.eye(2), n=[0.1, 0.2])
    biased = SensorFault(1, "bias", -0.5, Step()).model(nominal)
    np.testing.assert_allclose(biased.bounds()[2], [0.1, 0.7])
    assert biased.uncertainties == ()
    weak = ActuatorFault(0, "loss", 0.5, Step()).model(nominal)
    np.testing.assert_array_equal(weak.block("B", uncertainty=0), [[-1.0, 0.0], [-3.0, 0.0]])
    assert weak.uncertainties[0].bounds == (0.0, 0.5)
    assert not weak.uses_input_in_output


def test_two_faults_combine() -> None:
    nominal = UncertainModel(np.eye(1), np.ones((1, 1)), np.eye(1), n=0.1)
    both = SensorFault(0, "scaling", 0.1, Step()).model(ActuatorFault(0, "loss", 0.5, Step()).model(nominal))
    assert [q.bounds for q in both.uncertainties] == [(0.0, 0.5), (0.0, 0.1)]


# -- profiles ------------------------------------------------------------------------------------


@few
@given(start=st.integers(-300, 300), k=st.integers(-500, 500), Ts=st.sampled_from([0.01, 0.1, 0.02, 1 / 3]))
def test_a_step_starts_at_its_sample_whatever_the_rounding(start: int, k: int, Ts: float) -> None:
    assert Step(float(f"{start * Ts:.12g}")).value(k * Ts) == (k >= start)
    summed = float(np.sum(np.full(abs(k), Ts))) * np.sign(k)
    assert Step(start * Ts).value(summed) == (k >= start)


def test_profiles_have_their_shapes() -> None:
    t = np.array([-1.0, 0.5, 1.0, 1.5, 2.0, 4.0])
    np.testing.assert_array_equal(Step(1.0).value(t), [0, 0, 1, 1, 1, 1])
    np.testing.assert_allclose(Ramp(1.0, 2.0).value(t), [0, 0, 0, 0.25, 0.5, 1])
    np.testing.assert_allclose(Exponential(1.0, 2.0).value(t), [0, 0, 0, *(1 - np.exp(-np.array([0.25, 0.5, 1.5])))])
    np.testing.assert_array_equal(Intermittent(1.0, 1.0, duty=0.5).value(t), [0, 0, 1, 0, 1, 1])


def test_an_intermittent_fault_keeps_its_duty_on_a_grid() -> None:
    values = Intermittent(0.5, 0.3, duty=1 / 3).value(np.arange(3050) * 0.01)
    np.testing.assert_array_equal(values[:50], 0)
    np.testing.assert_array_equal(values[50:], np.tile([1.0] * 10 + [0.0] * 20, 100))


@given(
    t=st.floats(-1e6, 1e6),
    profile=st.one_of(
        st.builds(Step, st.floats(-100, 100)),
        st.builds(Ramp, st.floats(-100, 100), st.floats(1e-3, 100)),
        st.builds(Exponential, st.floats(-100, 100), st.floats(1e-3, 100)),
        st.builds(Intermittent, st.floats(-100, 100), st.floats(1e-3, 100), st.floats(0.01, 0.99)),
    ),
)
def test_a_profile_stays_between_zero_and_one(t: float, profile: Any) -> None:
    value = profile.value(t)
    assert value.shape == ()
    assert 0 <= value <= 1
    if t < profile.start - 1e-6:
        assert value == 0


# -- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Step(np.nan), "start is nan"),
        (lambda: Ramp(0.0, 0.0), "duration is 0"),
        (lambda: Exponential(0.0, -1.0), "time_constant is -1"),
        (lambda: Intermittent(0.0, 0.0), "period is 0"),
        (lambda: Intermittent(0.0, 1.0, duty=1.0), "duty is 1"),
        (lambda: SensorFault(-1, "bias", 1.0, Step()), "where is -1"),
        (lambda: SensorFault((0, 0), "bias", 1.0, Step()), "each once"),
        (lambda: SensorFault((), "bias", 1.0, Step()), "at least one channel"),
        (lambda: SensorFault(True, "bias", 1.0, Step()), "where is True"),
        (lambda: SensorFault(0, "offset", 1.0, Step()), "kind is 'offset'"),  # type: ignore[arg-type]
        (lambda: SensorFault(0, "bias", 0.0, Step()), "not zero"),
        (lambda: SensorFault(0, "hard", np.inf, Step()), "magnitude of the hard is inf"),
        (lambda: ActuatorFault(0, "jam", None, Step()), "kind is 'jam'"),  # type: ignore[arg-type]
        (lambda: ActuatorFault(0, "loss", 1.5, Step()), "lost fraction"),
        (lambda: ActuatorFault(0, "loss", None, Step()), "needs a finite number"),
        (lambda: ActuatorFault(0, "floating", 1.0, Step()), "has none"),
        (lambda: ActuatorFault(0, "locking", None, Step()), "travel is None; locking needs one"),
        (lambda: ActuatorFault(0, "loss", 0.5, Step(), travel=(0, 1)), "loss takes none"),
        (lambda: ActuatorFault(0, "locking", None, Step(), travel=(1, 1)), "lower < upper"),
        (lambda: ActuatorFault(0, "oscillatory-liquid", 1.0, Step()), "frequency_hz is None"),
        (lambda: ActuatorFault(0, "oscillatory-solid", 1.0, Step(), frequency_hz=0.0), "frequency_hz is 0"),
        (lambda: ActuatorFault(0, "oscillatory-solid", -1.0, Step(), frequency_hz=1.0), "amplitude > 0"),
        (lambda: ActuatorFault(0, "noise", 1.0, Step()), "seed is None; noise needs one"),
        (lambda: ActuatorFault(0, "noise", 1.0, Step(), seed=-1), "seed is -1; expected an integer >= 0"),
        (lambda: ActuatorFault(0, "noise", -1.0, Step(), seed=1), "amplitude > 0"),
        (lambda: ActuatorFault(0, "loss", 0.5, Step(), seed=1), "loss takes none"),
        (lambda: ActuatorFault(0, "runaway", 0.0, Step(), travel=(-1, 1)), "rate of the runaway"),
        (lambda: ActuatorFault(0, "runaway", 1.0, Ramp(0.0, 1.0), travel=(-1, 1)), "give it a Step"),
        (lambda: PlantFault(Uncertainty(), 0.0, Step()), "not zero"),
    ],
)
def test_bad_arguments_are_refused_by_name(build: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build()


def test_a_direction_must_be_an_uncertainty() -> None:
    with pytest.raises(TypeError, match="direction is a ndarray"):
        PlantFault(np.eye(2), 1.0, Step())  # type: ignore[arg-type]


def test_channels_that_do_not_exist_are_refused() -> None:
    nominal = UncertainModel(np.eye(2), np.ones((2, 1)), np.eye(2))
    with pytest.raises(ValueError, match=r"where is \(2,\) but there are 2 outputs"):
        SensorFault(2, "bias", 1.0, Step()).model(nominal)
    with pytest.raises(ValueError, match=r"where is \(1,\) but there are 1 inputs"):
        ActuatorFault(1, "loss", 0.5, Step()).model(nominal)
    with pytest.raises(ValueError, match="2 channels in y"):
        SensorFault(2, "bias", 1.0, Step()).corrupt(0.0, [0.0, 0.0])
    locked = ActuatorFault(0, "locking", None, Step(), travel=(-1, 1))
    with pytest.raises(ValueError, match="held is missing"):
        locked.corrupt(0.0, [0.0])
    with pytest.raises(ValueError, match=r"held has shape \(2,\)"):
        locked.corrupt(0.0, [0.0], held=[0.0, 0.0])


def test_an_edge_is_met_within_a_nanosecond_and_not_within_half_a_microsecond() -> None:
    for early, value in ((5e-10, 1.0), (5e-9, 0.0), (5e-7, 0.0)):
        assert Step(1.0).value(1.0 - early) == value
        assert Intermittent(0.0, 2.0).value(2.0 - early) == value
