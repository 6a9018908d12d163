"""Page's cumulative sum, two-sided (section 5.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr
from scipy.stats import norm

from svo.residual_tests.interface import Decision, ResidualTest, above, check_finite, check_positive

Array = NDArray[np.float64]
_NODES = 64  # of the Gauss-Legendre rule; doubling it changes the run length by less than 1e-10


@dataclass(frozen=True)
class CUSUM(ResidualTest):
    """H1 where the residual has drifted off its mean, to either side, by more than the threshold.

    S1 = max(S1 + r - mean - d/2, 0), S2 = max(S2 - r + mean - d/2, 0), d the size of the change: equation (49), in
    which mu1 stands for that size, not for the changed mean. The statistic is max(S1, S2). False-alarm rate:
    `average_run_length` gives the mean number of samples to an alarm without a fault, exactly (to the
    quadrature), for independent Gaussian residuals; its inverse is the rate per sample.

    Parameters
    ----------
    mean : float
        Of the residual without a fault.
    change : float
        d > 0, in the units of the residual.
    threshold : float
        > 0, in the units of the residual.

    Raises
    ------
    ValueError
        For a number out of its range.
    """

    mean: float = 0.0
    change: float = 1.0
    threshold: float = 5.0

    def __post_init__(self) -> None:
        check_finite(mean=self.mean)
        check_positive(change=self.change, threshold=self.threshold)

    def average_run_length(self, sigma: float) -> float:
        """Mean number of samples to an alarm without a fault, for independent Gaussian residuals.

        One side is a Markov process on [0, threshold]; its mean run length L solves Page's integral equation
        L(z) = 1 + L(0) Phi(k - z) + integral_0^h L(x) phi(x - z + k) dx in units of sigma, k = d/2. Both sides have
        the same, and together half of it (Kemp 1961).

        Parameters
        ----------
        sigma : float
            Standard deviation of the residual, positive.
        """
        check_positive(sigma=sigma)
        k, h = self.change / 2 / sigma, self.threshold / sigma
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        x, weights = h * (nodes + 1) / 2, h * weights / 2
        z = np.append(0.0, x)  # L at zero and at the nodes
        kernel = np.hstack([ndtr(k - z)[:, None], norm.pdf(x[None, :] - z[:, None] + k) * weights])
        return float(np.linalg.solve(np.eye(z.size) - kernel, np.ones(z.size))[0] / 2)

    def _run(self, r: Array) -> tuple[Array, NDArray[np.bool_]]:
        statistic = np.maximum(_reflected(r - self.mean - self.change / 2), _reflected(self.mean - r - self.change / 2))
        return statistic, above(statistic, self.threshold)

    def _begin(self) -> tuple[float, float]:
        return 0.0, 0.0

    def _advance(self, state: tuple[float, float], r: float) -> tuple[tuple[float, float], Decision]:
        up = max(state[0] + r - self.mean - self.change / 2, 0.0)
        down = max(state[1] - r + self.mean - self.change / 2, 0.0)
        statistic = max(up, down)
        return (up, down), Decision(statistic, statistic > self.threshold)


def _reflected(increments: Array) -> Array:
    """S(k) = max(S(k-1) + increment, 0) from S = 0: the sums minus the least of them so far, and of zero."""
    sums = np.cumsum(increments)
    return np.asarray(sums - np.minimum(np.minimum.accumulate(sums), 0.0)) if sums.size else sums
