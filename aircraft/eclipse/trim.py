"""Level trim of the surrogate and its linearisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from aircraft.eclipse.derivatives import VALID_AIRSPEED
from aircraft.eclipse.simulator import Surrogate
from svo.checks import Array

_STEPS = 8  # of Newton's method; three bring the default surrogate's trims to rounding
_LARGEST_RESIDUAL = 1e-9  # m/s^2, rad/s^2


@dataclass(frozen=True)
class Trim:
    """Steady level flight: alpha = theta [rad], elevator [deg], thrust command, at one airspeed or at each of many."""

    airspeed: Array
    alpha: Array
    elevator_deg: Array
    thrust: Array

    @property
    def x(self) -> Array:
        """[u, w, theta, q] (..., 4)."""
        u, w = self.airspeed * np.cos(self.alpha), self.airspeed * np.sin(self.alpha)
        return np.stack([u, w, self.alpha, np.zeros_like(u)], axis=-1)

    @property
    def u(self) -> Array:
        """[eta, tau] (..., 2)."""
        return np.stack([self.elevator_deg, self.thrust], axis=-1)

    @property
    def y(self) -> Array:
        """[V, alpha, theta, q] (..., 4)."""
        return np.stack([self.airspeed, self.alpha, self.alpha, np.zeros_like(self.alpha)], axis=-1)


def level_trim(surrogate: Surrogate, airspeed: ArrayLike) -> Trim:
    """The level trim at each V [m/s], any shape, by Newton's method.

    Raises
    ------
    ValueError
        If an airspeed is outside the range of the derivatives, 25 to 55 m/s, or has no level trim.
    """
    V, (low, high) = np.asarray(airspeed, dtype=float), VALID_AIRSPEED
    outside = ~((low <= V) & (high >= V))  # NaN included
    if outside.any():
        raise ValueError(f"airspeed is {V[outside][0]} m/s; expected {low} to {high}, the range of the derivatives")
    # Lift = weight fixes alpha V^2 and eta V^2.
    unknowns = np.stack([140.0 / V**2, 13800.0 / V**2, np.full_like(V, 0.13)], axis=-1)
    with np.errstate(all="ignore"):  # what is not finite has no small residual
        for _ in range(_STEPS):
            residual, slope = _residual(surrogate, V, unknowns)
            slope[np.linalg.det(slope) == 0.0] = np.nan
            unknowns = unknowns - np.linalg.solve(slope, residual[..., None])[..., 0]
        left = np.abs(_residual(surrogate, V, unknowns)[0]).max(axis=-1)
    failed = ~(left <= _LARGEST_RESIDUAL)
    if failed.any():
        raise ValueError(f"surrogate {surrogate} has no level trim at {V[failed][0]} m/s; check its coefficients")
    return _trim(V, unknowns)


def _trim(V: Array, unknowns: Array) -> Trim:
    return Trim(V, *np.moveaxis(unknowns, -1, 0))


def _residual(surrogate: Surrogate, V: Array, unknowns: Array) -> tuple[Array, Array]:
    """d/dt of u, w, q (..., 3), and its derivative (..., 3, 3) with respect to alpha, elevator and thrust."""
    trim = _trim(V, unknowns)
    A, B = linearise(surrogate, trim)
    u, w = trim.x[..., 0], trim.x[..., 1]
    turned = np.stack([-w, u, np.ones_like(u), np.zeros_like(u)], axis=-1)  # dx / dalpha
    slope = np.concatenate([A @ turned[..., None], B], axis=-1)
    moving = [0, 1, 3]  # dtheta/dt = q is 0 at every unknown
    return surrogate.derivative(trim.x, trim.u)[..., moving], slope[..., moving, :]


def linearise(surrogate: Surrogate, trim: Trim) -> tuple[Array, Array]:
    """A (..., 4, 4) and B (..., 4, 2) of the surrogate at a trim, by central differences."""
    point = np.concatenate([trim.x, trim.u], axis=-1)[..., None, :]
    steps = np.array([1e-3, 1e-3, 1e-5, 1e-5, 1e-3, 1e-5])
    ahead, behind = point + np.diag(steps), point - np.diag(steps)
    ends = [surrogate.derivative(at[..., :4], at[..., 4:]) for at in (ahead, behind)]
    joint = np.swapaxes((ends[0] - ends[1]) / (2 * steps[:, None]), -1, -2)
    return joint[..., :4], joint[..., 4:]


def output_matrix(trim: Trim) -> Array:
    """Derivative (..., 4, 4) of the measurements [V, alpha, theta, q] with respect to [u, w, theta, q]."""
    sine, cosine = np.sin(trim.alpha), np.cos(trim.alpha)
    C = np.zeros((*np.shape(trim.alpha), 4, 4))
    C[..., 0, 0], C[..., 0, 1] = cosine, sine
    C[..., 1, 0], C[..., 1, 1] = -sine / trim.airspeed, cosine / trim.airspeed
    C[..., 2, 2] = C[..., 3, 3] = 1.0
    return C


def gust_directions(surrogate: Surrogate) -> Array:
    """Continuous directions (4, 3) of d_u, d_w and d_q: a normal gust also pitches, through dw/dt."""
    return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, surrogate.M_wdot, 1.0]])
