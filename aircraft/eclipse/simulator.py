"""Nonlinear longitudinal flight of the Eclipse: dynamics and closed-loop runs.

The paper prints neither X, Z nor M. This surrogate is identified from its derivatives, so that its trim
and its linearisation reproduce them: it is consistent with the published derivatives, it is not the real
aircraft. Two weak points show: the induced-drag factor k is above the value without leading-edge suction,
1 / CLa = 0.46, and k_r acts like the ram drag of an engine.

With V^2 = u^2 + w^2, alpha = atan2(w, u), qhat = q c / (2 V), Q = rho V^2 S / 2, eta in degrees:

    CL = CL0 + CLa alpha + CLe eta,   CD = CD0 + k CL^2 + CDe eta,   Cm = Cma alpha + Cmq qhat + Cme eta
    du/dt = Q (CL sin(alpha) - CD cos(alpha)) / m + 24.76 tau - k_r u - g sin(theta) - q w + d_u
    dw/dt = Q (-CL cos(alpha) - CD sin(alpha)) / m + g cos(theta) + q u + d_w
    dq/dt = Q c Cm / I_y - 0.294 tau + M_wdot dw/dt + d_q,   M_wdot = rho S c^2 Cmad / (4 I_y)

and equation (14) of Rosa and Silvestre (2013) for theta, the distance p_N and the height h, with the sign
of q u corrected. The elevator zero cannot be identified from derivatives; Cm0 = 0 fixes it.

`simulator.c` beside this file computes them; it takes all constants from here.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aircraft.eclipse.derivatives import (
    AIR_DENSITY,
    CHORD,
    GRAVITY,
    MASS,
    PITCH_INERTIA,
    PUBLISHED,
    WING_AREA,
    Derivatives,
)
from polytopes.native import Entries, Given, Integer, Real, floats, function

Array = NDArray[np.float64]

_derivative = function("fdi_eclipse_derivative", Integer, *[Given] * 4, Entries)
_fly = function("fdi_eclipse_fly", Integer, Real, *[Given] * 9, *[Entries] * 3)


@dataclass(frozen=True)
class Surrogate:
    """Coefficients of the nonlinear model (angles in radians, elevator in degrees).

    The defaults are what `aircraft.eclipse.identification.identify` finds. ``normal_coupling`` is the sign
    of q u in dw/dt: +1; equation (14) prints -1.
    """

    CL0: float = 0.002639
    CLa: float = 2.179
    CLe: float = -0.003028
    CD0: float = 0.006651
    k: float = 0.8181
    CDe: float = 8.663e-5
    k_r: float = 0.03654  # 1/s
    Cma: float = -0.1042
    Cmq: float = -0.5463
    Cmad: float = 0.9042
    Cme: float = 0.00106
    normal_coupling: float = 1.0

    @property
    def M_wdot(self) -> float:
        """Pitch acceleration per unit of dw/dt [rad/m]."""
        return AIR_DENSITY * WING_AREA * CHORD**2 * self.Cmad / (4 * PITCH_INERTIA)

    def packed(self) -> Array:
        """Everything that the core's functions need, in their order."""
        force, moment = AIR_DENSITY * WING_AREA / (2 * MASS), AIR_DENSITY * WING_AREA * CHORD / (2 * PITCH_INERTIA)
        thrust, thrust_moment = PUBLISHED["X_tau"][2], PUBLISHED["M_tau"][2]
        return np.array([*astuple(self), self.M_wdot, force, moment, CHORD / 2, GRAVITY, thrust, thrust_moment])

    def derivative(self, x: ArrayLike, u: ArrayLike, d: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
        """d/dt [u, w, theta, q] at states x (..., 4), inputs [eta deg, tau] and disturbances [d_u, d_w, d_q]."""
        x, u, d = floats(x), floats(u), floats(d)
        shape = np.broadcast_shapes(x.shape[:-1], u.shape[:-1], d.shape[:-1])
        state, out = np.zeros((*shape, 6)), np.empty((*shape, 6))
        state[..., :4] = x
        given = [np.broadcast_to(array, (*shape, array.shape[-1])) for array in (u, d)]
        _derivative(math.prod(shape), self.packed(), state, *given, out)
        return out[..., :4]


@dataclass(frozen=True)
class Controller:
    """A discrete output-feedback law about a trim, as `aircraft.eclipse.autopilot` designs it.

    estimate' = predicted + M (y - y_t - C predicted);  u = clip(u_t - K estimate');
    predicted = A estimate' + B (u - u_t).  All states are deviations from the trim.
    """

    A: Array
    B: Array
    C: Array
    M: Array
    K: Array
    u_trim: Array
    y_trim: Array
    lower: Array
    upper: Array


@dataclass(frozen=True)
class Corruption:
    """How faults act inside a run, one row a sample and held over it.

    Attributes
    ----------
    bias : (K, 4)
        Added to the measurements [V, alpha, theta, q] that the autopilot and the log receive.
    effectiveness : (K, 2)
        Factors on the ABSOLUTE achieved inputs; the log keeps the commands.
    moment : (K,)
        Relative increase of M_u: adds moment * M_u(V) (u - moment_reference) to dq/dt.
    moment_reference : float
        Zero for absolute u [m/s].
    """

    bias: Array
    effectiveness: Array
    moment: Array
    moment_reference: float = 0.0

    @classmethod
    def none(cls, samples: int) -> Corruption:
        return cls(np.zeros((samples, 4)), np.ones((samples, 2)), np.zeros(samples))


@dataclass(frozen=True)
class Flight:
    """One simulated run: states [u, w, theta, q, p_N, h] (K, 6), commands (K, 2), measurements (K, 4)."""

    x: Array
    u: Array
    y: Array


def fly(
    surrogate: Surrogate,
    controller: Controller,
    x0: ArrayLike,
    disturbance: Array,
    noise: Array,
    corruption: Corruption,
    Ts: float,
    excitation: Array | None = None,
) -> Flight:
    """Fly K samples in closed loop with RK4, two substeps a sample.

    Parameters
    ----------
    x0 : (4,) array
        [u, w, theta, q] at the first sample.
    disturbance : (K, 3) array
        [d_u, d_w, d_q], held over each sample [m/s^2, m/s^2, rad/s^2].
    noise : (K, 4) array
        Added to [V, alpha, theta, q].
    excitation : (K, 2) array, optional
        Superposed on the autopilot's [eta deg, tau] before the inputs' limits; the log keeps the sum.

    Raises
    ------
    ValueError
        If the arrays differ in length, or the state leaves the finite numbers.
    """
    samples = len(disturbance)
    superposed = np.zeros((samples, 2)) if excitation is None else excitation
    given = (disturbance, noise, superposed, corruption.bias, corruption.effectiveness, corruption.moment)
    arrays = [floats(array) for array in given]
    names = ("disturbance", "noise", "excitation", "corruption.bias", "corruption.effectiveness", "corruption.moment")
    expected = ((samples, 3), (samples, 4), (samples, 2), (samples, 4), (samples, 2), (samples,))
    for name, array, shape in zip(names, arrays, expected, strict=True):
        if array.shape != shape:
            raise ValueError(f"{name} has shape {array.shape}; expected {shape}, one row a sample of disturbance")
    x, u, y = np.zeros((samples, 6)), np.zeros((samples, 2)), np.zeros((samples, 4))
    x[:1, :4] = x0
    law = np.concatenate([np.ravel(getattr(controller, f.name)) for f in fields(Controller)])
    speed_moment = np.array([*Derivatives().polynomials["M_u"], corruption.moment_reference])
    _fly(samples, Ts, surrogate.packed(), speed_moment, law, *arrays, x, u, y)
    if not np.isfinite(x).all():
        raise ValueError("the simulated state is no longer finite; start closer to a trim between 25 and 55 m/s")
    return Flight(x, u, y)
