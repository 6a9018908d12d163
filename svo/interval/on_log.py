"""An interval detector over a recorded log, as the command line reports it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes.shown import Shown
from svo.interval.detector import IntervalDetector, IntervalRecord
from svo.logs.log import Log


@dataclass(frozen=True, eq=False)
class ThresholdDetection(Shown):
    """What an interval detector said about a log: threshold crossings, which are no falsifications.

    Attributes
    ----------
    record : IntervalRecord
    pole : float
        Of its residual filter.
    """

    record: IntervalRecord
    pole: float

    @property
    def first_alarm_s(self) -> float | None:
        """Time of the first sample beyond the threshold [s]."""
        k = self.record.first_alarm
        return None if k is None else float(self.record.prediction.time[k])

    @property
    def periods_s(self) -> list[tuple[float, float]]:
        """First and last time of each run of samples beyond the threshold [s]."""
        time = self.record.prediction.time
        edges = np.diff(self.record.exceeded.astype(int), prepend=0, append=0)
        begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
        return [(float(time[a]), float(time[b])) for a, b in zip(begins, ends, strict=True)]

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "detector": "interval",
            "pole": self.pole,
            "samples": len(self.record.prediction),
            "begin_s": float(self.record.prediction.time[0]),
            "first_alarm_s": self.first_alarm_s,
            "samples_beyond": int(self.record.exceeded.sum()),
            "periods_s": self.periods_s,
        }

    def to_text(self) -> str:
        """For people, one line."""
        begin, samples = self.record.prediction.time[0], len(self.record.prediction)
        judged = f"{samples} samples from {begin:g} s on (a = {self.pole:g})"
        if self.first_alarm_s is None:
            return f"Interval detector: no threshold crossing in {judged}."
        beyond = int(self.record.exceeded.sum())
        return (
            f"Interval detector: first beyond its threshold at {self.first_alarm_s:g} s, in {beyond} of {judged}. "
            "This rests on the learnt noise; it is no proof."
        )


def detect_thresholds(detector: IntervalDetector, log: Log) -> ThresholdDetection:
    """Run an interval detector over a log with one input and one output."""
    return ThresholdDetection(detector.run(log), detector.pole)
