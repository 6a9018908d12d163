"""The missile's equations with their corrections, its closed loop, and how faults act in it."""

from dataclasses import replace

import numpy as np
import pytest

from aircraft.missile.airframe import Airframe
from aircraft.missile.imu import DELAY, NOISE_SETS, SensorErrors
from aircraft.missile.scenarios import DL, DM, DN, ETA, SCENARIOS, TS, Flights, corruption_of, locked, thrust_loss
from aircraft.missile.simulator import START, Corruption, Guidance, derivative, fly, rotation, specific_force
from svo.faults import SensorFault, Step

STATE = np.array([1e4, 2e3, -5e3, 610.0, 14.0, -31.0, 0.2, -0.3, 0.1, 0.15, 0.2, -0.4])
INPUT = np.array([0.02, -0.05, 0.08, 0.4])
IDEAL = SensorErrors.none()


def test_imu_measures_non_gravitational_acceleration() -> None:
    """Correction 1: a = dv/dt + omega x v - f_g / m; equation (1) as printed adds the weight to the reading."""
    airframe = Airframe()
    p = airframe.packed()
    v, omega = STATE[3:6], STATE[6:9]
    phi, theta = STATE[9], STATE[10]
    gravity = 9.81 * np.array([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
    inertial = derivative(STATE, INPUT, p)[3:6] + np.cross(omega, v)
    measured = specific_force(STATE, INPUT, p)
    np.testing.assert_allclose(measured, inertial - gravity, atol=1e-10)
    assert np.linalg.norm(measured - inertial) == pytest.approx(9.81)


def test_unpowered_fall_in_vacuum_reads_zero() -> None:
    vacuum = replace(Airframe(), thrust_min=0.0).packed()
    vacuum[32] = 0.0
    np.testing.assert_allclose(specific_force(STATE, np.zeros(4), vacuum), 0.0)


def test_moments_have_the_reference_length() -> None:
    """Correction 2: the same missile described in other units of length turns alike, which needs Q s_ref l_ref."""
    unit = 0.3048
    metres = Airframe()
    feet = replace(
        metres,
        reference_area=metres.reference_area / unit**2,
        reference_length=metres.reference_length / unit,
        roll_inertia=metres.roll_inertia / unit**2,
        pitch_inertia=metres.pitch_inertia / unit**2,
        density=metres.density * unit**3,
        scale_height=metres.scale_height / unit,
    )
    there = STATE.copy()
    there[:6] /= unit
    turned = derivative(STATE, INPUT, metres.packed())[6:9]
    np.testing.assert_allclose(derivative(there, INPUT, feet.packed())[6:9], turned, rtol=1e-12)
    # As printed, Q s_ref L / a: it changes with the unit by the factor 1 / unit.
    assert not np.allclose(derivative(there, INPUT, feet.packed())[6:9] / unit, turned, rtol=0.5)


def test_normal_force_has_its_minus_sign() -> None:
    """Correction 3: a positive incidence (nose up, v_bz > 0) lifts, against the z axis that points down."""
    up = STATE.copy()
    up[5] = 60.0
    assert specific_force(up, np.zeros(4), Airframe().packed())[2] < -10.0


def test_kinematics_keep_position_and_attitude_consistent() -> None:
    """Equations (3) and (4): d(R)/dt = R W, so that an inertial vector stays put while the body turns."""
    p, h = Airframe().packed(), 1e-6
    x_dot = derivative(STATE, INPUT, p)
    R = rotation(STATE[9:12])
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(x_dot[:3], R @ STATE[3:6], atol=1e-10)
    slope = (rotation(STATE[9:12] + h * x_dot[9:12]) - rotation(STATE[9:12] - h * x_dot[9:12])) / (2 * h)
    wp, wq, wr = STATE[6:9]
    np.testing.assert_allclose(slope, R @ np.array([[0, -wr, wq], [wr, 0, -wp], [-wq, wp, 0]]), atol=1e-8)


def test_intercept_without_a_fault() -> None:
    flight = Flights().run((), NOISE_SETS["gaussian"], 0, 80.0).flight
    closest = int(np.argmin(flight.distance))
    assert closest * TS == pytest.approx(75.4, abs=0.2)
    assert flight.distance[closest] < 34.0


@pytest.mark.parametrize(("number", "miss"), [(2, 500.0), (3, 1000.0)])
def test_faulty_fins_miss_the_target(number: int, miss: float) -> None:
    assert Flights().run(SCENARIOS[number].faults, IDEAL, 0, 80.0).flight.distance.min() > miss


def test_thrust_loss_alone_is_made_up_for_by_the_speed_loop() -> None:
    """Figure 3 shows all interceptions failed; here a quarter of the propulsion rate is in reserve."""
    flight = Flights().run(SCENARIOS[1].faults, IDEAL, 0, 80.0).flight
    assert flight.distance.min() < 34.0
    assert flight.computed[4000, ETA] < 1.0


def test_measurements_are_two_samples_late() -> None:
    flight = Flights().run((), IDEAL, 0, 5.0).flight
    np.testing.assert_array_equal(flight.y[DELAY:, 9:12], flight.x[:-DELAY, 3:6])
    np.testing.assert_array_equal(flight.y[DELAY:, :3], flight.acceleration[:-DELAY])


def test_runs_are_reproducible_and_share_noise_between_faults() -> None:
    flights, errors = Flights(model_error=0.02), NOISE_SETS["gaussian"]
    one, two = (flights.run(faults, errors, 7, 12.0) for faults in ((), (locked(DM, 10.0),)))
    again = flights.run((), errors, 7, 12.0)
    np.testing.assert_array_equal(one.flight.y, again.flight.y)
    np.testing.assert_array_equal(one.flight.y[:1000], two.flight.y[:1000])
    assert one.airframe == two.airframe != flights.airframe


def test_faults_act_as_their_objects_say() -> None:
    flight = Flights().run((locked(DN, 6.0), thrust_loss(0.25, 8.0)), IDEAL, 0, 10.0).flight
    assert np.ptp(flight.achieved[600:, DN]) == 0.0
    assert flight.achieved[600, DN] == flight.achieved[599, DN]
    np.testing.assert_allclose(flight.achieved[800:, ETA], 0.75 * flight.computed[800:, ETA])
    np.testing.assert_array_equal(flight.achieved[:, DL], flight.computed[:, DL])


def test_sensor_fault_acts_on_its_measurement_only() -> None:
    flights = Flights()
    faulty = flights.run((SensorFault(2, "bias", 5.0, Step(6.0)),), IDEAL, 0, 7.0).flight
    healthy = flights.run((), IDEAL, 0, 7.0).flight
    first = 600 + DELAY
    np.testing.assert_array_equal(faulty.y[:first], healthy.y[:first])
    np.testing.assert_allclose(faulty.y[first] - healthy.y[first], 5.0 * np.eye(15)[2], atol=1e-12)


def test_mistakes_of_the_caller_are_named() -> None:
    with pytest.raises(ValueError, match="two faults of actuator 1"):
        corruption_of((locked(DM, 1.0), locked(DM, 2.0)), np.arange(10.0))
    with pytest.raises(ValueError, match="error has shape"):
        fly(Airframe(), Guidance(), np.zeros((5, 3)), np.ones(15), 2, Corruption.none(5), TS)
    with pytest.raises(ValueError, match="delay is 0"):
        fly(Airframe(), Guidance(), np.zeros((5, 15)), np.ones(15), 0, Corruption.none(5), TS)
    with pytest.raises(ValueError, match="mass is -1"):
        Airframe(mass=-1.0)
    assert START.shape == (12,)
