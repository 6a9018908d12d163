"""Random first-order plants inside given bounds of g and h, simulated without the package."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from svo.interval import GainBounds

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """Inputs, bounds, true gains and true states of one run."""

    u: Array
    bounds: GainBounds
    g: Array
    h: Array
    x: Array


def random_truth(samples: int, rng: np.random.Generator, corners: float = 0.5) -> Truth:
    """A run with bounds that change at each sample, g of both signs, inputs of both signs, gains often at an end."""
    gr = rng.uniform(0, 0.3, samples)
    gc = rng.uniform(-1, 1, samples) * (0.999 - gr)
    hc, hr = rng.normal(0, 1, samples), rng.uniform(0, 0.5, samples)
    u = np.sign(rng.normal(size=samples)) * rng.exponential(1.0, samples)
    delta = rng.uniform(-1, 1, (2, samples))
    delta = np.where(rng.random((2, samples)) < corners, np.where(delta < 0, -1.0, 1.0), delta)
    g, h = gc + gr * delta[0], hc + hr * delta[1]
    x = np.empty(samples)
    x[0] = rng.uniform(-1, 1)
    for k in range(samples - 1):
        x[k + 1] = g[k] * x[k] + (1 - g[k]) * h[k] * u[k]
    return Truth(u, GainBounds(gc, gr, hc=hc, hr=hr), g, h, x)
