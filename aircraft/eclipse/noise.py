"""The two named sets of sensor-noise and gust bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from aircraft.disturbances import BandLimitedNoise

Array = NDArray[np.float64]

SENSOR_CUTOFF_HZ = 20.0
GUST_CUTOFFS_HZ = (0.5, 1.0, 2.0)  # d_u, d_w, d_q


@dataclass(frozen=True)
class NoiseSet:
    """Half-widths of everything random in a flight.

    Parameters
    ----------
    sensors : (V, alpha, theta, q)
        [m/s, rad, rad, rad/s].
    gusts : (d_u, d_w, d_q)
        Specific forces and pitch acceleration [m/s^2, m/s^2, rad/s^2].
    """

    sensors: tuple[float, float, float, float]
    gusts: tuple[float, float, float]

    def draw(self, samples: int, Ts: float, rng: np.random.Generator) -> tuple[Array, Array]:
        """Sensor noise (samples, 4) and gusts (samples, 3), each within its bounds."""
        cutoffs = (*(SENSOR_CUTOFF_HZ,) * len(self.sensors), *GUST_CUTOFFS_HZ)
        drawn = BandLimitedNoise((*self.sensors, *self.gusts), cutoffs, Ts).draw(samples, rng)
        return drawn[:, :4], drawn[:, 4:]


_DEGREE = float(np.pi / 180)

NOISE_SETS: Mapping[str, NoiseSet] = MappingProxyType(
    {
        "quiet": NoiseSet(
            sensors=(0.2, 0.1 * _DEGREE, 0.05 * _DEGREE, 0.05 * _DEGREE),
            gusts=(0.1, 0.2, 0.005),
        ),
        "conservative": NoiseSet(
            sensors=(0.5, 0.3 * _DEGREE, 0.3 * _DEGREE, 0.3 * _DEGREE),
            gusts=(0.5, 1.0, 0.05),
        ),
    }
)
