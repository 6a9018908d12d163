"""Flights of the missile with its faults: the three scenarios of Table II, and any other list of faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from aircraft.missile.airframe import DEFLECTION_LIMIT, INPUT_LOWER, INPUT_UPPER, INPUTS, Airframe
from aircraft.missile.imu import DELAY, NOISE_SETS, SensorErrors
from aircraft.missile.simulator import Corruption, Flight, Guidance, fly
from svo.checks import Array, chosen
from svo.faults import ActuatorFault, SensorFault, Step

Fault = ActuatorFault | SensorFault

TS = 0.01
DURATION = 75.0
DL, DM, DN, ETA = range(4)


def locked(channel: int, start: float) -> ActuatorFault:
    """A fin locked in the deflection that it has at ``start`` [s]."""
    return ActuatorFault(channel, "locking", None, Step(start), travel=(-DEFLECTION_LIMIT, DEFLECTION_LIMIT))


def thrust_loss(fraction: float, start: float) -> ActuatorFault:
    """A lost fraction of the propulsion rate from ``start`` [s] on."""
    return ActuatorFault(ETA, "loss", fraction, Step(start))


@dataclass(frozen=True)
class Scenario:
    """Faults of one flight, and the residuals that the paper shows for it (Table II)."""

    faults: tuple[Fault, ...]
    shown: tuple[str, ...] = ()

    @property
    def events(self) -> tuple[tuple[float, str], ...]:
        """(time [s], input) of each actuator fault, in the order of time."""
        actuators = [f for f in self.faults if isinstance(f, ActuatorFault)]
        return tuple(sorted((f.profile.start, INPUTS[_channel(f)]) for f in actuators))


SCENARIOS: Mapping[int, Scenario] = MappingProxyType(
    {
        1: Scenario((thrust_loss(0.25, 30.0),), ("r14", "r12", "r23")),
        2: Scenario((locked(DM, 30.0), thrust_loss(0.25, 50.0)), ("r32", "r21", "r1_14")),
        3: Scenario((thrust_loss(0.5, 20.0), locked(DM, 45.0), locked(DN, 30.0)), ("r23", "r32", "r4_11", "r5_14")),
    }
)


@dataclass(frozen=True)
class Run:
    """One flight and what made it.

    Attributes
    ----------
    time : (K,) array
        Seconds.
    flight : Flight
    errors : SensorErrors
    airframe : Airframe
        The true one.
    """

    time: Array
    flight: Flight
    errors: SensorErrors
    airframe: Airframe

    @property
    def aligned_inputs(self) -> Array:
        """Computed inputs (K, 4) of the instant that each row of the measurements is of; NaN before the first."""
        inputs = np.full_like(self.flight.computed, np.nan)
        inputs[DELAY:] = self.flight.computed[:-DELAY]
        return inputs


@dataclass(frozen=True)
class Flights:
    """Simulates flights.

    Parameters
    ----------
    airframe : Airframe
        The one that autopilot and residuals believe in.
    guidance : Guidance
    model_error : float
        Largest relative error of the force coefficients; each flight draws its own true airframe.
    """

    airframe: Airframe = field(default_factory=Airframe)
    guidance: Guidance = field(default_factory=Guidance)
    model_error: float = 0.0

    def run(
        self,
        faults: Sequence[Fault],
        errors: SensorErrors,
        seed: int | np.random.SeedSequence,
        duration: float = DURATION,
    ) -> Run:
        """One flight; the same seed gives the same sensor errors and airframe whatever the faults."""
        samples = round(duration / TS)
        time = np.arange(samples, dtype=np.float64) * TS
        rng, airframe_rng = np.random.default_rng(seed).spawn(2)
        true = self.airframe.perturbed(self.model_error, airframe_rng) if self.model_error else self.airframe
        flight = fly(
            true,
            self.guidance,
            errors.draw(samples, rng),
            errors.scale,
            DELAY,
            corruption_of(faults, time),
            TS,
            model=self.airframe,
        )
        return Run(time, flight, errors, true)


def corruption_of(faults: Sequence[Fault], time: Array) -> Corruption:
    """How faults act inside the simulator at each sample.

    Raises
    ------
    ValueError
        If two faults share a channel.
    """
    corruption = Corruption.none(len(time))
    taken: set[tuple[str, int]] = set()
    for fault in faults:
        channel = _channel(fault)
        kind = "actuator" if isinstance(fault, ActuatorFault) else "sensor"
        if (kind, channel) in taken:
            raise ValueError(f"faults has two faults of {kind} {channel}; expected at most one a channel")
        taken.add((kind, channel))
        if isinstance(fault, ActuatorFault):
            law = fault.law(time)
            columns = {name: getattr(law, name) for name in ("gain", "hold", "offset")}
            # A healthy fin stays within its travel, and so does a faulty one.
            columns["lower"] = np.maximum(law.lower, INPUT_LOWER[channel])
            columns["upper"] = np.minimum(law.upper, INPUT_UPPER[channel])
        else:
            sensor = fault.law(time)
            columns = {"sensor_gain": sensor.gain, "sensor_offset": sensor.offset}
        for name, column in columns.items():
            getattr(corruption, name)[:, channel] = column
    return corruption


def noise_set(name: str) -> SensorErrors:
    """The sensor errors of that name.

    Raises
    ------
    ValueError
        If there are none of that name.
    """
    return chosen("noise", name, NOISE_SETS)


def _channel(fault: Fault) -> int:
    if not isinstance(fault.where, int):
        raise ValueError(f"where is {fault.where}; expected one channel a fault of the missile")
    return fault.where
