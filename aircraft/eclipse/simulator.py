"""Nonlinear longitudinal flight of the Eclipse: compiled dynamics and closed-loop runs.

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

All compiled functions stand in this one file and take their constants as arguments: a cached machine code
does not notice a change in another file.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields

import numpy as np
from numba import njit
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

Array = NDArray[np.float64]

SUBSTEPS = 2


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
        """Everything that the compiled functions need; they read no constant of another file (see above)."""
        force, moment = AIR_DENSITY * WING_AREA / (2 * MASS), AIR_DENSITY * WING_AREA * CHORD / (2 * PITCH_INERTIA)
        thrust, thrust_moment = PUBLISHED["X_tau"][2], PUBLISHED["M_tau"][2]
        return np.array([*astuple(self), self.M_wdot, force, moment, CHORD / 2, GRAVITY, thrust, thrust_moment])

    def derivative(self, x: ArrayLike, u: ArrayLike, d: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
        """d/dt [u, w, theta, q] at state x (4,), input [eta deg, tau] and disturbance [d_u, d_w, d_q]."""
        state = np.zeros(6)
        state[:4] = np.asarray(x, dtype=float)
        out = np.empty(6)
        _derivative(state, np.asarray(u, dtype=float), np.asarray(d, dtype=float), np.zeros(5), self.packed(), out)
        return out[:4]


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
    superposed = np.zeros((samples, 2)) if excitation is None else np.ascontiguousarray(excitation, dtype=float)
    gusts, errors = np.ascontiguousarray(disturbance), np.ascontiguousarray(noise)  # one layout: compiled once
    arrays = (gusts, errors, superposed, corruption.bias, corruption.effectiveness, corruption.moment)
    names = ("disturbance", "noise", "excitation", "corruption.bias", "corruption.effectiveness", "corruption.moment")
    expected = ((samples, 3), (samples, 4), (samples, 2), (samples, 4), (samples, 2), (samples,))
    for name, array, shape in zip(names, arrays, expected, strict=True):
        if array.shape != shape:
            raise ValueError(f"{name} has shape {array.shape}; expected {shape}, one row a sample of disturbance")
    x, u, y = np.zeros((samples, 6)), np.zeros((samples, 2)), np.zeros((samples, 4))
    x[0, :4] = np.asarray(x0, dtype=float)
    law = tuple(np.ascontiguousarray(getattr(controller, f.name)) for f in fields(Controller))
    speed_moment = np.array([*Derivatives().polynomials["M_u"], corruption.moment_reference])
    _fly(x, u, y, *arrays, speed_moment, law, surrogate.packed(), Ts)
    if not np.isfinite(x).all():
        raise ValueError("the simulated state is no longer finite; start closer to a trim between 25 and 55 m/s")
    return Flight(x, u, y)


@njit(cache=True)
def _derivative(x, u, d, speed_moment, p, out):  # type: ignore[no-untyped-def]
    """Right-hand side; speed_moment = [M_u polynomial (3), reference u, relative increase]."""
    CL0, CLa, CLe, CD0, k, CDe, k_r, Cma, Cmq, _, Cme, coupling, M_wdot, force, torque, half_chord, g, X_tau, M_tau = p
    speed_squared = x[0] * x[0] + x[1] * x[1]
    speed = np.sqrt(speed_squared)
    alpha, sine, cosine = np.arctan2(x[1], x[0]), x[1] / speed, x[0] / speed
    lift = CL0 + CLa * alpha + CLe * u[0]
    drag = CD0 + k * lift * lift + CDe * u[0]
    moment = Cma * alpha + Cmq * x[3] * half_chord / speed + Cme * u[0]
    aero_x, aero_z = lift * sine - drag * cosine, -lift * cosine - drag * sine
    out[0] = force * speed_squared * aero_x + X_tau * u[1] - k_r * x[0] - g * np.sin(x[2]) - x[3] * x[1] + d[0]
    out[1] = force * speed_squared * aero_z + g * np.cos(x[2]) + coupling * x[3] * x[0] + d[1]
    out[2] = x[3]
    out[3] = torque * speed_squared * moment + M_tau * u[1] + M_wdot * out[1] + d[2]
    M_u = (speed_moment[0] * speed + speed_moment[1]) * speed + speed_moment[2]
    out[3] += speed_moment[4] * M_u * (x[0] - speed_moment[3])
    out[4] = x[0] * np.cos(x[2]) + x[1] * np.sin(x[2])
    out[5] = x[0] * np.sin(x[2]) - x[1] * np.cos(x[2])


@njit(cache=True)
def _advance(x, u, d, speed_moment, p, Ts, out):  # type: ignore[no-untyped-def]
    """One sample of RK4 with everything but the state held."""
    h = Ts / SUBSTEPS
    k1, k2, k3, k4 = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    out[:] = x
    for _ in range(SUBSTEPS):
        _derivative(out, u, d, speed_moment, p, k1)
        _derivative(out + 0.5 * h * k1, u, d, speed_moment, p, k2)
        _derivative(out + 0.5 * h * k2, u, d, speed_moment, p, k3)
        _derivative(out + h * k3, u, d, speed_moment, p, k4)
        out += (h / 6) * (k1 + 2 * k2 + 2 * k3 + k4)


@njit(cache=True)
def _fly(x, u, y, disturbance, noise, excitation, bias, effectiveness, moment, speed_moment, law, p, Ts):  # type: ignore[no-untyped-def]
    A, B, C, M, K, u_trim, y_trim, lower, upper = law
    predicted = np.zeros(4)
    increase = np.zeros(5)
    increase[:4] = speed_moment
    for k in range(len(x)):
        true_output = np.array([np.hypot(x[k, 0], x[k, 1]), np.arctan2(x[k, 1], x[k, 0]), x[k, 2], x[k, 3]])
        y[k] = true_output + noise[k] + bias[k]
        estimate = predicted + M @ (y[k] - y_trim - C @ predicted)
        u[k] = np.minimum(np.maximum(u_trim - K @ estimate + excitation[k], lower), upper)
        predicted = A @ estimate + B @ (u[k] - u_trim)
        if k + 1 < len(x):
            increase[4] = moment[k]
            _advance(x[k], effectiveness[k] * u[k], disturbance[k], increase, p, Ts, x[k + 1])
