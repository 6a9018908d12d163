"""The paper's nine faulty flights and the fault-free one (Rosa and Silvestre 2013, section 6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from aircraft.eclipse.autopilot import DESIGN_AIRSPEED, design_autopilot
from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.models import SPEED_MOMENT_INCREASE, ScheduledModel
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.schedule import AirspeedFilter
from aircraft.eclipse.simulator import Controller, Corruption, Flight, Surrogate, fly
from aircraft.eclipse.trim import level_trim
from svo.checks import Array, chosen, expect
from svo.faults import ActuatorFault, PlantFault, Profile, Ramp, SensorFault, Step
from svo.plant import Distribution

Fault = SensorFault | ActuatorFault | PlantFault

TS = 0.01
FAULT_TIME = 0.5
HEALTHY = "none"
HEALTHY_DURATION = 10.0
FAULTS = ("alpha", "elevator", "dynamics")
PROFILES: Mapping[str, tuple[Profile, float]] = MappingProxyType(
    {  # shape in time, and seconds flown after the fault begins
        "step": (Step(FAULT_TIME), 5.0),
        "hard": (Ramp(FAULT_TIME, 1.0), 6.0),
        "soft": (Ramp(FAULT_TIME, 4.0), 9.5),
    }
)
ALPHA_BIAS = {"step": float(np.radians(3.0)), "hard": float(np.radians(5.0)), "soft": float(np.radians(5.0))}
LARGEST = "hard"  # the profile of each fault's full size, which its observer must contain
ALPHA, ELEVATOR = 1, 0  # channels


@dataclass(frozen=True)
class Run:
    """One flight with everything that made it.

    Attributes
    ----------
    time, schedule : (K,) arrays
        Seconds, and the filtered airspeed at each sample [m/s].
    flight : Flight
    noise, gusts : (K, 4), (K, 3) arrays
    fault : Fault or None
    """

    time: Array
    schedule: Array
    flight: Flight
    noise: Array
    gusts: Array
    fault: Fault | None


@dataclass(frozen=True)
class Scenarios:
    """Flights of the closed loop about 37 m/s.

    Parameters
    ----------
    model : ScheduledModel
        Gives the surrogate, the derivatives, and the direction of the dynamics fault.
    size : float
        Of every fault, as a fraction of the paper's, in (0, 1].
    distribution : {"bounded", "gaussian"}
        Of all noises and gusts: within the bounds of the noise set, or Gaussian of the same rms, which leaves them.
    """

    model: ScheduledModel = field(default_factory=lambda: ScheduledModel(TS))
    size: float = 1.0
    distribution: Distribution = "bounded"

    def __post_init__(self) -> None:
        expect(0.0 < self.size <= 1.0, "size", self.size, "a fraction of the paper's faults, 0 < size <= 1")

    def fault(self, name: str, profile: str) -> Fault:
        """The fault object that both corrupts a flight and gives its observer's model.

        Raises
        ------
        ValueError
            If the fault or the profile is not one of the scenarios.
        """
        shape, _ = chosen("profile", profile, PROFILES)
        if name == "alpha":
            return SensorFault(ALPHA, "bias", self.size * ALPHA_BIAS[profile], shape)
        if name == "elevator":
            return ActuatorFault(ELEVATOR, "loss", self.size * 0.5, shape)
        if name == "dynamics":
            return PlantFault(self.model.speed_moment, self.size * 1.0, shape)
        raise ValueError(f"fault is {name!r}; expected one of alpha, elevator, dynamics")

    def duration(self, fault: str, profile: str) -> float:
        """Length of a flight [s]."""
        if fault == HEALTHY:
            return HEALTHY_DURATION
        self.fault(fault, profile)
        return FAULT_TIME + PROFILES[profile][1]

    def run(
        self,
        fault: str,
        profile: str,
        noise: str,
        seed: int | np.random.SeedSequence,
        excitation: ArrayLike | None = None,
    ) -> Run:
        """Fly once from the trim at 37 m/s; ``fault`` may be "none".

        ``excitation`` (samples, 2), in [deg, thrust command], is superposed on the autopilot's commands from the time
        of the fault on; it ends with its last sample.
        """
        samples = round(self.duration(fault, profile) / self.model.Ts)
        time = np.arange(samples, dtype=np.float64) * float(self.model.Ts)
        active = None if fault == HEALTHY else self.fault(fault, profile)
        rng = np.random.default_rng(seed)
        sensor_noise, gusts = chosen("noise", noise, NOISE_SETS).draw(samples, self.model.Ts, rng, self.distribution)
        corruption = corrupt(active, time, self.model.moment_reference)
        start = _start(self.model.surrogate)
        controller = _autopilot(noise, self.model.Ts, self.model.surrogate)
        superposed = None if excitation is None else self._from_fault(excitation, samples)
        surrogate, Ts = self.model.surrogate, self.model.Ts
        flight = fly(surrogate, controller, start, gusts, sensor_noise, corruption, Ts, superposed)
        airspeed = AirspeedFilter(self.model.Ts, DESIGN_AIRSPEED)
        schedule = np.array([airspeed(y) for y in flight.y])
        return Run(time, schedule, flight, sensor_noise, gusts, active)

    def _from_fault(self, excitation: ArrayLike, samples: int) -> Array:
        values, first = np.asarray(excitation, dtype=float), round(FAULT_TIME / self.model.Ts)
        if values.ndim != 2 or values.shape[1] != 2 or len(values) > samples - first or not np.isfinite(values).all():
            raise ValueError(
                f"excitation has shape {values.shape}; expected finite numbers of shape (samples, 2), at most "
                f"{samples - first} samples from the fault on"
            )
        return np.vstack([np.zeros((first, 2)), values, np.zeros((samples - first - len(values), 2))])


def corrupt(fault: Fault | None, time: Array, moment_reference: float) -> Corruption:
    """How a fault acts inside the simulator at each sample."""
    healthy = Corruption.none(len(time))
    if fault is None:
        return healthy
    if isinstance(fault, SensorFault):
        bias = fault.corrupt(time, healthy.bias)
        return Corruption(bias, healthy.effectiveness, healthy.moment)
    if isinstance(fault, ActuatorFault):
        effectiveness = fault.corrupt(time, healthy.effectiveness)
        return Corruption(healthy.bias, effectiveness, healthy.moment)
    moment = SPEED_MOMENT_INCREASE * fault.delta(time)
    return Corruption(healthy.bias, healthy.effectiveness, moment, moment_reference)


@cache
def _start(surrogate: Surrogate) -> Array:
    return level_trim(surrogate, DESIGN_AIRSPEED).x


@cache
def _autopilot(noise: str, Ts: float, surrogate: Surrogate) -> Controller:
    return design_autopilot(NOISE_SETS[noise], Ts, surrogate, Derivatives())
