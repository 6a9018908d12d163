"""Errors of the inertial measurement unit and the inertial navigation system: scale, bias, noise, delay.

A measurement is scale x + bias + noise, received two samples late (Marzat et al., SysTol 2010, section II-C, which
prints no numbers: all of those here are own choices). The bias of a run is uniform within its bound.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np

from svo.checks import Array, expect_one_of, sizes

Distribution = Literal["uniform", "gaussian"]

DELAY = 2
GAUSSIAN_SIGMAS = 5.0  # within which a Gaussian sample is taken to lie: 6e-7 of them do not


def _per_group(acceleration: float, rate: float, position: float, velocity: float, angle: float) -> Array:
    return np.repeat([acceleration, rate, position, velocity, angle], 3)


@dataclass(frozen=True)
class SensorErrors:
    """What IMU and INS add to the truth, one entry a measurement.

    The 15 measurements are abx, aby, abz, p, q, r, x, y, z, vbx, vby, vbz, phi, theta, psi.

    Parameters
    ----------
    distribution : {"uniform", "gaussian"}
        Of the noise; both have standard deviation ``sigma``, the uniform one ends at sqrt(3) sigma.
    scale, bias, sigma : (15,) arrays
        Scale factor, largest bias, standard deviation, in m/s^2, rad/s, m, m/s, rad.
    """

    distribution: Distribution
    scale: Array = field(default_factory=lambda: _per_group(1.0005, 1.0005, 1.0, 1.0, 1.0))
    bias: Array = field(default_factory=lambda: _per_group(0.02, 1e-4, 5.0, 0.3, 5e-4))
    sigma: Array = field(default_factory=lambda: _per_group(0.05, 1e-3, 0.5, 0.05, 2e-4))

    def __post_init__(self) -> None:
        expect_one_of("distribution", self.distribution, get_args(Distribution))
        for name in ("scale", "bias", "sigma"):
            object.__setattr__(self, name, sizes(name, getattr(self, name), 15))

    @classmethod
    def none(cls) -> SensorErrors:
        """Ideal measurements."""
        return cls("uniform", np.ones(15), np.zeros(15), np.zeros(15))

    @property
    def noise_bound(self) -> Array:
        """Half-width of the noise (15,): sqrt(3) sigma, or 5 sigma where it is Gaussian and has no bound."""
        return self.sigma * (np.sqrt(3.0) if self.distribution == "uniform" else GAUSSIAN_SIGMAS)

    def bound(self, measured: Array) -> Array:
        """Half-width of the whole error of measurements (..., 15), scale factor included."""
        additive = self.bias + self.noise_bound
        misread = np.abs(self.scale - 1.0)
        return additive + misread / self.scale * (np.abs(measured) + additive)

    def draw(self, samples: int, rng: np.random.Generator) -> Array:
        """Bias plus noise of one run, (samples, 15); a longer run begins with the shorter one."""
        bias = rng.uniform(-1.0, 1.0, 15) * self.bias
        if self.distribution == "uniform":
            return bias + self.noise_bound * rng.uniform(-1.0, 1.0, (samples, 15))
        return bias + self.sigma * rng.standard_normal((samples, 15))


NOISE_SETS: Mapping[str, SensorErrors] = MappingProxyType(
    {"bounded": SensorErrors("uniform"), "gaussian": SensorErrors("gaussian")}
)
