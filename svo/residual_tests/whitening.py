"""Residuals made white, and their normalised sums: equation (45) needs the one for the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, finite_array
from svo.residual_tests.interface import check_count, check_finite, check_positive


@options_by_name
@dataclass(frozen=True)
class Whitening(Shown):
    """An autoregressive filter that makes a fault-free residual white, with mean 0 and variance 1.

    e(k) = (r(k) - mean - sum_j coefficients[j] (r(k-1-j) - mean)) / sigma.

    Parameters
    ----------
    mean, sigma : float
    coefficients : tuple of float
        Empty for a residual that is white.
    """

    mean: float
    sigma: float
    _: KW_ONLY
    coefficients: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_finite(mean=self.mean)
        check_positive(sigma=self.sigma)

    @classmethod
    def fit(cls, residuals: Sequence[ArrayLike], order: int) -> Whitening:
        """From fault-free residuals, by the Yule-Walker equations.

        Parameters
        ----------
        residuals : sequence of (K,) arrays
            Runs, each longer than the order.
        order : int
            Number of coefficients, >= 0.

        Raises
        ------
        ValueError
            If a run is too short, not finite, or the residuals do not vary.
        """
        check_count("order", order, 0)
        runs = [finite_array(f"run {i} of the residuals", r) for i, r in enumerate(residuals)]
        if not runs or any(r.ndim != 1 or r.size <= order for r in runs):
            raise ValueError(f"residuals has runs of {[r.shape for r in runs]}; expected finite (K,), K > {order}")
        mean = float(np.concatenate(runs).mean())
        centred = [r - mean for r in runs]
        total = sum(r.size for r in centred)
        covariance = np.array([sum(r[j:] @ r[: r.size - j] for r in centred) / total for j in range(order + 1)])
        if covariance[0] <= 0 or np.ptp(np.concatenate(runs)) == 0:  # a mean is rounded, so the first may be 1e-34
            raise ValueError("the residuals do not vary; expected noise to estimate a standard deviation from")
        coefficients = solve_toeplitz(covariance[:-1], covariance[1:]) if order else np.empty(0)
        variance = float(covariance[0] - coefficients @ covariance[1:])
        return cls(mean, float(np.sqrt(variance)), coefficients=tuple(map(float, coefficients)))

    def apply(self, residual: ArrayLike) -> Array:
        """The white residual (K,); before the first sample the residual is taken to have been at its mean."""
        centred = finite_array("residual", residual) - self.mean
        return np.asarray(lfilter(np.append(1.0, -np.array(self.coefficients)), [1.0], centred)) / self.sigma


def normalised_sum(residual: ArrayLike, samples: int) -> Array:
    """N^(-1/2) times the sum of the last N = ``samples`` of a residual (K,), equation (45); NaN until there are N.

    With white residuals of variance 1 it is close to a standard Gaussian for large N, whatever their
    distribution; with correlated ones its variance is another (`Whitening`).

    Raises
    ------
    ValueError
        If the residual is not (K,), or N is below 1.
    """
    check_count("samples", samples, 1)
    r = finite_array("residual", residual, ("K",))
    sums = np.full(r.size, np.nan)
    if r.size >= samples:
        sums[samples - 1 :] = np.lib.stride_tricks.sliding_window_view(r, samples).sum(axis=1)
    return sums / np.sqrt(samples)
