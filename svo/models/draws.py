"""Random values of unknowns, inside their bounds."""

from __future__ import annotations

import numpy as np

from svo.checks import Array


def draw(lower: Array, upper: Array, rng: np.random.Generator, corners: bool) -> Array:
    """Uniform between bounds, or at their ends."""
    if corners:
        return np.where(rng.random(lower.shape) < 0.5, lower, upper)
    return rng.uniform(lower, upper)


def draw_mixture(vertices: Array, rng: np.random.Generator, corners: bool) -> Array:
    """A vertex, or a random mixture of all."""
    if corners:
        return vertices[rng.integers(len(vertices))]
    return rng.dirichlet(np.ones(len(vertices))) @ vertices
