"""Flights with large manoeuvres, 25 to 50 m/s and 30 degrees of pitch, which no bound was ever measured on."""

from __future__ import annotations

import numpy as np

from aircraft.eclipse.autopilot import design_autopilot
from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.scenarios import TS, Fault, corrupt
from aircraft.eclipse.simulator import Surrogate, fly
from aircraft.eclipse.trim import level_trim
from svo.checks import Array
from svo.logs.log import Log

SPEEDS = (27.0, 48.0)  # m/s, of the trims that are flown to; the flight goes beyond them
PITCH = np.radians(30.0)
LEG_S = 3.0  # of each speed and pitch


def manoeuvres(duration: float, noise: str, seed: int | np.random.SeedSequence, fault: Fault | None = None) -> Log:
    """A flight of random legs of other speeds and climbs, with its true states [u, w, theta, q].

    The autopilot's law is offset so that it flies to another trim in each leg, its pitch raised or lowered.

    Parameters
    ----------
    duration : float
        [s].
    noise : str
        Noise set.
    seed : int or SeedSequence
    fault : SensorFault, ActuatorFault or PlantFault, optional
    """
    rng, surrogate, bounds = np.random.default_rng(seed), Surrogate(), NOISE_SETS[noise]
    law = design_autopilot(bounds, TS, surrogate, Derivatives())
    samples, legs = round(duration / TS), int(np.ceil(duration / LEG_S))
    trims = level_trim(surrogate, rng.uniform(*SPEEDS, legs))
    goal = trims.x + rng.uniform(-1.0, 1.0, (legs, 1)) * [0.0, 0.0, PITCH, 0.0]
    start = level_trim(surrogate, 37.0).x
    offset = (goal - start) @ law.K.T + trims.u - law.u_trim
    leg = np.arange(samples) * TS // LEG_S
    sensor_noise, gusts = bounds.draw(samples, TS, rng)
    time: Array = np.arange(samples, dtype=np.float64) * TS
    flight = fly(surrogate, law, start, gusts, sensor_noise, corrupt(fault, time, 0.0), TS, offset[leg.astype(int)])
    return Log(time=time, u=flight.u, y=flight.y, x=flight.x[:, :4])
