"""A detector for the compared plant, five that are each broken in one way, and the rule that says so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from svo import Log
from svo.detectors.detector import Detection, Setting
from svo.detectors.threshold import ThresholdDetector


class Redundancy(ThresholdDetector):
    """The third sensor reads the sum of the others: a residual whose largest value is the noise's."""

    name = "redundancy"
    parameters = {}  # noqa: RUF012

    def prepare(self, log: Log) -> Any:
        return log.y @ np.array([1.0, 1.0, -1.0])

    def scores(self, setting: Setting, prepared: Any) -> Any:
        return np.abs(prepared)


class LooksAhead(Redundancy):
    """It takes the mean of the whole log off the residual."""

    def scores(self, setting: Setting, prepared: Any) -> Any:
        return np.abs(prepared - prepared.mean())


class KeepsTheLastRun(Redundancy):
    """Its residual is filtered, and the filter goes on from the log before."""

    _last = 0.0

    def scores(self, setting: Setting, prepared: Any) -> Any:
        filtered = []
        for value in prepared:
            self._last = 0.9 * self._last + value
            filtered.append(abs(self._last))
        return np.array(filtered)


class LevelTwice(Redundancy):
    """It multiplies the score by a level that it then compares with."""

    def scores(self, setting: Setting, prepared: Any) -> Any:
        return np.abs(prepared) * (1.0 if np.isinf(setting.level) else setting.level**2)


class TypicalLevel(Redundancy):
    """Its critical level is the one that most samples stay below."""

    def critical_level(self, setting: Setting, prepared: Any, floor: float) -> float:
        return max(floor, float(np.quantile(np.abs(prepared), 0.9)))


class IsolatesNobody(Redundancy):
    """It names a fault, and lists none."""

    def run(self, setting: Setting, prepared: Any, isolate: bool = True) -> Detection:
        found = super().run(setting, prepared, isolate)
        return replace(found, isolated=np.zeros(found.alarm.size, dtype=np.intp))


BROKEN_DETECTORS = {
    LooksAhead: "no look ahead",
    KeepsTheLastRun: "runs apart",
    LevelTwice: "higher level",
    TypicalLevel: "critical level",
    IsolatesNobody: "answers",
}
