"""The compiled closed-loop simulator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from aircraft.eclipse.autopilot import design_autopilot
from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.scenarios import TS, Scenarios
from aircraft.eclipse.simulator import Corruption, Surrogate, fly
from aircraft.eclipse.trim import level_trim

SURROGATE = Surrogate()
CONTROLLER = design_autopilot(NOISE_SETS["quiet"], TS, SURROGATE, Derivatives())
TRIM = level_trim(SURROGATE, 37.0)


def _fly(samples=200, x0=TRIM.x, corruption=None, gusts=None):
    gusts = np.zeros((samples, 3)) if gusts is None else gusts
    corruption = Corruption.none(samples) if corruption is None else corruption
    return fly(SURROGATE, CONTROLLER, x0, gusts, np.zeros((samples, 4)), corruption, TS)


def test_dynamics_are_those_of_the_docstring():
    s = Surrogate()
    x, u, d = np.array([36.0, 4.0, 0.15, 0.2]), np.array([8.0, 0.14]), np.array([0.3, -0.2, 0.05])
    V, alpha = np.hypot(36.0, 4.0), np.arctan2(4.0, 36.0)
    Q = 1.225 * V**2 * 2.365 / 2
    CL = s.CL0 + s.CLa * alpha + s.CLe * 8.0
    CD = s.CD0 + s.k * CL**2 + s.CDe * 8.0
    Cm = s.Cma * alpha + s.Cmq * 0.2 * 1.34 / (2 * V) + s.Cme * 8.0
    du = Q * (CL * np.sin(alpha) - CD * np.cos(alpha)) / 39.7 + 24.76 * 0.14 - s.k_r * 36 - 9.81 * np.sin(0.15)
    du += -0.2 * 4.0 + 0.3
    dw = Q * (-CL * np.cos(alpha) - CD * np.sin(alpha)) / 39.7 + 9.81 * np.cos(0.15) + 0.2 * 36 - 0.2
    dq = Q * 1.34 * Cm / 10.43 - 0.294 * 0.14 + 1.225 * 2.365 * 1.34**2 * s.Cmad / (4 * 10.43) * dw + 0.05
    np.testing.assert_allclose(s.derivative(x, u, d), [du, dw, 0.2, dq], rtol=1e-12)


def test_flight_stays_at_trim_without_disturbances():
    flight = _fly(1000)
    np.testing.assert_allclose(flight.x[:, :4], np.tile(TRIM.x, (1000, 1)), atol=1e-9)
    np.testing.assert_allclose(flight.u, np.tile(TRIM.u, (1000, 1)), atol=1e-9)
    np.testing.assert_allclose(flight.x[-1, 4:], [37.0 * 9.99, 0.0], atol=1e-6)  # distance and height


def test_two_substeps_agree_with_an_adaptive_integrator():
    start = TRIM.x + np.array([1.0, 1.5, 0.1, 0.5])
    flight = _fly(20, x0=start, gusts=np.random.default_rng(0).uniform(-1, 1, (20, 3)))
    gusts = np.random.default_rng(0).uniform(-1, 1, (20, 3))
    x = start
    for k in range(19):
        answer = solve_ivp(
            lambda _, z, k=k: SURROGATE.derivative(z, flight.u[k], gusts[k]), (0, TS), x, rtol=1e-11, atol=1e-12
        )
        x = answer.y[:, -1]
    np.testing.assert_allclose(flight.x[-1, :4], x, atol=2e-9)


def test_run_is_reproducible_bit_for_bit_from_its_seed():
    first, second, other = (Scenarios().run("elevator", "hard", "conservative", seed).flight for seed in (3, 3, 4))
    for name in ("x", "u", "y"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert (first.y != other.y).any()


def test_sensor_bias_reaches_the_autopilot():
    corruption = Corruption.none(200)
    corruption.bias[100:, 1] = 0.05
    flight, healthy = _fly(corruption=corruption), _fly()
    np.testing.assert_array_equal(flight.x[:101], healthy.x[:101])
    assert flight.y[100, 1] - healthy.y[100, 1] == pytest.approx(0.05)
    assert abs(flight.u[100, 0] - healthy.u[100, 0]) > 1e-3  # the autopilot sees it at once
    assert np.abs(flight.x[-1] - healthy.x[-1]).max() > 1e-3


def test_elevator_loss_multiplies_the_absolute_deflection_and_the_log_keeps_the_command():
    corruption = Corruption.none(200)
    corruption.effectiveness[100:, 0] = 0.5
    flight = _fly(corruption=corruption)
    np.testing.assert_allclose(flight.u[:101], np.tile(TRIM.u, (101, 1)), atol=1e-9)
    lost = (flight.x[101, 3] - flight.x[100, 3]) / TS
    assert lost == pytest.approx(-0.5 * TRIM.elevator_deg * Derivatives().value("M_eta", 37.0), rel=0.02)


@pytest.mark.parametrize(("reference", "sign"), [(0.0, 1), (float(TRIM.x[0]), 0)])
def test_dynamics_fault_acts_on_absolute_u_or_on_its_deviation(reference, sign):
    healthy = Corruption.none(200)
    moment = np.where(np.arange(200) >= 100, 0.3, 0.0)
    flight = _fly(corruption=Corruption(healthy.bias, healthy.effectiveness, moment, reference))
    pitch_up = (flight.x[101, 3] - flight.x[100, 3]) / TS
    assert pitch_up == pytest.approx(sign * 0.3 * Derivatives().value("M_u", 37.0) * TRIM.x[0], rel=0.02, abs=1e-8)


@pytest.mark.parametrize(("sensor", "size", "channel"), [(0, 100.0, 1), (2, 10.0, 0)])
@pytest.mark.parametrize("sign", [-1, 1])
def test_inputs_respect_their_limits(sensor, size, channel, sign):
    corruption = Corruption.none(60)
    corruption.bias[:, sensor] = sign * size  # seems much too fast or slow, much too nose-up or nose-down
    u = _fly(60, corruption=corruption).u
    assert (u >= CONTROLLER.lower).all()
    assert (u <= CONTROLLER.upper).all()
    assert (CONTROLLER.lower if sign > 0 else CONTROLLER.upper)[channel] in u[:, channel]


def test_wrong_shapes_are_named():
    with pytest.raises(ValueError, match="noise"):
        fly(SURROGATE, CONTROLLER, TRIM.x, np.zeros((5, 3)), np.zeros((4, 4)), Corruption.none(5), TS)
    with pytest.raises(ValueError, match=r"corruption\.bias"):
        fly(SURROGATE, CONTROLLER, TRIM.x, np.zeros((5, 3)), np.zeros((5, 4)), Corruption.none(6), TS)


def test_diverged_flight_is_an_error():
    gusts = np.full((50, 3), 1e155)
    with pytest.raises(ValueError, match="finite"):
        _fly(50, gusts=gusts)
