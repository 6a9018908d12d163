"""Tests of the likelihood ratio of a Gaussian residual: generalised over a window, and sequential (5.3, 5.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from polytopes.signatures import options_by_name
from svo.checks import Array
from svo.residual_tests.interface import (
    Decision,
    ResidualTest,
    WindowTest,
    check_count,
    check_finite,
    check_positive,
    check_probability,
    row_sums,
)


@options_by_name
@dataclass(frozen=True, kw_only=True)
class GLR(WindowTest):
    """H1 where the best changed mean explains the last N residuals so much better than the fault-free one.

    The statistic is the largest log-likelihood ratio over all changed means, ln L = N (rbar - mean)^2 / (2 sigma^2).
    Equation (47) compares the sum of the residuals with its threshold from one side, which is this only if the mean
    has grown; here changes of both signs count. False-alarm rate: as given, exactly, per window of independent
    Gaussian residuals, for 2 ln L is then chi-square of one degree.

    Parameters
    ----------
    mean, sigma : float
        Of the residual without a fault.
    samples : int
        N >= 1 in the window.
    false_alarm_rate : float
        In (0, 1), per sample.

    Raises
    ------
    ValueError
        For a number out of its range.
    """

    mean: float = 0.0
    sigma: float = 1.0
    samples: int = 20
    false_alarm_rate: float = 1e-3

    def __post_init__(self) -> None:
        check_finite(mean=self.mean)
        check_positive(sigma=self.sigma)
        check_count("samples", self.samples, 1)
        check_probability(false_alarm_rate=self.false_alarm_rate)

    @property
    def threshold(self) -> float:
        """ln lambda."""
        return float(chi2.isf(self.false_alarm_rate, 1) / 2)

    def _statistics(self, windows: Array) -> Array:
        offset = row_sums((windows - self.mean) / self.sigma)
        return np.asarray(offset**2 / (2 * self.samples))


@options_by_name
@dataclass(frozen=True, kw_only=True)
class SPRT(ResidualTest):
    """Wald's sequential test of the fault-free mean against one changed mean, begun again after each decision.

    The statistic is ln L of the samples since the last decision; H0 below ln(p_nd / (1 - p_fa)), H1 above
    ln((1 - p_nd) / p_fa), equation (48). Between decisions the last one stands; before the first, H0. For changes of
    both signs run two tests. False-alarm rate: for independent Gaussian residuals, the probability that a
    decision is H1 without a fault is at most p_fa / (1 - p_nd), and close to p_fa where few samples overshoot far.

    Parameters
    ----------
    mean, sigma : float
        Of the residual without a fault.
    change : float
        mu1 - mean, the smallest change to be detected, with its sign; not zero.
    false_alarm, non_detection : float
        p_fa and p_nd, positive, together below 1.

    Raises
    ------
    ValueError
        For a number out of its range.
    """

    mean: float = 0.0
    sigma: float = 1.0
    change: float = 1.0
    false_alarm: float = 1e-3
    non_detection: float = 1e-2

    def __post_init__(self) -> None:
        check_finite(mean=self.mean, change=self.change)
        check_positive(sigma=self.sigma)
        check_probability(false_alarm=self.false_alarm, non_detection=self.non_detection)
        if self.change == 0:
            raise ValueError("change is 0; expected the change of the mean to be detected, with its sign")
        if self.false_alarm + self.non_detection >= 1:
            raise ValueError(
                f"false_alarm is {self.false_alarm} and non_detection {self.non_detection}; expected a sum below 1"
            )

    @property
    def lower(self) -> float:
        """ln L below which H0 is decided."""
        return float(np.log(self.non_detection / (1 - self.false_alarm)))

    @property
    def upper(self) -> float:
        """ln L above which H1 is decided."""
        return float(np.log((1 - self.non_detection) / self.false_alarm))

    @property
    def false_alarm_rate(self) -> float:
        """Bound on the probability that a decision is H1 without a fault."""
        return self.false_alarm / (1 - self.non_detection)

    def increments(self, residual: Array) -> Array:
        """ln of the likelihood ratio of each sample of a residual (K,) alone."""
        return np.asarray(self.change / self.sigma * ((residual - self.mean - self.change / 2) / self.sigma))

    def _run(self, r: Array) -> tuple[Array, NDArray[np.bool_]]:
        statistic, alarm = np.empty(r.size), np.zeros(r.size, dtype=bool)
        total, decision, low, high = 0.0, False, self.lower, self.upper
        for k, increment in enumerate(self.increments(r).tolist()):
            total += increment
            statistic[k] = total
            if total < low or total > high:
                decision, total = total > high, 0.0
            alarm[k] = decision
        return statistic, alarm

    def _begin(self) -> tuple[float, bool]:
        return 0.0, False

    def _advance(self, state: tuple[float, bool], r: float) -> tuple[tuple[float, bool], Decision]:
        total, decision = state
        total += float(self.increments(np.array(r)))
        if not self.lower <= total <= self.upper:
            decision = total > self.upper
            return (0.0, decision), Decision(total, decision)
        return (total, decision), Decision(total, decision)
