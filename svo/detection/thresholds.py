"""What an interval detector beside a plant's bank says about a log."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from svo.interval.on_log import ThresholdDetection
from svo.logs.log import Log


@runtime_checkable
class DetectsThresholds(Protocol):
    """What a `MonitoredPlant` offers besides if an interval detector runs beside its bank."""

    @property
    def has_thresholds(self) -> bool:
        """Whether there is such a detector: only then is the whole of a long log read at once."""
        ...

    def detect_thresholds(self, log: Log) -> ThresholdDetection | None:
        """What that detector says about a log; None if there is none after all."""
        ...
