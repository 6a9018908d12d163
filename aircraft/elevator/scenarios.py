"""Commands, noise and faults of the elevator's runs (paper 001, section 4).

The paper prints pictures of its scenarios, no formulas: these two have their features. The learning one is excited
strongly; the validation one moves little and spends most of its time near a steady state.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import scipy  # its parts load when they are used
from numpy.typing import ArrayLike

from svo.checks import Array
from svo.faults import ActuatorFault, Ramp, Step

TS = 0.01
DURATION = 100.0
TRAVEL = (float(np.radians(-30.0)), float(np.radians(30.0)))
OSCILLATION_HZ = 1.0


def validation_command(t: ArrayLike) -> Array:
    """Commanded position [rad] of the scenario in which faults are to be found, at times t [s]."""
    s = np.asarray(t, dtype=float)
    return np.asarray(
        -0.02
        + 0.09 * _smooth(s, 5, 3)
        - 0.26 * np.clip((s - 13) / 3, 0, 1)
        + 0.11 * _smooth(s, 24, 4)
        - 0.03 * _smooth(s, 38, 3)
        + 8e-4 * np.clip(s - 58, 0, 24)
        + 0.004 * np.sin(0.5 * np.pi * s) * (s < 34)
    )


def learning_command(t: ArrayLike) -> Array:
    """Commanded position [rad] of the scenario that the noise is learnt from, at times t [s]."""
    s = np.asarray(t, dtype=float)
    u = -0.07 + 0.05 * np.sin(0.4 * np.pi * s) * (s < 30)
    for start, sign in ((32, 1), (36, -1), (40, 1), (44, -1)):
        u = u + sign * 0.14 * (_smooth(s, start, 0.6) - _smooth(s, start + 2, 0.6))
    u = u + 0.03 * np.sin(1.6 * np.pi * (s - 50)) * ((s >= 50) & (s < 65))
    return np.asarray(u - 0.10 * _smooth(s, 68, 0.5) + 0.17 * _smooth(s, 74, 0.8) - 0.07 * _smooth(s, 80, 2))


@dataclass(frozen=True)
class SensorNoise:
    """Coloured noise of the position sensor: a first-order autoregression.

    Attributes
    ----------
    sigma : float
        Stationary standard deviation [rad].
    correlation : float
        Of neighbouring samples.
    bound : float
        No sample exceeds it [rad]; infinite for Gaussian noise.
    """

    sigma: float = 8e-4
    correlation: float = 0.4
    bound: float = np.inf

    def draw(self, samples: int, rng: np.random.Generator) -> Array:
        """A stationary realisation, (samples,)."""
        innovations = self.sigma * np.sqrt(1 - self.correlation**2) * rng.normal(size=samples)
        before = self.sigma * rng.normal()
        noise = scipy.signal.lfilter([1.0], [1.0, -self.correlation], innovations, zi=[self.correlation * before])[0]
        return np.clip(noise, -self.bound, self.bound)


@dataclass(frozen=True)
class Scenario:
    """A fault of the validation run.

    Attributes
    ----------
    fault : ActuatorFault
    where : {"command", "surface"}
        Whether the fault acts on the command that the servo-loop follows, or holds or moves the surface itself.
    label : str
        For tables.
    """

    fault: ActuatorFault
    where: str
    label: str

    @property
    def start(self) -> float:
        """Time of the first faulty sample [s]."""
        return float(self.fault.profile.start)


_DEGREE = float(np.pi / 180)


def _jam(start: float) -> ActuatorFault:
    return ActuatorFault(0, "locking", None, Step(start), travel=TRAVEL)


def _oscillation(kind: str) -> ActuatorFault:
    return ActuatorFault(0, kind, 0.5 * _DEGREE, Step(50.0), frequency_hz=OSCILLATION_HZ)  # type: ignore[arg-type]


SCENARIOS: Mapping[tuple[str, str], Scenario] = MappingProxyType(
    {
        ("runaway", "slow"): Scenario(
            ActuatorFault(0, "runaway", -5.0 * _DEGREE, Step(50.0), travel=TRAVEL), "surface", "DV1: runaway -5 deg/s"
        ),
        ("jam", "moving"): Scenario(_jam(14.5), "surface", "DV2: jam while moving"),
        ("jam", "steady"): Scenario(_jam(66.0), "surface", "DV3: jam near steady state"),
        ("oscillation", "solid"): Scenario(_oscillation("oscillatory-solid"), "command", "oscillation, solid"),
        ("oscillation", "liquid"): Scenario(_oscillation("oscillatory-liquid"), "command", "oscillation, liquid"),
        ("loss", "step"): Scenario(ActuatorFault(0, "loss", 0.1, Step(50.0)), "command", "10 % effect lost at once"),
        ("loss", "ramp"): Scenario(
            ActuatorFault(0, "loss", 0.1, Ramp(50.0, 5.0)), "command", "10 % effect lost in 5 s"
        ),
    }
)

COMMANDS: Mapping[str, Callable[[ArrayLike], Array]] = MappingProxyType(
    {"validation": validation_command, "learning": learning_command}
)


def _smooth(t: Array, start: float, duration: float) -> Array:
    """From 0 at ``start`` to 1 after ``duration``, with no slope at either end."""
    s = np.clip((t - start) / duration, 0, 1)
    return s * s * (3 - 2 * s)
