"""The observers' models: discretisation, contents, and the true flight inside each of them."""

from dataclasses import replace

import numpy as np
import pytest

from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.mismatch import SPAWN_KEY, largest, measure, mismatch, seeds, to_toml
from aircraft.eclipse.models import MismatchBounds, ScheduledModel, read_bounds
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.scenarios import FAULTS, HEALTHY, LARGEST, PROFILES, TS, Scenarios, corrupt
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import level_trim
from svo.models.discretisation import zero_order_hold

SCENARIOS = Scenarios()
FLIGHTS = [(HEALTHY, ""), *((fault, profile) for fault in FAULTS for profile in PROFILES)]


def _model(noise, fault):
    name = "nominal" if fault == HEALTHY else fault
    model = SCENARIOS.model.model(noise, read_bounds()[noise][name])
    return model if fault == HEALTHY else SCENARIOS.fault(fault, LARGEST).model(model)


def _true_deltas(model, run):
    if not model.uncertainties:
        return np.zeros((len(run.time), 0))
    return np.zeros((len(run.time), 1)) if run.fault is None else run.fault.delta(run.time)[:, None]


def _worst_row(model, run):
    """Largest violation of any row of the model by the true flight, with its true gusts and Delta."""
    x, u, y, deltas = run.flight.x[:, :4], run.flight.u, run.flight.y, _true_deltas(model, run)
    worst = -np.inf
    for delta, uncertainty in zip(deltas.T, model.uncertainties, strict=True):
        worst = max(worst, (delta - uncertainty.bounds[1]).max(), (uncertainty.bounds[0] - delta).max())
    for k in range(len(run.time)):
        _, upper, noise = model.bounds(run.schedule[k])
        total = np.tensordot([1.0, *deltas[k]], model.stack(run.schedule[k]), axes=1)
        known = total @ np.concatenate([x[k], u[k], [1.0], run.gusts[k], np.zeros(4)])
        worst = max(worst, (np.abs(y[k] - known[4:]) - noise).max(), (np.abs(run.gusts[k]) - upper[:3]).max())
        if k + 1 < len(run.time):
            worst = max(worst, (np.abs(x[k + 1] - known[:4]) - upper[3:]).max())
    return worst


@pytest.mark.parametrize("noise", NOISE_SETS)
@pytest.mark.parametrize(("fault", "profile"), FLIGHTS)
def test_true_flight_satisfies_every_row_of_its_model(noise, fault, profile):
    for seed in (0, 1):
        run = SCENARIOS.run(fault, profile, noise, seed)
        assert _worst_row(_model(noise, fault), run) <= 1e-12


@pytest.mark.parametrize("noise", NOISE_SETS)
@pytest.mark.parametrize("fault", FAULTS)
def test_fault_free_flight_satisfies_every_fault_model(noise, fault):
    assert _worst_row(_model(noise, fault), SCENARIOS.run(HEALTHY, "", noise, 2)) <= 1e-12


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_flight_violates_the_nominal_model(fault):
    assert _worst_row(_model("quiet", HEALTHY), SCENARIOS.run(fault, "step", "quiet", 0)) > 1e-6


def test_deviation_form_of_the_dynamics_fault_is_contained_too():
    reference = float(level_trim(Surrogate(), 37.0).x[0])
    deviation = Scenarios(ScheduledModel(TS, moment_reference=reference))
    run = deviation.run("dynamics", "step", "quiet", 0)
    contained = deviation.model.model("quiet", read_bounds()["quiet"]["dynamics"])
    model = deviation.fault("dynamics", LARGEST).model(contained)
    assert _worst_row(model, run) <= 1e-12
    healthy = deviation.run(HEALTHY, "", "quiet", 0)
    q, q_healthy = run.flight.x[:, 3], healthy.flight.x[: len(run.time), 3]
    assert np.abs(q - q_healthy).max() < np.radians(0.05)  # it hides in regulated flight
    absolute = SCENARIOS.run("dynamics", "step", "quiet", 0)
    assert np.abs(absolute.flight.x[:, 3]).max() > np.radians(3.0)


