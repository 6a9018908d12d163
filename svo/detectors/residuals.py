"""Residual tests on the innovations of a Kalman filter, as detectors; they only detect.

The innovations are made white with what is learnt from fault-free runs, since band-limited noise correlates them.
Each test runs on every channel, and the score of a sample is the largest over the channels.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from svo.baselines.kalman import InnovationFilter
from svo.baselines.linear_gaussian import GaussianModel
from svo.checks import Array
from svo.detectors.detector import Parameter, Setting
from svo.detectors.threshold import ThresholdDetector
from svo.logs.log import Log
from svo.residual_tests import CUSUM, GLR, SPRT, RandomizedSubsampling, StudentT, Whitening

ORDER = 4  # of the whitening filter: a low-pass of second order, sampled, and the states' dynamics


@dataclass(frozen=True)
class ResidualTestDetector(ThresholdDetector):
    """What the tests share: innovations, whitening, the largest score over channels."""

    model: GaussianModel

    def prepare(self, log: Log) -> Array:
        """Whitened innovations of the filter (K, ny)."""
        return InnovationFilter(self.model).run(log).white

    def learn(self, parameters: Mapping[str, float], healthy: Sequence[Array]) -> dict[str, Array]:
        channels = [[white[:, i] for white in healthy] for i in range(healthy[0].shape[1])]
        fits = [Whitening.fit(channel, ORDER) for channel in channels]
        return {
            "mean": np.array([f.mean for f in fits]),
            "sigma": np.array([f.sigma for f in fits]),
            "coefficients": np.array([f.coefficients for f in fits]),
        }

    def scores(self, setting: Setting, prepared: Array) -> Array:
        learned = setting.learned
        channels = []
        for i, innovation in enumerate(prepared.T):
            whitening = Whitening(
                float(learned["mean"][i]), float(learned["sigma"][i]), coefficients=tuple(learned["coefficients"][i])
            )
            channels.append(self.channel_scores(setting.parameters, whitening.apply(innovation)))
        return np.max(channels, axis=0)

    @abstractmethod
    def channel_scores(self, parameters: Mapping[str, float], white: Array) -> Array:
        """Scores (K,) of one white residual of mean 0 and variance 1; NaN while there are none."""


class StaticDetector(ResidualTestDetector):
    """Fixed thresholds."""

    name = "static threshold"

    def channel_scores(self, parameters: Mapping[str, float], white: Array) -> Array:
        return np.abs(white)


class StudentDetector(ResidualTestDetector):
    """Student's test over a window."""

    name = "Student"
    parameters = MappingProxyType({"samples": Parameter(3, 80, integer=True, logarithmic=True)})

    def channel_scores(self, parameters: Mapping[str, float], white: Array) -> Array:
        return StudentT(samples=int(parameters["samples"])).run(white).statistic


class GLRDetector(ResidualTestDetector):
    """Generalised likelihood ratio over a window."""

    name = "GLR"
    parameters = MappingProxyType({"samples": Parameter(1, 80, integer=True, logarithmic=True)})

    def channel_scores(self, parameters: Mapping[str, float], white: Array) -> Array:
        return GLR(samples=int(parameters["samples"])).run(white).statistic


class SPRTDetector(ResidualTestDetector):
    """Wald's test for a change to either side; the score is ln L since the last decision for H0."""

    name = "SPRT"
    parameters = MappingProxyType(
        {
            "change": Parameter(0.05, 4.0, logarithmic=True),
            "non_detection": Parameter(1e-4, 1e-1, logarithmic=True),
        }
    )

    def channel_scores(self, parameters: Mapping[str, float], white: Array) -> Array:
        sides = [SPRT(change=sign * parameters["change"]).increments(white) for sign in (1, -1)]
        return np.maximum(*(_since_healthy(side, float(np.log(parameters["non_detection"]))) for side in sides))


def _since_healthy(increments: Array, lowest: float) -> Array:
    """ln L (K,) of the samples since it was last below its threshold for H0; no threshold for H1 begins it again."""
    scores, total = np.empty(increments.size), 0.0
    for k, increment in enumerate(increments.tolist()):
        total += increment
        scores[k] = total
        total = total if total >= lowest else 0.0
    return scores


class CUSUMDetector(ResidualTestDetector):
    """Two-sided cumulative sum."""

    name = "CUSUM"
    parameters = MappingProxyType({"change": Parameter(0.05, 4.0, logarithmic=True)})

    def channel_scores(self, parameters: Mapping[str, float], white: Array) -> Array:
        return CUSUM(change=parameters["change"]).run(white).statistic


class SubsamplingDetector(ResidualTestDetector):
    """Randomised subsampling with L = 1; the score is the number of rejections in a row.

    Its own rate is at least 2 / M a sample, far too many for a run of a thousand samples, so it must reject so
    many times in a row.
    """

    name = "randomised subsampling"
    parameters = MappingProxyType({"doublings": Parameter(3, 7, integer=True)})

    def channel_scores(self, parameters: Mapping[str, float], white: Array) -> Array:
        subsets = 2 ** int(parameters["doublings"])
        rejected = RandomizedSubsampling(samples=subsets - 1, subsets=subsets).run(white).alarm
        count = np.cumsum(rejected)
        return (count - np.maximum.accumulate(np.where(rejected, 0, count))).astype(float)


def residual_test_detectors(model: GaussianModel) -> list[ResidualTestDetector]:
    """All of this file for one plant without a fault."""
    return [
        StaticDetector(model),
        StudentDetector(model),
        GLRDetector(model),
        SPRTDetector(model),
        CUSUMDetector(model),
        SubsamplingDetector(model),
    ]
