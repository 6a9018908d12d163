"""Signs of sums over random subsamples: a test that needs no distribution, only symmetry (section 5.6)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from polytopes.signatures import options_by_name
from svo.checks import Array
from svo.residual_tests.interface import WindowTest, check_count, check_finite

_BLOCK = 4096  # windows whose sums are in memory at a time


@options_by_name
@dataclass(frozen=True, kw_only=True)
class RandomizedSubsampling(WindowTest):
    """H1 where too few of the sums over M subsamples of the last N residuals are positive, or too few negative.

    H0 if at least L of the sums are not below zero and at least L not above. The M subsamples are those of Campi and
    Weyer (Automatica 41, 2005): a group under symmetric difference, made of M - 1 balanced ones and the empty one,
    whose sum is zero. False-alarm rate: 2 L / M per window, exactly, for independent residuals with symmetric
    continuous distributions about the mean, which may differ from sample to sample; at most that for any symmetric
    ones, as of quantised residuals: a sum of exactly zero counts on both sides, and drawing lots for its side instead
    would give the rate of 2 L / M. The survey's 2 L / M holds only if M counts the empty one: with M sums formed it
    is 2 L / (M + 1).

    The statistic is minus the smaller of the two counts.

    Parameters
    ----------
    mean : float
        About which the residual without a fault is symmetric.
    samples : int
        N in the window, at least M - 1; balanced if it is a multiple of M - 1.
    subsets : int
        M, a power of two, at least 4.
    least : int
        L >= 1, with 2 L < M.

    Raises
    ------
    ValueError
        For a number out of its range.
    """

    mean: float = 0.0
    samples: int = 31
    subsets: int = 32
    least: int = 1

    def __post_init__(self) -> None:
        check_finite(mean=self.mean)
        check_count("subsets", self.subsets, 4)
        if self.subsets & (self.subsets - 1):
            raise ValueError(f"subsets is {self.subsets}; expected a power of two, so that they form a group")
        check_count("least", self.least, 1)
        if 2 * self.least >= self.subsets:
            raise ValueError(f"least is {self.least} of {self.subsets} subsets; expected 2 least < subsets")
        check_count("samples", self.samples, self.subsets - 1)

    @property
    def threshold(self) -> float:
        return -float(self.least) + 0.5  # counts are whole numbers

    @property
    def false_alarm_rate(self) -> float:
        """Probability of an alarm at a sample without a fault."""
        return 2 * self.least / self.subsets

    @cached_property
    def membership(self) -> NDArray[np.bool_]:
        """Which residuals of the window are in which subset: (M, N), row 0 the empty one.

        Residual k has a nonzero binary vector h_k, subset i those with <i, h_k> odd. Symmetric difference then
        adds the indices modulo two, so the subsets form a group, and each nonzero vector equally often puts
        half of N, rounded up, into every subset but the empty one.
        """
        vectors = 1 + np.arange(self.samples) % (self.subsets - 1)
        both = np.arange(self.subsets)[:, None] & vectors[None, :]
        bits = (both[:, :, None] >> np.arange(self.subsets.bit_length())) & 1
        return np.asarray(bits.sum(axis=2) % 2 == 1)

    def _statistics(self, windows: Array) -> Array:
        counts = np.empty(len(windows))
        for first in range(0, len(windows), _BLOCK):
            signs = self._signs(windows[first : first + _BLOCK])
            counts[first : first + _BLOCK] = np.minimum((signs >= 0).sum(axis=1), (signs <= 0).sum(axis=1))
        return -counts

    def _signs(self, windows: Array) -> Array:
        """Signs (m, M - 1) of the sums over the subsets, exact: a sum of quantised residuals is often zero."""
        member, offsets = self.membership[1:], windows - self.mean
        sums = offsets @ member.T.astype(float)
        rounding = (self.samples + 2) * np.finfo(float).eps * np.abs(offsets).sum(axis=1, keepdims=True)
        for window, subset in np.argwhere((np.abs(sums) <= rounding) & (rounding > 0)):
            terms = windows[window, member[subset]]
            sums[window, subset] = math.fsum([*terms, *np.full(terms.size, -self.mean)])
        return np.asarray(np.sign(sums))
