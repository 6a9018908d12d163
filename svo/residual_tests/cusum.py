"""Page's cumulative sum, two-sided (section 5.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polytopes.signatures import options_by_name
from svo.checks import Array
from svo.residual_tests.interface import Decision, ResidualTest, above, check_finite, check_positive
from svo.residual_tests.run_length import LARGEST_DRIFT, LARGEST_THRESHOLD, log_run_length

_LARGEST = float(np.log(np.finfo(float).max))


@options_by_name
@dataclass(frozen=True, kw_only=True)
class CUSUM(ResidualTest):
    """H1 where the residual has drifted off its mean, to either side, by more than the threshold.

    S1 = max(S1 + r - mean - d/2, 0), S2 = max(S2 - r + mean - d/2, 0), d the size of the change: equation (49), in
    which mu1 stands for that size, not for the changed mean. The statistic is max(S1, S2). False-alarm rate:
    `average_run_length` gives the mean number of samples to an alarm without a fault, for independent Gaussian
    residuals; its inverse is the rate per sample.

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

        Infinite where it is beyond the floats, as `log_average_run_length` never is.

        Parameters
        ----------
        sigma : float
            Standard deviation of the residual, positive.

        Raises
        ------
        ValueError
            If sigma is not positive, or the threshold over 10,000 sigma while the change is so small that L is finite.
        """
        k, h = self._in_units_of(sigma)
        # L >= exp(2 k h), and from k = 40 on one step from zero is a chance below 1e-308.
        if 2 * k * h - np.log(2) > _LARGEST or k > LARGEST_DRIFT:
            return float("inf")
        length = self.log_average_run_length(sigma)
        return float(np.exp(length)) if length <= _LARGEST else float("inf")

    def log_average_run_length(self, sigma: float) -> float:
        """Natural logarithm of `average_run_length`, to about 1e-9.

        Each side has the same mean run length, and together half of it (Kemp 1961), which is exact here: while one
        side grows to the threshold the other is at zero. See `svo.residual_tests.run_length`.

        Parameters
        ----------
        sigma : float
            Standard deviation of the residual, positive.

        Raises
        ------
        ValueError
            If sigma is not positive, the change over 80 sigma, or the threshold over 10,000 sigma.
        """
        k, h = self._in_units_of(sigma)
        if k > LARGEST_DRIFT or h > LARGEST_THRESHOLD:
            raise ValueError(
                f"change is {2 * k:g} sigma and threshold {h:g} sigma; expected at most {2 * LARGEST_DRIFT:g} and "
                f"{LARGEST_THRESHOLD:g}: is sigma in the units of the residual?"
            )
        return log_run_length(k, h) - float(np.log(2))

    def _in_units_of(self, sigma: float) -> tuple[float, float]:
        """Half the change, and the threshold."""
        check_positive(sigma=sigma)
        return self.change / 2 / sigma, self.threshold / sigma

    def _run(self, r: Array) -> tuple[Array, NDArray[np.bool_]]:
        statistic, state = np.empty(r.size), self._begin()
        for i, residual in enumerate(r.tolist()):
            state = self._sums(state, residual)
            statistic[i] = max(state)
        return statistic, above(statistic, self.threshold)

    def _begin(self) -> tuple[float, float]:
        return 0.0, 0.0

    def _advance(self, state: tuple[float, float], r: float) -> tuple[tuple[float, float], Decision]:
        state = self._sums(state, r)
        return state, Decision(max(state), max(state) > self.threshold)

    def _sums(self, state: tuple[float, float], r: float) -> tuple[float, float]:
        """S1 and S2 after one more residual."""
        offset, half = r - self.mean, self.change / 2
        return max(state[0] + (offset - half), 0.0), max(state[1] - (offset + half), 0.0)
