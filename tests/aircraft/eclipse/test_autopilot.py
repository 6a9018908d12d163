"""The LQG autopilot."""

import numpy as np
import pytest

from aircraft.eclipse.autopilot import DESIGN_AIRSPEED, INPUT_LOWER, INPUT_UPPER, design_autopilot
from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.scenarios import TS
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import level_trim, linearise, output_matrix
from svo.models.discretisation import zero_order_hold


def _closed_loop(c, A, B, C):
    """Plant state and predicted estimate, one sample: estimate' = p + M (C x - c.C p), u = -K estimate'."""
    n = len(A)
    correct = np.hstack([c.M @ C, np.eye(n) - c.M @ c.C])
    control = -c.K @ correct
    plant = np.hstack([A, np.zeros((n, n))]) + B @ control
    return np.vstack([plant, c.A @ correct + c.B @ control])


@pytest.mark.parametrize("noise", NOISE_SETS)
@pytest.mark.parametrize("airspeed", [30.0, 37.0, 45.0, 50.0])
def test_closed_loop_with_the_simulator_is_stable(noise, airspeed):
    c = design_autopilot(NOISE_SETS[noise], TS, Surrogate(), Derivatives())
    trim = level_trim(Surrogate(), airspeed)
    poles = np.linalg.eigvals(_closed_loop(c, *zero_order_hold(*linearise(Surrogate(), trim), TS), output_matrix(trim)))
    assert np.abs(poles).max() < np.exp(-0.05 * TS)


@pytest.mark.parametrize("noise", NOISE_SETS)
def test_separation_holds_at_the_design_point(noise):
    c = design_autopilot(NOISE_SETS[noise], TS, Surrogate(), Derivatives())
    poles = np.linalg.eigvals(_closed_loop(c, c.A, c.B, c.C))
    separate = np.concatenate([np.linalg.eigvals(c.A - c.B @ c.K), np.linalg.eigvals(c.A @ (np.eye(4) - c.M @ c.C))])
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(separate), atol=1e-6)
    assert np.abs(poles).max() < 1


def test_it_flies_about_the_trim_at_37_within_the_limits():
    c = design_autopilot(NOISE_SETS["quiet"], TS, Surrogate(), Derivatives())
    trim = level_trim(Surrogate(), DESIGN_AIRSPEED)
    assert DESIGN_AIRSPEED == 37.0
    np.testing.assert_array_equal(c.u_trim, trim.u)
    np.testing.assert_array_equal(c.y_trim, trim.y)
    np.testing.assert_array_equal(INPUT_LOWER, [-25, 0])
    np.testing.assert_array_equal(INPUT_UPPER, [25, 0.39])
