"""Closed-loop flight of the missile: dynamics, target, guidance, autopilot, delayed measurements.

Equations (1) to (4) of Marzat et al. (SysTol 2010), with corrections: the IMU measures the non-gravitational
acceleration, a_b = f_aero / m, so that dv/dt = a_b + f_g / m - omega x v; the moments are Q s_ref l_ref (L, M, N).

State [x y z, vbx vby vbz, p q r, phi theta psi] (z down), input [dl dm dn, eta], measurement
[abx aby abz, p q r, x y z, vbx vby vbz, phi theta psi].

Guidance is proportional navigation on the delayed measurements, N times closing speed times the rate of the line
of sight, plus the compensation of gravity. The autopilot inverts the trim: it finds the incidence that gives the
commanded acceleration with the moments balanced, commands an angular rate towards it, and inverts the moment
equations (2) for the deflections.

`simulator.c` and `autopilot.c` beside this file compute them; they take all constants from here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aircraft.missile.airframe import INPUT_LOWER, INPUT_UPPER, Airframe
from polytopes.native import Entries, Given, Integer, Real, address, floats, function

Array = NDArray[np.float64]

N_MEASUREMENTS = 15
ACCELERATION, RATES, POSITION, VELOCITY, ANGLES = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 15)
_coefficients = function("fdi_missile_coefficients", Given, Integer, *[Given] * 2, Entries)
_pressure = function("fdi_missile_pressure", Given, Integer, *[Given] * 2, Entries)
_specific_force = function("fdi_missile_specific_force", *[Given] * 3, Entries)
_rotation = function("fdi_missile_rotation", Given, Entries)
_derivative = function("fdi_missile_derivative", *[Given] * 3, Entries)
_fly = function("fdi_missile_fly", *[Integer] * 2, Real, *[Given] * 5)
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
    x[:1] = start
    out = (x, acceleration, computed, achieved, y, target)
    given = [floats(array) for array in (error, scale, *vars(corruption).values())]
    addresses = np.array([address(array) for array in (*out, *given)])
    limits, gains = np.array([INPUT_LOWER, INPUT_UPPER]), np.array(list(vars(guidance).values()))
    believed = airframe if model is None else model
    _fly(samples, delay, Ts, airframe.packed(), believed.packed(), gains, limits, addresses)
    if not np.isfinite(x).all():
        raise ValueError("the simulated state is no longer finite: the flight was lost; end the run earlier")
    return Flight(*out)


def force_coefficients(alpha: ArrayLike, beta: ArrayLike, p: Array) -> tuple[Array, ...]:
    """Coefficients of equation (1) at K incidences (K,), or at one.

    Returns
    -------
    tuple of nine (K,) arrays
        (cx0 + cx_alpha alpha, cx_dl, cx_dm, cx_dn, cy_beta beta, cy_dl, cy_dn, cz_alpha alpha, cz_dm), to be used
        with the signs of equation (1): -x, +y, -z.
    """
    alphas, betas = floats(alpha), floats(beta)
    out = np.empty((*alphas.shape, 9))
    _coefficients(p, alphas.size, alphas, betas, out)
    return tuple(np.moveaxis(out, -1, 0))


def dynamic_pressure(z: ArrayLike, vx: ArrayLike, vy: ArrayLike, vz: ArrayLike, p: Array) -> Array:
    """Q = rho V^2 / 2 at height -z [Pa], (K,); of (K,) arrays, or of numbers."""
    heights, velocities = floats(z), floats(np.stack([vx, vy, vz], axis=-1))
    out = np.empty(heights.shape)
    _pressure(p, heights.size, heights, velocities, out)
    return out


def specific_force(x: ArrayLike, u: ArrayLike, p: Array) -> Array:
    """Non-gravitational acceleration in body axes at one state and input, (3,): what an IMU measures."""
    out = np.empty(3)
    _specific_force(p, floats(x), floats(u), out)
    return out


def rotation(angles: ArrayLike) -> Array:
    """Matrix of equation (4), from body to inertial axes, for [phi, theta, psi]."""
    out = np.empty((3, 3))
    _rotation(floats(angles), out)
    return out


def derivative(x: ArrayLike, u: ArrayLike, p: Array) -> Array:
    """Right-hand side of equations (1) to (4), (12,)."""
    out = np.empty(12)
    _derivative(p, floats(x), floats(u), out)
    return out
