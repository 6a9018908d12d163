"""Performance indices of detection and of isolation (Marzat et al. 2012, section 2.4 and Figure 2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, expect_shape, real_array

__all__ = ["DetectionIndices", "FirstAlarm", "detection_indices", "first_true", "isolation_indices", "judge_alarm"]


@dataclass(frozen=True)
class DetectionIndices(Shown):
    """How well a Boolean decision told of a fault.

    Attributes
    ----------
    delay : float
        Seconds from the fault to the LAST switch from false to true, the first faulty sample counting as
        one sampling time: a switch at that very sample has delay Ts. Infinite if the decision is false at
        the last sample of the window. Not positive if an alarm from before the fault lasted to the end;
        `false_alarm` is then set, and such a delay is no merit.
    first_alarm : float
        The same count to the first sample, from the fault on, at which the decision is true; infinite if
        there is none. It differs from ``delay`` where the decision dropped out in between.
    false_alarm : bool
        Whether the decision was true at any sample before the fault.
    false_detection_rate : float
        Share of the time before the fault in which the decision was true; NaN without such time.
    non_detection_rate : float
        Share of the time from the fault on in which the decision was false.
    """

    delay: float
    first_alarm: float
    false_alarm: bool
    false_detection_rate: float
    non_detection_rate: float


@dataclass(frozen=True)
class FirstAlarm(Shown):
    """What the first alarm of a run tells of a fault: the one count of delays, in whole samples.

    Attributes
    ----------
    delay : float or None
        Seconds, the first faulty sample counting as one sampling time: an alarm at that very sample has delay Ts.
        None without an alarm, or if it came before the fault: that is no detection, whatever is said later.
    false_alarm : bool
        Whether it came before the fault.
    """

    delay: float | None
    false_alarm: bool


def judge_alarm(alarm: int | None, first_faulty: int, Ts: float) -> FirstAlarm:
    """Count the delay of a run's first alarm; for isolation, of the sample at which the fault that is there is named.

    Parameters
    ----------
    alarm : int or None
        Its sample; None if there is none.
    first_faulty : int
        First sample at which the fault acts; the number of samples in a run without a fault.
    Ts : float
        Sampling time [s].
    """
    if alarm is None or alarm < first_faulty:
        return FirstAlarm(None, alarm is not None)
    return FirstAlarm(round((alarm - first_faulty + 1) * Ts, 12), False)  # rounded: no digits of Ts show in a count


def first_true(decision: NDArray[np.bool_]) -> int | None:
    """First sample at which a decision (K,) is true; None if there is none."""
    return int(np.argmax(decision)) if decision.any() else None


@options_by_name
def detection_indices(
    time: ArrayLike,
    decision: ArrayLike,
    t_from: float,
    *,
    t_on: float | None = None,
    t_hor: float | None = None,
) -> DetectionIndices:
    """Indices of one decision over one run; for isolation, pass the decision "this fault is isolated".

    A sample's decision holds until the next sample; the last one for as long as the one before. What
    happens outside the window from ``t_on`` to ``t_hor`` is not looked at: a decision that is true at
    the first sample of the window counts as a switch there.

    Parameters
    ----------
    time : (K,) array
        Sample times [s], strictly increasing, at least two.
    decision : (K,) array of bool
    t_from : float
        Time of the first faulty sample [s].
    t_on : float, optional
        Start of the window [s]; the first sample by default.
    t_hor : float, optional
        End of the window [s], not included; by default one sampling time after the last sample.

    Raises
    ------
    ValueError
        If shapes or times do not fit, or if not t_on <= t_from < t_hor, with samples on and after t_from.
    """
    times, alarm = _checked(time, decision)
    edges = np.append(times, 2 * times[-1] - times[-2])
    start = float(times[0]) if t_on is None else float(t_on)
    end = float(edges[-1]) if t_hor is None else float(t_hor)
    if not start <= t_from < end:
        raise ValueError(f"t_from is {t_from} with a window from {start} to {end}; expected t_on <= t_from < t_hor")
    # A fault time written as 0.57 means sample 57, although 57 * 0.01 differs from it in the last digit.
    slack = 1e-6 * float(np.min(np.diff(times)))
    first, fault, last = (int(np.searchsorted(times, t - slack)) for t in (start, t_from, end))
    if fault >= last:
        raise ValueError(f"t_from is {t_from} but no sample of the window is on or after it")
    # Delays are counted to the end of the sample's hold, so the first faulty sample counts as one Ts.
    ends, durations = edges[1:] - times[fault], np.diff(edges)
    before, after = slice(first, fault), slice(fault, last)
    switches = first + np.flatnonzero(np.diff(alarm[first:last].astype(int), prepend=0) == 1)
    hits = np.flatnonzero(alarm[after])
    return DetectionIndices(
        delay=float(ends[switches[-1]]) if alarm[last - 1] else np.inf,
        first_alarm=float(ends[fault + hits[0]]) if hits.size else np.inf,
        false_alarm=bool(alarm[before].any()),
        false_detection_rate=_share(durations[before], alarm[before]),
        non_detection_rate=_share(durations[after], ~alarm[after]),
    )


@options_by_name
def isolation_indices(
    time: ArrayLike,
    isolated: Sequence[str | None],
    faults: Sequence[str],
    t_from: float,
    *,
    t_on: float | None = None,
    t_hor: float | None = None,
) -> dict[str, DetectionIndices]:
    """The indices of each decision "this fault is isolated", by fault.

    With the fault that is there they tell of its isolation; with another one every number but an infinite delay is
    that of a wrong isolation: its first, and 1 - non_detection_rate the share of the time that it stood.

    Parameters
    ----------
    time : (K,) array
        As for `detection_indices`, and so are t_from, t_on and t_hor.
    isolated : sequence of K str or None
        The fault that is isolated at each sample, None where none is.
    faults : sequence of str
        All faults that may be isolated.

    Raises
    ------
    ValueError
        If the times do not fit, or a fault is isolated that is not among the faults.
    """
    names = np.array([None, *isolated], dtype=object)[1:]
    unknown = sorted({str(name) for name in names if name is not None and name not in faults})
    if unknown:
        raise ValueError(f"isolated names {', '.join(unknown)}; expected None or one of {', '.join(faults)}")
    return {
        fault: detection_indices(
            time, np.array([name == fault for name in names], dtype=bool), t_from, t_on=t_on, t_hor=t_hor
        )
        for fault in faults
    }


def _share(durations: Array, true: NDArray[np.bool_]) -> float:
    return float(durations[true].sum() / durations.sum()) if durations.size else np.nan


def _checked(time: ArrayLike, decision: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    times, alarm = real_array("time", time, finite=False, missing=True), _flags(decision)
    expect_shape(times.ndim == 1 and times.size >= 2, "time", times, "(K,) with at least two samples")
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise ValueError("time is not strictly increasing; expected finite, increasing seconds")
    if alarm.shape != times.shape or alarm.dtype != np.bool_:
        raise ValueError(f"decision has shape {alarm.shape} and type {alarm.dtype}; expected {times.shape} of bool")
    return times, alarm


def _flags(decision: ArrayLike) -> NDArray[Any]:
    """An array whose type and shape have not been looked at; a masked entry is no decision."""
    if np.ma.is_masked(decision):
        raise ValueError("decision has masked entries; expected True or False at each time. Fill or remove them")
    return np.asarray(decision)
