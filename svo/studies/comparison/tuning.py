"""The one optimiser that tunes every detector to an equal false-alarm rate and the least delay.

Marzat et al. 2012, section 6.3, ask for it.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import direct

from svo.checks import expect
from svo.detectors.detector import Detector, Setting
from svo.indices import first_true, judge_alarm


@dataclass(frozen=True)
class FaultyRun:
    """A prepared training log of one scenario, with the first faulty sample."""

    scenario: str
    prepared: Any
    first_faulty: int


@dataclass(frozen=True)
class Tuned:
    """The setting that was found, and what it cost on the training runs.

    Attributes
    ----------
    setting : Setting
    cost : float
        `detection_cost` on the training runs; NaN for a detector whose setting is fixed, which has none.
    evaluations : int
        Settings that were tried.
    """

    setting: Setting
    cost: float
    evaluations: int


def tune(
    detector: Detector,
    healthy: Sequence[Any],
    faulty: Sequence[FaultyRun],
    calibration: Sequence[Any],
    rate: float,
    evaluations: int,
) -> Tuned:
    """The inner parameters of least cost, and then the level that gives the false-alarm rate on other runs.

    The optimiser is DIRECT (Jones et al. 1993): global, without derivatives, and deterministic. It compares
    parameters at levels from the same fault-free runs that they are chosen by, which favours parameters that were
    lucky there; so the level is set anew on runs that had no part in the choice.

    Parameters
    ----------
    healthy : sequence of prepared fault-free logs
        To learn from and to compare inner parameters.
    faulty : sequence of FaultyRun
    calibration : sequence of prepared fault-free logs
        To set the level; gone through once.
    rate : float
        Expected share of fault-free runs that raise an alarm, in [0, 1).
    evaluations : int
        Settings to try, at least one; detectors without inner parameters need none.

    Raises
    ------
    ValueError
        If the rate or the number of evaluations is out of range, or there are no runs.
    """
    expect(0 <= rate < 1, "rate", rate, "a share of runs in [0, 1)")
    expect(evaluations >= 1, "evaluations", evaluations, "at least one")
    if not healthy or not faulty or not calibration:
        counts = f"{len(healthy)} fault-free, {len(faulty)} faulty and {len(calibration)} calibration runs"
        raise ValueError(f"there are {counts}; expected some of each")
    if detector.fixed is not None:
        return Tuned(detector.fixed, np.nan, 0)
    parameters, tried = _search(detector, healthy, faulty, rate, evaluations)
    setting = Setting(np.inf, parameters, detector.learn(parameters, healthy))
    setting = replace(setting, level=level_at(detector, setting, calibration, rate))
    return Tuned(setting, detection_cost(detector, setting, faulty), tried)


def _search(
    detector: Detector, healthy: Sequence[Any], faulty: Sequence[FaultyRun], rate: float, evaluations: int
) -> tuple[dict[str, float], int]:
    """Inner parameters of least cost, and how many settings were tried."""
    names = tuple(detector.parameters)
    if not names:
        return {}, 0
    tried: dict[tuple[float, ...], float] = {}

    def cost(fractions: NDArray[np.float64]) -> float:
        values = tuple(detector.parameters[n].at(float(f)) for n, f in zip(names, fractions, strict=True))
        if values not in tried:  # whole numbers: many fractions are one setting
            parameters = dict(zip(names, values, strict=True))
            setting = Setting(np.inf, parameters, detector.learn(parameters, healthy))
            setting = replace(setting, level=level_at(detector, setting, healthy, rate))
            tried[values] = detection_cost(detector, setting, faulty)
        return tried[values]

    direct(cost, [(0.0, 1.0)] * len(names), maxfun=evaluations, eps=1e-3, locally_biased=False)
    best = min(tried, key=lambda values: tried[values])
    return dict(zip(names, best, strict=True)), len(tried)


def level_at(detector: Detector, setting: Setting, healthy: Sequence[Any], rate: float) -> float:
    """The level at which the expected share of other fault-free runs with an alarm is the rate, or just below.

    It is the j-th largest of the critical levels of n runs; a new run exceeds that with probability j / (n + 1), so
    j = floor(rate (n + 1)). With fewer than 1 / rate - 1 runs it is the largest, and the rate 1 / (n + 1).
    """
    wanted = max(int(np.floor(rate * (len(healthy) + 1) + 1e-9)), 1)
    largest: list[float] = []  # the wanted largest critical levels so far; the least of them is the floor of the next
    for prepared in healthy:
        if len(largest) < wanted:
            heapq.heappush(largest, detector.critical_level(setting, prepared, 0.0))
        else:
            heapq.heappushpop(largest, detector.critical_level(setting, prepared, largest[0]))
    return largest[0]


def detection_cost(detector: Detector, setting: Setting, faulty: Sequence[FaultyRun]) -> float:
    """Mean over scenarios of the mean ln(samples to the first alarm); a miss counts as the length of the run.

    What is before the fault is not looked at: the level sees to false alarms.

    By the logarithm, so that being twice as slow costs the same in a scenario of milliseconds and of seconds.
    """
    logs: dict[str, list[float]] = {}
    for run in faulty:
        alarm = detector.run(setting, run.prepared, isolate=False).alarm[run.first_faulty :]
        samples = judge_alarm(first_true(alarm), 0, 1.0).delay or alarm.size
        logs.setdefault(run.scenario, []).append(float(np.log(samples)))
    return float(np.mean([np.mean(values) for values in logs.values()]))
