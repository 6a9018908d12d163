"""Student's t-test of the mean over a window (section 5.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from svo.residual_tests.interface import WindowTest, check_count, check_finite, check_probability

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StudentT(WindowTest):
    """H1 where the mean of the last N residuals differs from the fault-free one by more than chance allows.

    The statistic is ``|rbar - mean| sqrt(N) / s`` with the standard deviation s of the same window, so no sigma is
    needed. False-alarm rate: 1 - confidence per window, exactly, for independent Gaussian residuals.

    Parameters
    ----------
    mean : float
        Of the residual without a fault.
    samples : int
        N >= 2 in the window.
    confidence : float
        In (0, 1).

    Raises
    ------
    ValueError
        For a number out of its range.
    """

    mean: float = 0.0
    samples: int = 20
    confidence: float = 0.99

    def __post_init__(self) -> None:
        check_finite(mean=self.mean)
        check_count("samples", self.samples, 2)
        check_probability(confidence=self.confidence)

    @property
    def threshold(self) -> float:
        return float(t.isf((1 - self.confidence) / 2, self.samples - 1))

    @property
    def false_alarm_rate(self) -> float:
        """Probability of an alarm at a sample without a fault."""
        return 1 - self.confidence

    def _statistics(self, windows: Array) -> Array:
        offset = np.abs(windows.mean(axis=1) - self.mean) * np.sqrt(self.samples)
        spread = windows.std(axis=1, ddof=1)
        # A window without spread is as far off as can be, or not at all.
        far = np.where(offset > 0, np.inf, 0.0)
        return np.asarray(np.divide(offset, spread, where=spread > 0, out=far))
