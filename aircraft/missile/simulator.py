"""Closed-loop flight of the missile, compiled: dynamics, target, guidance, autopilot, delayed measurements.

Equations (1) to (4) of Marzat et al. (SysTol 2010), with corrections: the IMU measures the non-gravitational
acceleration, a_b = f_aero / m, so that dv/dt = a_b + f_g / m - omega x v; the moments are Q s_ref l_ref (L, M, N).

State [x y z, vbx vby vbz, p q r, phi theta psi] (z down), input [dl dm dn, eta], measurement
[abx aby abz, p q r, x y z, vbx vby vbz, phi theta psi].

Guidance is proportional navigation on the delayed measurements, N times closing speed times the rate of the line
of sight, plus the compensation of gravity. The autopilot inverts the trim: it finds the incidence that gives the
commanded acceleration with the moments balanced, commands an angular rate towards it, and inverts the moment
equations (2) for the deflections.

All compiled functions stand in this one file and take their constants as arguments: a cached machine code does
not notice a change in another file.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from aircraft.missile.airframe import INPUT_LOWER, INPUT_UPPER, Airframe

Array = NDArray[np.float64]

N_MEASUREMENTS = 15
ACCELERATION, RATES, POSITION, VELOCITY, ANGLES = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 15)
START = np.array([0.0, 0.0, -4000.0, 600.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.05])


@dataclass(frozen=True)
class Guidance:
    """Gains of guidance and autopilot; the limits are own choices."""

    navigation: float = 4.0
    incidence: float = 4.0  # 1/s, from incidence error to angular rate
    rate: float = 14.0  # 1/s, pitch and yaw rate error to angular acceleration
    roll_angle: float = 4.0  # 1/s
    roll_rate: float = 12.0  # 1/s
    acceleration_integral: float = 0.6  # 1/s
    thrust_trim: float = 0.35
    thrust_gain: float = 0.02  # s/m
    thrust_integral: float = 0.004  # 1/m
    speed: float = 620.0  # m/s
    incidence_limit: float = 0.35  # rad
    acceleration_limit: float = 300.0  # m/s^2, of the command and of the integrator's contribution


@dataclass(frozen=True)
class Corruption:
    """How faults act inside a run, one row a sample and held over it.

    The achieved input is clip(gain uc + hold h + offset, lower, upper), with h the input achieved at the sample before
    ``hold`` became positive (`svo.faults.ActuatorLaw`, a column each); the measurement is gain y + offset.
    """

    gain: Array
    hold: Array
    offset: Array
    lower: Array
    upper: Array
    sensor_gain: Array
    sensor_offset: Array

    @classmethod
    def none(cls, samples: int) -> Corruption:
        one, zero = np.ones((samples, 4)), np.zeros((samples, 4))
        return cls(
            one,
            zero,
            zero.copy(),
            np.full((samples, 4), -np.inf),
            np.full((samples, 4), np.inf),
            np.ones((samples, N_MEASUREMENTS)),
            np.zeros((samples, N_MEASUREMENTS)),
        )


@dataclass(frozen=True)
class Flight:
    """One simulated run.

    Attributes
    ----------
    x : (K, 12) array
        True states.
    acceleration : (K, 3) array
        True non-gravitational acceleration in body axes, with the input achieved at that sample [m/s^2].
    computed, achieved : (K, 4) arrays
        Inputs from guidance and autopilot, and those of the actuators.
    y : (K, 15) array
        Measurements as received: row k is of the state ``delay`` samples before.
    target : (K, 3) array
        Position of the target [m].
    """

    x: Array
    acceleration: Array
    computed: Array
    achieved: Array
    y: Array
    target: Array

    @property
    def distance(self) -> Array:
        """Distance to the target at each sample [m]."""
        return np.linalg.norm(self.target - self.x[:, :3], axis=1)


def fly(
    airframe: Airframe,
    guidance: Guidance,
    error: Array,
    scale: Array,
    delay: int,
    corruption: Corruption,
    Ts: float,
    model: Airframe | None = None,
    start: Array = START,
) -> Flight:
    """Fly K samples in closed loop, one RK4 step each.

    Parameters
    ----------
    airframe : Airframe
        The true one.
    error : (K, 15) array
        Added to the scaled measurements.
    scale : (15,) array
        Scale factors of the measurements.
    delay : int
        Samples from a state to its measurement, >= 1.
    corruption : Corruption
    Ts : float
        Sampling time [s].
    model : Airframe, optional
        The one that the autopilot believes in; the true one by default.
    start : (12,) array
        State at the first sample.

    Raises
    ------
    ValueError
        For shapes that do not fit, a delay below one, or a state that leaves the finite numbers.
    """
    samples = len(error)
    shapes: dict[str, tuple[int, ...]] = {
        name: (samples, 15 if name.startswith("sensor") else 4) for name in vars(corruption)
    }
    arrays = {"error": error, "scale": scale, "start": start, **vars(corruption)}
    shapes |= {"error": (samples, N_MEASUREMENTS), "scale": (N_MEASUREMENTS,), "start": (12,)}
    for name, array in arrays.items():
        if np.shape(array) != shapes[name]:
            raise ValueError(f"{name} has shape {np.shape(array)}; expected {shapes[name]}")
    if delay < 1:
        raise ValueError(f"delay is {delay}; expected at least one sample, or the input would depend on itself")
    x, acceleration = np.zeros((samples, 12)), np.zeros((samples, 3))
    computed, achieved, y = np.zeros((samples, 4)), np.zeros((samples, 4)), np.zeros((samples, N_MEASUREMENTS))
    target = np.zeros((samples, 3))
    x[0] = start
    faults = tuple(np.ascontiguousarray(v) for v in vars(corruption).values())
    limits = (INPUT_LOWER, INPUT_UPPER)
    gains = np.array(list(vars(guidance).values()))
    believed = (airframe if model is None else model).packed()
    out = (x, acceleration, computed, achieved, y, target)
    _fly(out, error, scale, delay, faults, limits, gains, airframe.packed(), believed, Ts)
    if not np.isfinite(x).all():
        raise ValueError("the simulated state is no longer finite: the flight was lost; end the run earlier")
    return Flight(*out)


@njit(cache=True)
def force_coefficients(alpha, beta, p):  # type: ignore[no-untyped-def]
    """Coefficients of equation (1) at one incidence or at arrays of them.

    Returns
    -------
    tuple
        (cx0 + cx_alpha alpha, cx_dl, cx_dm, cx_dn, cy_beta beta, cy_dl, cy_dn, cz_alpha alpha, cz_dm), to be used
        with the signs of equation (1): -x, +y, -z.
    """
    return (
        p[0] + p[1] * alpha * alpha,
        p[2],
        p[3] * (1.0 + alpha),
        p[4] * (1.0 + beta),
        (p[5] + p[6] * np.abs(beta)) * beta,
        p[7],
        p[8],
        (p[9] + p[10] * np.abs(alpha)) * alpha,
        p[11],
    )


@njit(cache=True)
def dynamic_pressure(z, vx, vy, vz, p):  # type: ignore[no-untyped-def]
    """Q = rho V^2 / 2 at height -z [Pa]; numbers or arrays."""
    return 0.5 * p[32] * np.exp(z / p[33]) * (vx * vx + vy * vy + vz * vz)


@njit(cache=True)
def specific_force(x, u, p):  # type: ignore[no-untyped-def]
    """Non-gravitational acceleration in body axes at one state and input, (3,): what an IMU measures."""
    alpha, beta = np.arctan2(x[5], x[3]), np.arctan2(x[4], x[3])
    cx, cx_l, cx_m, cx_n, cy, cy_l, cy_n, cz, cz_m = force_coefficients(alpha, beta, p)
    scale = dynamic_pressure(x[2], x[3], x[4], x[5], p) * p[28] / p[25]
    thrust = (p[30] + (p[31] - p[30]) * u[3]) / p[25]
    return np.array(
        [
            -scale * (cx + cx_l * u[0] + cx_m * u[1] + cx_n * u[2]) + thrust,
            scale * (cy + cy_l * u[0] + cy_n * u[2]),
            -scale * (cz + cz_m * u[1]),
        ]
    )


@njit(cache=True)
def rotation(angles):  # type: ignore[no-untyped-def]
    """Matrix of equation (4), from body to inertial axes, for [phi, theta, psi]."""
    sf, cf, st, ct, ss, cs = (
        np.sin(angles[0]),
        np.cos(angles[0]),
        np.sin(angles[1]),
        np.cos(angles[1]),
        np.sin(angles[2]),
        np.cos(angles[2]),
    )
    return np.array(
        [
            [cs * ct, -ss * cf + cs * st * sf, ss * sf + cs * st * cf],
            [ss * ct, cs * cf + ss * st * sf, -cs * sf + ss * st * cf],
            [-st, ct * sf, ct * cf],
        ]
    )


@njit(cache=True)
def derivative(x, u, p):  # type: ignore[no-untyped-def]
    """Right-hand side of equations (1) to (4), (12,)."""
    out = np.empty(12)
    R = rotation(x[9:12])
    a = specific_force(x, u, p)
    vx, vy, vz, wp, wq, wr = x[3], x[4], x[5], x[6], x[7], x[8]
    for i in range(3):
        out[i] = R[i, 0] * vx + R[i, 1] * vy + R[i, 2] * vz
    out[3] = a[0] + p[34] * R[2, 0] - (wq * vz - wr * vy)
    out[4] = a[1] + p[34] * R[2, 1] - (wr * vx - wp * vz)
    out[5] = a[2] + p[34] * R[2, 2] - (wp * vy - wq * vx)
    alpha, beta = np.arctan2(vz, vx), np.arctan2(vy, vx)
    damping = p[29] / np.sqrt(vx * vx + vy * vy + vz * vz)
    torque = dynamic_pressure(x[2], vx, vy, vz, p) * p[28] * p[29]
    L = p[12] * beta + p[13] * u[0] + p[14] * u[2] + p[15] * damping * wp
    M = (p[16] + p[17] * abs(alpha)) * alpha + p[18] * u[1] + p[19] * damping * wq
    N = (p[20] + p[21] * abs(beta)) * beta + p[22] * u[0] + p[23] * u[2] + p[24] * damping * wr
    a_, b_ = p[26], p[27]
    out[6] = torque * L / a_
    out[7] = (torque * M - (a_ - b_) * wp * wr) / b_
    out[8] = (torque * N - (b_ - a_) * wp * wq) / b_
    sf, cf = np.sin(x[9]), np.cos(x[9])
    turn = sf * wq + cf * wr
    out[9] = wp + turn * np.tan(x[10])
    out[10] = cf * wq - sf * wr
    out[11] = turn / np.cos(x[10])
    return out


@njit(cache=True)
def target_at(t):  # type: ignore[no-untyped-def]
    """Position and velocity of the target, (3,) each."""
    w1, w2 = 2 * np.pi / 9, 2 * np.pi / 11
    position = np.array(
        [40000.0 + 40.0 * t, 2000.0 + 200.0 * t + 100.0 * np.sin(w1 * t), -6000.0 - 60.0 * np.sin(w2 * t)]
    )
    velocity = np.array([40.0, 200.0 + 100.0 * w1 * np.cos(w1 * t), -60.0 * w2 * np.cos(w2 * t)])
    return position, velocity


@njit(cache=True)
def _acceleration_command(t, y, R, g, gravity):  # type: ignore[no-untyped-def]
    """Non-gravitational acceleration in body axes that proportional navigation asks for."""
    position, velocity = target_at(t)
    gap = position - y[6:9]
    closing = velocity - R @ y[9:12]
    squared = np.sum(gap * gap)
    rate = np.cross(gap, closing) / squared
    towards = gap / np.sqrt(squared)
    speed = -np.sum(towards * closing)
    wanted = g[0] * speed * np.cross(rate, towards)
    wanted[2] -= gravity
    return R.T @ wanted


@njit(cache=True)
def _trim_incidence(coefficient, limit, p):  # type: ignore[no-untyped-def]
    """Incidence at which force coefficient and zero moment hold: k1 s + k2 s |s| = coefficient."""
    k1 = p[9] - p[11] * p[16] / p[18]
    k2 = p[10] - p[11] * p[17] / p[18]
    size = (-k1 + np.sqrt(k1 * k1 + 4.0 * k2 * abs(coefficient))) / (2.0 * k2)
    return np.sign(coefficient) * min(size, limit)


@njit(cache=True)
def _autopilot(t, y, memory, g, p, limits, Ts, out):  # type: ignore[no-untyped-def]
    """Inputs from one measurement; memory = integrals of [a_y error, a_z error, speed error]."""
    R = rotation(y[12:15])
    wanted = _acceleration_command(t, y, R, g, p[34])
    vx, vy, vz, wp, wq, wr = y[9], y[10], y[11], y[3], y[4], y[5]
    speed = np.sqrt(vx * vx + vy * vy + vz * vz)
    alpha, beta = np.arctan2(vz, vx), np.arctan2(vy, vx)
    pressure = dynamic_pressure(y[8], vx, vy, vz, p)
    per_force = p[25] / (pressure * p[28])
    for i in range(2):
        wanted[i + 1] = min(max(wanted[i + 1], -g[11]), g[11])
        memory[i] += Ts * (wanted[i + 1] - y[i + 1])
        memory[i] = min(max(memory[i], -g[11]), g[11])
    asked_y, asked_z = wanted[1] + g[5] * memory[0], wanted[2] + g[5] * memory[1]
    alpha_c = _trim_incidence(-asked_z * per_force, g[10], p)
    beta_c = _trim_incidence(-asked_y * per_force, g[10], p)
    q_c = g[1] * (alpha_c - alpha) - (y[2] + p[34] * R[2, 2]) / speed
    r_c = -g[1] * (beta_c - beta) + (y[1] + p[34] * R[2, 1]) / speed
    p_c = -g[3] * y[12]
    p_dot, q_dot, r_dot = g[4] * (p_c - wp), g[2] * (q_c - wq), g[2] * (r_c - wr)
    torque, damping = pressure * p[28] * p[29], p[29] / speed
    a_, b_ = p[26], p[27]
    L = a_ * p_dot / torque - p[12] * beta - p[15] * damping * wp
    M = (b_ * q_dot + (a_ - b_) * wp * wr) / torque - (p[16] + p[17] * abs(alpha)) * alpha - p[19] * damping * wq
    N = (b_ * r_dot + (b_ - a_) * wp * wq) / torque - (p[20] + p[21] * abs(beta)) * beta - p[24] * damping * wr
    determinant = p[13] * p[23] - p[14] * p[22]
    out[0] = (p[23] * L - p[14] * N) / determinant
    out[1] = M / p[18]
    out[2] = (p[13] * N - p[22] * L) / determinant
    lag = g[9] - speed
    out[3] = g[6] + g[7] * lag + g[8] * (memory[2] + Ts * lag)
    if 0.0 < out[3] < 1.0:  # the integral waits while the thrust is at a limit
        memory[2] += Ts * lag
    for i in range(4):
        out[i] = min(max(out[i], limits[0][i]), limits[1][i])


@njit(cache=True)
def _fly(out, error, scale, delay, faults, limits, g, p, believed, Ts):  # type: ignore[no-untyped-def]
    x, acceleration, computed, achieved, y, target = out
    gain, hold, offset, lower, upper, sensor_gain, sensor_offset = faults
    memory, held = np.zeros(3), np.zeros(4)
    for k in range(len(x)):
        then = max(k - delay, 0)
        y[k, :3] = acceleration[then]
        y[k, 3:6] = x[then, 6:9]
        y[k, 6:12] = x[then, :6]
        y[k, 12:] = x[then, 9:]
        y[k] = sensor_gain[then] * (scale * y[k] + error[k]) + sensor_offset[then]
        _autopilot(k * Ts, y[k], memory, g, believed, limits, Ts, computed[k])
        for i in range(4):
            if hold[k, i] > 0.0 and (k == 0 or hold[k - 1, i] == 0.0):
                held[i] = achieved[k - 1, i] if k > 0 else computed[0, i]
            moved = gain[k, i] * computed[k, i] + hold[k, i] * held[i] + offset[k, i]
            achieved[k, i] = min(max(moved, lower[k, i]), upper[k, i])
        acceleration[k] = specific_force(x[k], achieved[k], p)
        target[k] = target_at(k * Ts)[0]
        if k + 1 < len(x):
            k1 = derivative(x[k], achieved[k], p)
            k2 = derivative(x[k] + 0.5 * Ts * k1, achieved[k], p)
            k3 = derivative(x[k] + 0.5 * Ts * k2, achieved[k], p)
            k4 = derivative(x[k] + Ts * k3, achieved[k], p)
            x[k + 1] = x[k] + (Ts / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
