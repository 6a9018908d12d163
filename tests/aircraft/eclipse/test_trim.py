"""Level trim, and the simulator's linearisation against the published derivatives."""

from dataclasses import astuple

import numpy as np
import pytest
from scipy.optimize import root

from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import Trim, gust_directions, level_trim, linearise, output_matrix

TABLE = [  # V m/s, alpha = theta deg, eta deg, tau
    (25, 12.14, 21.2, 0.1675),
    (30, 8.69, 15.2, 0.1450),
    (37, 5.80, 10.09, 0.1311),
    (45, 3.93, 6.84, 0.1301),
    (55, 2.61, 4.56, 0.1410),
]


@pytest.mark.parametrize(("V", "alpha_deg", "eta_deg", "tau"), TABLE)
def test_trim_table(V, alpha_deg, eta_deg, tau):
    trim = level_trim(Surrogate(), float(V))
    assert np.degrees(trim.alpha) == pytest.approx(alpha_deg, abs=0.006)
    assert trim.elevator_deg == pytest.approx(eta_deg, abs=0.06)
    assert trim.thrust == pytest.approx(tau, abs=0.0001)


@pytest.mark.parametrize("V", [25.0, 33.3, 55.0])
def test_nothing_moves_at_trim(V):
    trim = level_trim(Surrogate(), V)
    np.testing.assert_allclose(Surrogate().derivative(trim.x, trim.u), 0, atol=1e-10)
    np.testing.assert_allclose(trim.y, [np.hypot(*trim.x[:2]), np.arctan2(trim.x[1], trim.x[0]), trim.x[2], 0])


@pytest.mark.parametrize("seed", range(3))
def test_trims_of_other_surrogates_are_the_roots_that_scipy_finds(seed):
    rng = np.random.default_rng(seed)
    surrogate = Surrogate(*(np.array(astuple(Surrogate())) * [*rng.uniform(0.7, 1.3, 11), 1.0]))
    speeds = rng.uniform(25.0, 55.0, 20)
    trims = level_trim(surrogate, speeds)
    for V, *found in zip(speeds, trims.alpha, trims.elevator_deg, trims.thrust, strict=True):

        def moving(unknowns, V=V):
            trim = Trim(V, *unknowns)
            return surrogate.derivative(trim.x, trim.u)[[0, 1, 3]]

        np.testing.assert_allclose(root(moving, np.array(found) * 1.05, tol=1e-13).x, found, rtol=1e-12)


def test_many_trims_are_each_the_one_at_its_airspeed():
    speeds = np.linspace(25.0, 55.0, 6).reshape(2, 3)
    many = level_trim(Surrogate(), speeds)
    assert many.x.shape == many.y.shape == (2, 3, 4)
    (A, B), C = linearise(Surrogate(), many), output_matrix(many)
    for place in np.ndindex(2, 3):
        one = level_trim(Surrogate(), speeds[place])
        np.testing.assert_array_max_ulp(many.x[place], one.x, 4)
        np.testing.assert_array_max_ulp(many.u[place], one.u, 4)
        np.testing.assert_allclose(A[place], linearise(Surrogate(), one)[0], atol=1e-9)
        np.testing.assert_allclose(B[place], linearise(Surrogate(), one)[1], atol=1e-9)
        np.testing.assert_allclose(C[place], output_matrix(one), atol=1e-15)


def test_a_moving_trim_shifts_the_state_as_much_as_the_airspeed():
    ahead, behind = level_trim(Surrogate(), 37.5), level_trim(Surrogate(), 36.5)
    assert (ahead.x - behind.x)[0] == pytest.approx(1.01, abs=0.005)


@pytest.mark.parametrize("airspeed", [24.9, 55.1, np.nan])
def test_no_trim_outside_the_range_of_the_derivatives(airspeed):
    with pytest.raises(ValueError, match=f"airspeed is {airspeed} m/s"):
        level_trim(Surrogate(), airspeed)
    with pytest.raises(ValueError, match=f"airspeed is {airspeed} m/s"):
        level_trim(Surrogate(), [37.0, airspeed])


@pytest.mark.parametrize("coefficients", [{"CLa": np.nan}, {"CLa": 0.0}, {"CLa": np.inf}, {"Cme": 0.0, "CLe": 0.0}])
def test_surrogate_that_cannot_fly_level_is_named(coefficients):
    with pytest.raises(ValueError, match=r"surrogate Surrogate.* has no level trim at 37.0 m/s"):
        level_trim(Surrogate(**coefficients, CDe=0.0), 37.0)


def test_linearisation_reproduces_the_published_derivatives_within_5_percent_rms():
    speeds, d = np.arange(25.0, 55.1, 2.5), Derivatives()
    pairs = [linearise(Surrogate(), level_trim(Surrogate(), V)) for V in speeds]
    errors = []
    for index, published in ((0, d.A(speeds)), (1, d.B(speeds))):
        fitted = np.array([pair[index] for pair in pairs])
        scale = np.sqrt(np.mean(published**2, axis=0))
        used = scale > 0
        errors.append(np.sqrt(np.mean((fitted - published) ** 2, axis=0))[used] / scale[used])
        np.testing.assert_allclose(fitted[:, ~used], 0, atol=1e-9)
    errors = np.concatenate(errors)
    assert np.sqrt(np.mean(errors**2)) < 0.05
    assert errors.max() < 0.09


def test_output_matrix_is_the_derivative_of_the_measurements():
    trim = level_trim(Surrogate(), 40.0)

    def outputs(x):
        return np.array([np.hypot(x[0], x[1]), np.arctan2(x[1], x[0]), x[2], x[3]])

    numeric = np.column_stack([(outputs(trim.x + e) - outputs(trim.x - e)) / 2e-5 for e in 1e-5 * np.eye(4)])
    np.testing.assert_allclose(output_matrix(trim), numeric, atol=1e-8)


def test_gust_directions_are_those_of_the_simulator():
    trim = level_trim(Surrogate(), 37.0)
    columns = np.column_stack([Surrogate().derivative(trim.x, trim.u, d) for d in np.eye(3)])
    np.testing.assert_allclose(gust_directions(Surrogate()), columns, atol=1e-9)
