"""A characterisation in three numbers: lambda_q <= alpha q^gamma + beta (paper 001, section 3.1.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from polytopes.shown import Shown
from svo.checks import Array, expect_shape, finite_array
from svo.interval.thresholds import checked_bounds

DEFAULT_EXPONENTS: tuple[float, ...] = tuple(np.round(np.arange(-2.0, 0.0, 0.05), 2).tolist())


@dataclass(frozen=True)
class PowerLaw(Shown):
    """alpha q^gamma + beta, with alpha >= 0."""

    alpha: float
    beta: float
    gamma: float

    def bounds(self, qbar: int) -> Array:
        """Its values at q = 1..qbar, (qbar,): what a `NoiseCharacterization` can be made of."""
        return self.alpha * np.arange(1.0, qbar + 1) ** self.gamma + self.beta


def smallest_power_law(bounds: ArrayLike, exponents: ArrayLike = DEFAULT_EXPONENTS) -> PowerLaw:
    """The power law that is nowhere below the bounds with the least mean excess over them.

    For each exponent of the grid the best alpha >= 0 and beta solve a linear program; the best exponent wins. It is an
    upper bound, not a regression: a least-squares fit lies below some lambda_q, and thresholds made of it are void.

    Parameters
    ----------
    bounds : (qbar,) array
        lambda_q.
    exponents : (m,) array
        Grid of gamma.

    Raises
    ------
    RuntimeError
        If the solver fails.
    """
    lam, grid = checked_bounds(bounds), finite_array("exponents", exponents)
    expect_shape(grid.ndim == 1 and grid.size, "exponents", grid, "(m,) finite numbers, at least one")
    return min((_best(lam, float(gamma)) for gamma in grid), key=lambda law: float(np.mean(law.bounds(lam.size))))


def _best(lam: Array, gamma: float) -> PowerLaw:
    from scipy.optimize import linprog

    q = np.arange(1.0, lam.size + 1)
    scale = float(lam.max()) or 1.0
    shape = q**gamma
    answer = linprog(
        [shape.mean(), 1.0],
        A_ub=-np.column_stack([shape, np.ones_like(q)]),
        b_ub=-lam / scale,
        bounds=[(0, None), (None, None)],
        method="highs",
    )
    if answer.status != 0:
        raise RuntimeError(f"the linear program of the power law with exponent {gamma} failed: {answer.message}")
    alpha, beta = (float(v) * scale for v in answer.x)
    short = float(np.max(lam - PowerLaw(alpha, beta, gamma).bounds(lam.size)))
    if short >= 0:  # the solver's tolerance, and one rounding
        beta = float(np.nextafter(beta + short, np.inf)) + 1e-15 * scale
    return PowerLaw(alpha, beta, gamma)
