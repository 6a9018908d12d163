"""One run of one detector, judged: delays, false alarms, isolation, cost."""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.detectors.detector import NOBODY, Detector, Setting
from svo.indices import detection_indices, first_true, judge_alarm
from svo.logs.log import Log
from svo.plant import HEALTHY


@dataclass(frozen=True)
class ComparedRun:
    """A row of the run table. Times that do not exist are None.

    Attributes
    ----------
    distribution, detector, fault, profile : str
    seed : int
        `with_noise(distribution).simulate(fault, profile, noise, seed)` gives this very run.
    first_alarm_s : float or None
        From the fault to the first alarm that begins at or after it; the first faulty sample counts as one sampling
        time. One that stood before is a false alarm and no detection, however long it stands.
    delay_s : float or None
        From the fault to the last switch from false to true (section 2.4 of the survey). None too if the alarm is
        from before the fault.
    false_alarm : bool or None
        An alarm before the fault; at any time in a run without one.
    false_detection_rate, non_detection_rate : float or None
        Shares of time, before and from the fault on.
    isolated_as : str or None
        The first fault whose naming began at or after the fault; what was named before tells nothing of it.
    isolation_delay_s : float or None
        To that naming, if it is right.
    microseconds_per_sample : float or None
        CPU time, everything that depends on the log included.
    width : float or None
        Mean over samples and quantities of the width of the detector's bounds.
    error : str or None
        Why the run failed; None if it did not.
    """

    distribution: str
    detector: str
    fault: str
    profile: str
    seed: int
    first_alarm_s: float | None
    delay_s: float | None
    false_alarm: bool | None
    false_detection_rate: float | None
    non_detection_rate: float | None
    isolated_as: str | None
    isolation_delay_s: float | None
    microseconds_per_sample: float | None
    width: float | None
    error: str | None = None

    @classmethod
    def failed(cls, condition: Condition, detector: str, seed: int, error: str) -> ComparedRun:
        """The row of a detector's run that failed."""
        identity = (condition.distribution, detector, condition.fault, condition.profile, seed)
        return cls(*identity, None, None, None, None, None, None, None, None, None, error)


@dataclass(frozen=True)
class Condition:
    """What was simulated: the noise's distribution, the fault and its profile, and when the fault began [s]."""

    distribution: str
    fault: str
    profile: str
    fault_time: float


def compare_run(detector: Detector, setting: Setting, log: Log, condition: Condition, seed: int) -> ComparedRun:
    """Run a detector over a log and judge it by the indices of section 2.4."""
    healthy = condition.fault == HEALTHY
    begun = process_time()
    detection = detector.run(setting, detector.prepare(log), isolate=not healthy)
    seconds = process_time() - begun
    identity = (condition.distribution, detector.name, condition.fault, condition.profile, seed)
    cost = 1e6 * seconds / max(detection.processed, 1)
    width = None if detection.width is None else _finite(_mean(detection.width))
    if healthy:
        share = float(detection.alarm.mean())
        return ComparedRun(*identity, None, None, bool(detection.alarm.any()), share, None, None, None, cost, width)
    found = detection_indices(log.time, detection.alarm, condition.fault_time)
    Ts = float(log.time[1] - log.time[0])
    first = round((condition.fault_time - float(log.time[0])) / Ts)
    alarmed = _begins_from(np.where(detection.alarm, 0, NOBODY), first)
    named, naming = None, None
    if detection.isolated is not None:
        naming = _begins_from(detection.isolated, first)
        named = None if naming is None else detector.faults[detection.isolated[naming]]
    return ComparedRun(
        *identity,
        first_alarm_s=judge_alarm(alarmed, first, Ts).delay,
        delay_s=judge_alarm(_last_switch(detection.alarm), first, Ts).delay,
        false_alarm=found.false_alarm,
        false_detection_rate=_finite(found.false_detection_rate),
        non_detection_rate=found.non_detection_rate,
        isolated_as=named,
        isolation_delay_s=judge_alarm(naming, first, Ts).delay if named == condition.fault else None,
        microseconds_per_sample=cost,
        width=width,
    )


def _begins_from(said: NDArray[np.intp], first_faulty: int) -> int | None:
    """The first sample from the fault on at which something begins to be said (K,).

    Something begins where the sample before says something else, or nothing.
    """
    begins = (said != NOBODY) & (said != np.append(NOBODY, said[:-1]))
    begins[:first_faulty] = False
    return first_true(begins)


def _last_switch(alarm: NDArray[np.bool_]) -> int | None:
    """The sample at which an alarm (K,) that stands at the end began; None if none stands there."""
    return int(np.flatnonzero(np.append(True, ~alarm))[-1]) if alarm[-1] else None


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _mean(width: Any) -> float:
    return float(np.nanmean(width)) if np.isfinite(width).any() else np.nan
