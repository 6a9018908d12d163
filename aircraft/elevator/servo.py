"""Nonlinear servo-loop of an elevator: dynamics and runs (paper 001, equations (1) and (2), corrected).

    dx/dt = gamma(u, x) (u - x)
    gamma = k sqrt((1 - F sign(u - x)) / (1 + Ka (k (u - x))^2)),   k = Kci K

Everything is normalised by S dPref. The paper prints the force F without a sign; it must oppose the motion one way and
assist it the other. No values are public: those here are plausible, and no aircraft's.

`servo.c` beside this file computes them; it takes all constants from here.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes.native import Entries, Given, Integer, Real, floats, function
from svo.faults import ActuatorLaw

Array = NDArray[np.float64]

_rate = function("fdi_servo_rate", Given, Real, Real, Real, returns=Real)
_run = function("fdi_servo_run", Given, Integer, Real, *[Given] * 3, Entries)


@dataclass(frozen=True)
class Servo:
    """Constants of the servo-loop; angles in radians, forces as fractions of S dPref.

    Attributes
    ----------
    gain : float
        Kci K [1/s].
    damping : float
        Ka / (S dPref) [s^2/rad^2].
    force, force_slope : float
        Aerodynamic force at zero deflection, and its change per radian.
    force_swing, force_period : float
        Relative amplitude and period [s] of its slow change.
    stop : float
        Mechanical end stops at +-stop.
    """

    gain: float = 15.0
    damping: float = 0.8
    force: float = 0.10
    force_slope: float = 0.9
    force_swing: float = 0.15
    force_period: float = 70.0
    stop: float = float(np.radians(30.0))

    def __post_init__(self) -> None:
        if not np.isfinite(astuple(self)).all():
            raise ValueError(f"servo is {self}; expected finite numbers")
        for name in ("gain", "force_period", "stop"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected a number > 0")
        if self.damping < 0:
            raise ValueError(f"damping is {self.damping}; expected a number >= 0")
        largest = (abs(self.force) + abs(self.force_slope) * self.stop) * (1 + abs(self.force_swing))
        if largest >= 1:
            raise ValueError(
                f"the force reaches {largest:g} of the pressure's; expected less than 1, or the servo stalls"
            )

    def unloaded_rate(self, distance: ArrayLike) -> Array:
        """gamma [1/s] without force, for a distance u - x; what a predictor can know (19)."""
        move = self.gain * np.asarray(distance, dtype=float)
        return self.gain / np.sqrt(1.0 + self.damping * move * move)

    def rate(self, u: float, x: float, t: float) -> float:
        """gamma [1/s] with the force at time t [s]."""
        return float(_rate(self._packed(), u, x, t))

    def run(
        self,
        u: ArrayLike,
        x0: float,
        Ts: float,
        command: ActuatorLaw | None = None,
        surface: ActuatorLaw | None = None,
    ) -> Array:
        """Positions at each sample, (K,), the input held over each.

        Parameters
        ----------
        u : (K,) array
            Commands [rad].
        x0 : float
            Position at the first sample, within the stops.
        Ts : float
            Sampling time [s].
        command, surface : ActuatorLaw, optional
            What a fault makes of the command that the loop follows, and of the position that the surface takes; one
            row a sample.

        Raises
        ------
        ValueError
            For commands that are not finite, a start beyond the stops, or laws of another length.
        """
        commands = floats(u)
        if commands.ndim != 1 or not np.isfinite(commands).all():
            raise ValueError(f"u has shape {commands.shape}; expected (K,) finite commands in radians")
        if not abs(x0) <= self.stop:
            raise ValueError(f"x0 is {x0}; expected a position within the stops, +-{self.stop:.4g} rad")
        followed, taken = _rows("command", command, commands.size), _rows("surface", surface, commands.size)
        x = np.empty(commands.size)
        x[:1] = x0
        _run(self._packed(), commands.size, Ts, commands, followed, taken, x)
        return x

    def _packed(self) -> Array:
        return np.array(astuple(self))


def _rows(name: str, law: ActuatorLaw | None, samples: int) -> Array:
    """gain, hold, offset, lower, upper, one row a sample."""
    if law is None:
        return np.tile([1.0, 0.0, 0.0, -np.inf, np.inf], (samples, 1))
    rows = np.column_stack([law.gain, law.hold, law.offset, law.lower, law.upper])
    if len(rows) != samples:
        raise ValueError(f"{name} has {len(rows)} rows; expected {samples}, one a sample of u")
    return floats(rows)
