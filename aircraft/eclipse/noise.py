"""The two named sets of sensor-noise and gust bounds.

The paper prints neither its noise nor its disturbance bounds. Both sets are band-limited and clipped at
their bounds, with rms = bound / 2.5; constant sensor errors (misalignment, gyro bias) are taken as
calibrated out, so the bounds are about noise only.

``quiet`` is a good air-data and inertial set in calm air, chosen so that the paper's text holds: the alpha
step is seen at the first faulty sample, the elevator and dynamics steps at the second, and every mean
detection stays below 0.5 s.

- airspeed +-0.2 m/s: +-1.1 % of the dynamic pressure at 37 m/s (840 Pa), 9 Pa peak, 4 Pa rms: a
  temperature-compensated differential sensor on a clean pitot boom.
- alpha +-0.08 deg: rms 0.03 deg, a balanced vane on a 12-bit (0.09 deg) or finer encoder.
- theta +-0.1 deg and q +-0.05 deg/s: rms 0.04 deg and 0.02 deg/s in 20 Hz, that is 0.004 deg/s/sqrt(Hz): a
  tactical-grade MEMS unit.
- d_u +-0.1, d_w +-0.15 m/s^2, d_q +-0.005 rad/s^2: vertical air motion of about +-0.05 m/s (d_w / Z_w at
  37 m/s), as over flat ground in the early morning. This is the strongest assumption of the set.

``conservative`` is an ordinary set of low-cost sensors in light turbulence (vertical air motion of about
+-0.3 m/s).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from aircraft.disturbances import BandLimitedNoise
from svo.checks import Array
from svo.plant import Distribution

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

    def draw(
        self, samples: int, Ts: float, rng: np.random.Generator, distribution: Distribution = "bounded"
    ) -> tuple[Array, Array]:
        """Sensor noise (samples, 4) and gusts (samples, 3), each within its bounds unless Gaussian."""
        cutoffs = (*(SENSOR_CUTOFF_HZ,) * len(self.sensors), *GUST_CUTOFFS_HZ)
        drawn = BandLimitedNoise((*self.sensors, *self.gusts), cutoffs, Ts, distribution).draw(samples, rng)
        return drawn[:, :4], drawn[:, 4:]


_DEGREE = float(np.pi / 180)

NOISE_SETS: Mapping[str, NoiseSet] = MappingProxyType(
    {
        "quiet": NoiseSet(
            sensors=(0.2, 0.08 * _DEGREE, 0.1 * _DEGREE, 0.05 * _DEGREE),
            gusts=(0.1, 0.15, 0.005),
        ),
        "conservative": NoiseSet(
            sensors=(0.5, 0.3 * _DEGREE, 0.3 * _DEGREE, 0.3 * _DEGREE),
            gusts=(0.5, 1.0, 0.05),
        ),
    }
)
