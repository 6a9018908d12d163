"""Student's t-test of the mean over a window (section 5.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t

from polytopes.signatures import options_by_name
from svo.checks import Array
from svo.residual_tests.interface import WindowTest, check_count, check_finite, check_probability, row_sums


@options_by_name
@dataclass(frozen=True, kw_only=True)
class StudentT(WindowTest):
    """H1 where the mean of the last N residuals differs from the fault-free one by more than chance allows.

    The statistic is ``|rbar - mean| sqrt(N) / s`` with the standard deviation s of the same window, so no sigma is
    needed. False-alarm rate: 1 - confidence per window, for independent Gaussian residuals. Neither the difference
    nor the spread counts below the rounding of the residuals, 2.2e-16 of the largest: a residual that stays at its
    mean is no alarm, one that stays anywhere else is.

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
        # Mean and spread of a window are known to the rounding of its residuals, so nothing finer is believed.
        rounding = np.finfo(float).eps * np.maximum(np.abs(windows).max(axis=1), abs(self.mean))
        offsets = windows - self.mean
        middle = row_sums(offsets) / self.samples
        spread = np.sqrt(row_sums((offsets - middle[:, None]) ** 2) / (self.samples - 1))
        error = np.maximum(spread, rounding) / np.sqrt(self.samples)
        away = np.maximum(np.abs(middle) - rounding, 0.0)
        return np.divide(away, error, where=error > 0, out=np.zeros(len(windows)))
