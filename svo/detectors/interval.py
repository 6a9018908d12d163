"""The interval detector in a comparison: its threshold, learnt from fault-free runs, times a level."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from svo.checks import Array
from svo.detectors.detector import Detection, Setting
from svo.detectors.threshold import ThresholdDetector
from svo.interval import IntervalPrediction, IntervalPredictor, NoiseCharacterization, first_order_filter
from svo.logs.log import Log

_HAIR = 1e-9  # above 1: a safety factor that leaves the whole choice to the level


@dataclass(frozen=True)
class IntervalThreshold(ThresholdDetector):
    """Filtered dead-zone residual over the threshold of Corollary 2; level 1 is that of the characterisation itself.

    Parameters
    ----------
    predictor : function of the first command
        Gives the interval predictor of a run that starts with it.
    pole : float
        Of the residual filter.
    qbar : int
        Longest window of the characterisation.
    """

    predictor: Callable[[float], IntervalPredictor]
    pole: float
    qbar: int

    @property
    def name(self) -> str:  # type: ignore[override]
        return f"interval, a = {self.pole:g}"

    def prepare(self, log: Log) -> IntervalPrediction:
        return self.predictor(float(log.u[0, 0])).predict(log)

    def learn(self, parameters: Mapping[str, float], healthy: Sequence[Any]) -> Mapping[str, Array]:
        residuals = [prediction.residual for prediction in healthy]
        return {"bounds": NoiseCharacterization.from_records(residuals, self.qbar, safety_factor=1.0 + _HAIR).bounds}

    def scores(self, setting: Setting, prepared: IntervalPrediction) -> Array:
        filtered = first_order_filter(prepared.residual, self.pole)
        thresholds = NoiseCharacterization(setting.learned["bounds"]).thresholds(self.pole)
        counted = np.cumsum(~np.isnan(prepared.residual)) - 1
        return np.abs(filtered) / thresholds[np.clip(counted, 0, self.qbar)]

    def run(self, setting: Setting, prepared: IntervalPrediction, isolate: bool = True) -> Detection:
        return replace(super().run(setting, prepared, isolate), width=2 * prepared.radius[:, None])
