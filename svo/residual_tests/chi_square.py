"""Chi-square test of a vector residual, such as the innovations of a Kalman filter."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

from scipy.stats import chi2

from polytopes.signatures import options_by_name
from svo.checks import Array
from svo.residual_tests.interface import WindowTest, check_count, check_probability, row_sums


@options_by_name
@dataclass(frozen=True)
class ChiSquare(WindowTest):
    """H1 where the last N squared norms of a vector residual sum to more than chance allows.

    What it takes is the squared norm r' S^-1 r at each sample, S the covariance of r without a fault. The
    statistic is the sum of the last N. False-alarm rate: as given, exactly, per window of independent Gaussian
    residuals.

    Parameters
    ----------
    degrees : int
        Length of the residual vector.
    samples : int
        N >= 1 in the window.
    false_alarm_rate : float
        In (0, 1), per sample.
    """

    degrees: int
    _: KW_ONLY
    samples: int = 1
    false_alarm_rate: float = 1e-3

    def __post_init__(self) -> None:
        check_count("degrees", self.degrees, 1)
        check_count("samples", self.samples, 1)
        check_probability(false_alarm_rate=self.false_alarm_rate)

    @property
    def threshold(self) -> float:
        return float(chi2.isf(self.false_alarm_rate, self.degrees * self.samples))

    def _statistics(self, windows: Array) -> Array:
        return row_sums(windows)