@pytest.mark.parametrize(
    ("fault", "profile", "noise"),
    [pytest.param(f, p, n, marks=pytest.mark.slow) for n in NOISE_SETS for f, p in FLIGHTS],
)
def test_mismatch_stays_within_its_bounds_over_a_thousand_flights(fault, profile, noise):
    bounds = read_bounds()[noise]["nominal" if fault == HEALTHY else fault]
    for seed in range(1000):
        seen = mismatch(SCENARIOS.run(fault, profile, noise, np.random.SeedSequence(seed)), SCENARIOS)
        assert (np.abs(seen.state).max(axis=0) <= bounds.state).all(), seed
        assert (np.abs(seen.output).max(axis=0) <= bounds.output + 1e-15).all(), seed


def test_models_have_the_stated_uncertainties():
    assert _model("quiet", HEALTHY).uncertainties == ()
    alpha, sensors = _model("quiet", "alpha"), np.asarray(NOISE_SETS["quiet"].sensors)
    widened = sensors + read_bounds()["quiet"]["alpha"].output + [0, np.radians(5), 0, 0]
    np.testing.assert_allclose(alpha.bounds(37.0)[2], widened, rtol=1e-12)
    elevator = _model("quiet", "elevator")
    assert elevator.uncertainties[0].bounds == (0.0, 0.5)
    np.testing.assert_array_equal(elevator.block("B", 37.1, uncertainty=0), -elevator.block("B", 37.1) * [1, 0])
    dynamics = _model("quiet", "dynamics")
    assert dynamics.uncertainties[0].bounds == (0.0, 1.0)
    direction = dynamics.block("A", 37.0, uncertainty=0)
    assert np.linalg.matrix_rank(direction) == 1
    np.testing.assert_array_equal(direction[:, 1:], 0)
    assert direction[3, 0] == pytest.approx(0.3 * Derivatives().value("M_u", 37.0) * TS, rel=0.01)


def test_every_model_has_seven_disturbances():
    model = _model("conservative", HEALTHY)
    assert model.n_disturbances == 7
    np.testing.assert_array_equal(model.block("E", 40.0)[:, 3:], np.eye(4))
    _, upper, _ = model.bounds(40.0)
    np.testing.assert_array_equal(upper[:3], [0.5, 1.0, 0.05])


@pytest.mark.parametrize("V", [25.0, 37.0, 50.0])
def test_scheduled_trim_is_an_equilibrium_of_the_model(V):
    model, trim = _model("quiet", HEALTHY), level_trim(Surrogate(), V)
    stack = model.stack(V)[0]
    known = stack @ np.concatenate([trim.x, trim.u, [1.0], np.zeros(7)])
    np.testing.assert_allclose(known, np.concatenate([trim.x, trim.y]), atol=1e-11)


def test_gusts_are_discretised_exactly():
    V = 37.0
    blocks, M_wdot = SCENARIOS.model.blocks.at(V), Surrogate().M_wdot
    fine = np.zeros((4, 3))
    A, steps = Derivatives().A(V), 20000
    directions = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 0], [0, M_wdot, 1.0]])
    for _ in range(steps):
        fine += (A @ fine + directions) * (TS / steps)
    np.testing.assert_allclose(blocks["E"][:, :3], fine, rtol=1e-4, atol=1e-9)


def test_exact_direction_of_the_speed_moment_beats_the_euler_direction():
    """Gamma e_q errs by less than 3e-6 in every state, Ts e_q by 2.9e-5 rad in theta."""
    V = 37.0
    A, trim = Derivatives().A(V), level_trim(Surrogate(), V)
    change = np.zeros((4, 4))
    change[3, 0] = 0.3 * Derivatives().value("M_u", V)
    exact = zero_order_hold(A + change, (change @ trim.x)[:, None], TS)[1][:, 0]
    ours = SCENARIOS.model.blocks.at(V)["moment"] @ trim.x
    assert np.abs(exact - ours).max() < 3e-6
    assert abs(exact - TS * change @ trim.x)[2] == pytest.approx(2.9e-5, abs=1e-6)


def test_euler_costs_fifty_times_the_mismatch_in_theta():
    run = SCENARIOS.run("elevator", "step", "quiet", 0)
    exact = np.abs(mismatch(run, SCENARIOS).state).max(axis=0)[2]
    x = run.flight.x[:, :4]
    euler = np.abs(x[1:, 2] - (x[:-1, 2] + TS * x[:-1, 3])).max()  # the theta row of I + Ts A, at any airspeed
    assert euler > 50 * exact


