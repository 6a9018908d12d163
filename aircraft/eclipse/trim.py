"""Level trim of the surrogate and its linearisation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import root

from aircraft.eclipse.derivatives import VALID_AIRSPEED
from aircraft.eclipse.simulator import Surrogate
from svo.checks import Array


@dataclass(frozen=True)
class Trim:
    """Steady level flight at one airspeed: alpha = theta [rad], elevator [deg], thrust command."""

    airspeed: float
    alpha: float
    elevator_deg: float
    thrust: float

    @property
    def x(self) -> Array:
        """[u, w, theta, q]."""
        return np.array([self.airspeed * np.cos(self.alpha), self.airspeed * np.sin(self.alpha), self.alpha, 0.0])

    @property
    def u(self) -> Array:
        """[eta, tau]."""
        return np.array([self.elevator_deg, self.thrust])

    @property
    def y(self) -> Array:
        """[V, alpha, theta, q]."""
        return np.array([self.airspeed, self.alpha, self.alpha, 0.0])


@lru_cache(maxsize=1024)
def level_trim(surrogate: Surrogate, airspeed: float) -> Trim:
    """The level trim at V [m/s].

    Raises
    ------
    ValueError
        If the airspeed is outside the range of the derivatives, 25 to 55 m/s.
    """
    low, high = VALID_AIRSPEED
    if not low <= airspeed <= high:
        raise ValueError(f"airspeed is {airspeed} m/s; expected {low} to {high}, the range of the derivatives")

    def residual(unknowns: Array) -> Array:
        trim = Trim(airspeed, *unknowns)
        return surrogate.derivative(trim.x, trim.u)[[0, 1, 3]]

    guess = np.array([140.0 / airspeed**2, 13800.0 / airspeed**2, 0.13])  # lift = weight fixes alpha V^2 and eta V^2
    answer = root(residual, guess, tol=1e-13)
    if not np.abs(residual(answer.x)).max() <= 1e-9:  # NaN included
        raise ValueError(f"surrogate {surrogate} has no level trim at {airspeed} m/s; check its coefficients")
    return Trim(float(airspeed), *(float(v) for v in answer.x))


def linearise(surrogate: Surrogate, trim: Trim) -> tuple[Array, Array]:
    """A (4, 4) and B (4, 2) of the surrogate at a trim, by central differences."""
    point, steps = np.concatenate([trim.x, trim.u]), np.array([1e-3, 1e-3, 1e-5, 1e-5, 1e-3, 1e-5])

    def slope(direction: Array) -> Array:
        ahead, behind = point + direction, point - direction
        return surrogate.derivative(ahead[:4], ahead[4:]) - surrogate.derivative(behind[:4], behind[4:])

    columns = np.column_stack([slope(e) / (2 * e.max()) for e in np.diag(steps)])
    return columns[:, :4], columns[:, 4:]


def output_matrix(trim: Trim) -> Array:
    """Derivative (4, 4) of the measurements [V, alpha, theta, q] with respect to [u, w, theta, q]."""
    sine, cosine = np.sin(trim.alpha), np.cos(trim.alpha)
    C = np.zeros((4, 4))
    C[0, :2] = cosine, sine
    C[1, :2] = -sine / trim.airspeed, cosine / trim.airspeed
    C[2, 2] = C[3, 3] = 1.0
    return C


def gust_directions(surrogate: Surrogate) -> Array:
    """Continuous directions (4, 3) of d_u, d_w and d_q: a normal gust also pitches, through dw/dt."""
    return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, surrogate.M_wdot, 1.0]])
