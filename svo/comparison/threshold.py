"""Detectors whose alarm is a score above a level: what they share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.comparison.detector import Detection, Kind, Parameter, Setting
from svo.log import Log

Array = NDArray[np.float64]


class ThresholdDetector(ABC):
    """A `svo.comparison.detector.Detector` by a score; subclasses say what the score of each sample is.

    The score is NaN where there is none yet, and never an alarm there.
    """

    name: str
    kind: Kind = "threshold"
    faults: tuple[str, ...] = ()
    parameters: Mapping[str, Parameter]
    fixed: Setting | None = None

    @abstractmethod
    def prepare(self, log: Log) -> Any:
        """Whatever of a log's evaluation depends on no setting."""

    @abstractmethod
    def scores(self, setting: Setting, prepared: Any) -> Array:
        """The score at each sample (K,), whatever the level of the setting."""

    def diagnose(self, setting: Setting, prepared: Any, alarm: NDArray[np.bool_]) -> NDArray[np.intp] | None:
        """The fault named at each sample, -1 for none; None if the detector only detects."""
        return None

    def learn(self, parameters: Mapping[str, float], healthy: Sequence[Any]) -> Mapping[str, Array]:
        return {}

    def critical_level(self, setting: Setting, prepared: Any, floor: float) -> float:
        scores = self.scores(setting, prepared)
        return max(floor, float(np.max(scores[~np.isnan(scores)], initial=-np.inf)))

    def run(self, setting: Setting, prepared: Any, isolate: bool = True) -> Detection:
        scores = self.scores(setting, prepared)
        alarm = np.greater(scores, setting.level, where=~np.isnan(scores), out=np.zeros(scores.shape, dtype=bool))
        return Detection(alarm, self.diagnose(setting, prepared, alarm) if isolate else None)