def test_filtered_airspeed_beats_the_raw_one_in_steady_flight_and_a_frozen_model_elsewhere():
    def worst(fault, profile, schedule):
        run = SCENARIOS.run(fault, profile, "conservative", 0)
        return np.abs(mismatch(replace(run, schedule=schedule(run)), SCENARIOS).state).max(axis=0)

    def raw(run):
        return run.flight.y[:, 0]

    def filtered(run):
        return run.schedule

    def frozen(run):
        return np.full(len(run.time), 37.0)

    assert (worst(HEALTHY, "", filtered) < 0.8 * worst(HEALTHY, "", raw)).all()
    assert (worst(HEALTHY, "", frozen)[:2] < worst(HEALTHY, "", raw)[:2]).all()
    for fault, profile in (("elevator", "step"), ("dynamics", "soft")):  # the airspeed changes by metres per second
        assert (worst(fault, profile, filtered)[2:] < 0.4 * worst(fault, profile, frozen)[2:]).all()


@pytest.mark.slow
def test_a_margin_of_1_2_does_not_cover_fault_free_flight():
    measured = largest(SCENARIOS, HEALTHY, "conservative", 300).state
    flights = (np.random.SeedSequence(99, spawn_key=(i,)) for i in range(1000))
    seen = [mismatch(SCENARIOS.run(HEALTHY, "", "conservative", seed), SCENARIOS).state for seed in flights]
    assert (np.abs(seen).max(axis=(0, 1)) / measured).max() > 1.5


def test_measuring_seeds_are_disjoint_from_those_of_a_study():
    measuring = {s.spawn_key for noise in NOISE_SETS for fault in (HEALTHY, *FAULTS) for s in seeds(noise, fault, 3)}
    assert len(measuring) == 24
    assert all(len(key) == 4 and key[0] == SPAWN_KEY for key in measuring)
    spawned = {s.spawn_key for s in np.random.SeedSequence(0).spawn(1000)} | {()}
    assert not measuring & spawned


def test_measured_bounds_are_reproducible_and_their_file_reads_back(tmp_path):
    first, second = (measure(SCENARIOS, 1) for _ in range(2))
    text = to_toml(first, 1)
    assert text == to_toml(second, 1)
    shipped = read_bounds()
    for noise, observers in first.items():
        assert set(observers) == set(shipped[noise]) == {"nominal", *FAULTS}
        for name, bounds in observers.items():  # one flight sees no more than five hundred
            assert (bounds.state <= shipped[noise][name].state * 1.001).all()
            assert (bounds.output <= shipped[noise][name].output * 1.001).all()
            assert (bounds.state >= first[noise]["nominal"].state).all()


def test_file_states_how_it_was_measured():
    text = to_toml(measure(SCENARIOS, 1), 1)
    assert "python -m aircraft.eclipse.mismatch --runs 1" in text


def test_bad_bounds_are_refused():
    with pytest.raises(ValueError, match="state"):
        MismatchBounds(np.array([1.0, -1.0, 0, 0]), np.zeros(4))
    with pytest.raises(ValueError, match="output"):
        MismatchBounds(np.zeros(4), np.zeros(3))


def test_unknown_scenarios_are_refused():
    with pytest.raises(ValueError, match="rudder"):
        SCENARIOS.fault("rudder", "step")
    with pytest.raises(ValueError, match="sudden"):
        SCENARIOS.fault("alpha", "sudden")
    with pytest.raises(ValueError, match="loud"):
        SCENARIOS.run(HEALTHY, "", "loud", 0)


def test_faults_start_at_their_first_faulty_sample():
    time = np.arange(150) * TS
    steps = {fault: corrupt(SCENARIOS.fault(fault, "step"), time, 0.0) for fault in FAULTS}
    np.testing.assert_allclose(steps["alpha"].bias[[49, 50], 1], [0, np.radians(3)])
    np.testing.assert_allclose(steps["elevator"].effectiveness[[49, 50], 0], [1, 0.5])
    np.testing.assert_allclose(steps["dynamics"].moment[[49, 50]], [0, 0.3])
    ramp = corrupt(SCENARIOS.fault("alpha", "hard"), time, 0.0).bias[:, 1]
    np.testing.assert_allclose(ramp[[50, 100, 149]], np.radians([0, 2.5, 5 * 0.99]), atol=1e-12)
