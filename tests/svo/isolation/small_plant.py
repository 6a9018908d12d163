"""A small stable plant, its faults and its flights, for the tests of banks with window observers."""

from __future__ import annotations

from typing import Any

import numpy as np

from svo.faults import ActuatorFault, PlantFault, SensorFault
from svo.logs.log import Log
from svo.models.model import UncertainModel, Uncertainty

SAMPLES, TS, START = 40, 0.1, 1.0


def plant(rng: np.random.Generator, n: int = 2) -> UncertainModel:
    A = rng.normal(size=(n, n))
    A *= rng.uniform(0.5, 0.95) / np.abs(np.linalg.eigvals(A)).max()
    return UncertainModel(
        A, rng.normal(size=(n, 1)), np.eye(n), E=np.eye(n), w=np.full(n, 0.01), n=np.full(n, 0.03), Ts=TS
    )


def faults_of(rng: np.random.Generator, n: int, profile: Any) -> dict[str, Any]:
    return {
        "bias": SensorFault(0, "bias", 0.8, profile),
        "hard": SensorFault(n - 1, "hard", 0.5, profile),
        "loss": ActuatorFault(0, "loss", 0.7, profile),
        "hard-over": ActuatorFault(0, "hard-over", 2.0, profile),
        "plant": PlantFault(Uncertainty(A=0.2 * np.outer(rng.normal(size=n), rng.normal(size=n))), 1.0, profile),
    }


def fly(nominal: UncertainModel, fault: Any, x0: np.ndarray, rng: np.random.Generator, samples: int = SAMPLES) -> Log:
    """A run of the plant with a fault (or None), corners of noise and disturbance included."""
    time = np.arange(samples) * TS
    u, x, states, readings = 1.0 + rng.normal(size=(samples, 1)), x0, [], []
    _, w_upper, noise = nominal.bounds()
    achieved = fault.corrupt(time, u) if isinstance(fault, ActuatorFault) else u
    for k in range(samples):
        y = nominal.block("C") @ x + rng.choice([-1, 1], noise.size) * noise
        w = rng.choice([-1, 1], w_upper.size) * w_upper
        states.append(x)
        readings.append(fault.corrupt(time[k], y) if isinstance(fault, SensorFault) else y)
        moved = nominal.block("A") @ x + nominal.block("B") @ achieved[k] + nominal.block("E") @ w
        if isinstance(fault, PlantFault):
            moved = moved + fault.perturbation(nominal, time[k], x, u[k], w)[0]
        x = moved
    return Log(time=time, u=u, y=np.array(readings), x=np.array(states))
