"""Detectors whose alarm is a score above a level: what they share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from polytopes.shown import Shown
from svo.checks import Array
from svo.detectors.detector import Detection, Kind, Parameter, Setting
from svo.logs.log import Log
from svo.residual_tests.interface import above


class ThresholdDetector(Shown, ABC):
    """A `svo.detectors.detector.Detector` by a score; subclasses say what the score of each sample is.

    The score is NaN where there is none yet, and never an alarm there.
    """

    name: str
    kind: Kind = "threshold"
    faults: tuple[str, ...] = ()
    parameters: Mapping[str, Parameter] = MappingProxyType({})
    fixed: Setting | None = None

    @abstractmethod
    def prepare(self, log: Log) -> Any:
        """Whatever of a log's evaluation depends on no setting."""

    @abstractmethod
    def scores(self, setting: Setting, prepared: Any) -> Array:
        """The score at each sample (K,), whatever the level of the setting."""

    def learn(self, parameters: Mapping[str, float], healthy: Sequence[Any]) -> Mapping[str, Array]:
        return {}

    def critical_level(self, setting: Setting, prepared: Any, floor: float) -> float:
        scores = self.scores(setting, prepared)
        return max(floor, float(np.max(scores[~np.isnan(scores)], initial=-np.inf)))

    def run(self, setting: Setting, prepared: Any, isolate: bool = True) -> Detection:
        """Alarms alone; a detector that isolates says more."""
        return Detection(above(self.scores(setting, prepared), setting.level))
