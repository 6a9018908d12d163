"""The LQG autopilot that flies the Eclipse at 37 m/s (Rosa and Silvestre 2013, section 6; weights are ours)."""

from __future__ import annotations

import numpy as np

from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.noise import NoiseSet
from aircraft.eclipse.simulator import Controller, Surrogate
from aircraft.eclipse.trim import Trim, gust_directions, level_trim, output_matrix
from svo.checks import Array
from svo.models import zero_order_hold

DESIGN_AIRSPEED = 37.0
INPUT_LOWER = np.array([-25.0, 0.0])  # elevator [deg], thrust command
INPUT_UPPER = np.array([25.0, 0.39])
STATE_WEIGHT = np.diag([1.0, 1 / 4, 1 / 0.05**2, 1 / 0.3**2])
INPUT_WEIGHT = np.diag([1 / 4**2, 1 / 0.03**2])


def design_autopilot(noise: NoiseSet, Ts: float, surrogate: Surrogate, derivatives: Derivatives) -> Controller:
    """LQG about the level trim at 37 m/s, for gusts and noise of standard deviation bound / 2.

    The plant model is the corrected published one, discretised exactly. The estimate used at a sample
    includes the measurement of that sample.
    """
    from scipy.linalg import solve_discrete_are  # imported here: detection designs no autopilot

    trim = level_trim(surrogate, DESIGN_AIRSPEED)
    A, B, C, E = discrete_model(derivatives, trim, surrogate, Ts)
    cost = solve_discrete_are(A, B, STATE_WEIGHT, INPUT_WEIGHT)
    K = np.linalg.solve(INPUT_WEIGHT + B.T @ cost @ B, B.T @ cost @ A)
    process = E @ np.diag(np.square(noise.gusts) / 4) @ E.T
    sensor = np.diag(np.square(noise.sensors) / 4)
    covariance = solve_discrete_are(A.T, C.T, process, sensor)
    M = np.linalg.solve(C @ covariance @ C.T + sensor, C @ covariance).T
    return Controller(A, B, C, M, K, trim.u, trim.y, INPUT_LOWER, INPUT_UPPER)


def discrete_model(
    derivatives: Derivatives, trim: Trim, surrogate: Surrogate, Ts: float
) -> tuple[Array, Array, Array, Array]:
    """Exact (zero-order-hold) A, B, C and gust matrix E (4, 3) about a trim, in deviations from it."""
    continuous = derivatives.A(trim.airspeed)
    A, BE = zero_order_hold(continuous, np.hstack([derivatives.B(trim.airspeed), gust_directions(surrogate)]), Ts)
    return A, BE[:, :2], output_matrix(trim), BE[:, 2:]
