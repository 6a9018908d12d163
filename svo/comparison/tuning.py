"""The one optimiser that tunes every detector to an equal false-alarm rate and the least delay.

Marzat et al. 2012, section 6.3, ask for it.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import direct

from svo.comparison.detector import Detector, Setting


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
        See `detection_cost`; NaN for a detector with a fixed setting.
    evaluations : int
        Settings that were tried.
    """

    setting: Setting
    cost: float
    evaluations: int


def tune(
    detector: Detector, healthy: Sequence[Any], faulty: Sequence[FaultyRun], rate: float, evaluations: int
) -> Tuned:
    """The inner parameters of least cost, each tried at the level that gives the false-alarm rate.

    The optimiser is DIRECT (Jones et al. 1993): global, without derivatives, and deterministic.

    Parameters
    ----------
    healthy : sequence of prepared fault-free logs
    faulty : sequence of FaultyRun
    rate : float
        Share of fault-free runs that may raise an alarm, in [0, 1).
    evaluations : int
        Settings to try, at least one; detectors without inner parameters need one.

    Raises
    ------
    ValueError
        If the rate or the number of evaluations is out of range, or there are no runs.
    """
    if not 0 <= rate < 1:
        raise ValueError(f"rate is {rate}; expected a share of runs in [0, 1)")
    if evaluations < 1:
        raise ValueError(f"evaluations is {evaluations}; expected at least one")
    if not healthy or not faulty:
        raise ValueError(f"there are {len(healthy)} fault-free and {len(faulty)} faulty runs; expected some of each")
    if detector.fixed is not None:
        return Tuned(detector.fixed, np.nan, 0)
    names = tuple(detector.parameters)
    tried: dict[tuple[float, ...], tuple[float, Setting]] = {}

    def cost(fractions: NDArray[np.float64]) -> float:
        values = tuple(detector.parameters[n].at(float(f)) for n, f in zip(names, fractions, strict=True))
        if values not in tried:  # whole numbers: many fractions are one setting
            setting = setting_at(detector, dict(zip(names, values, strict=True)), healthy, rate)
            tried[values] = (detection_cost(detector, setting, faulty), setting)
        return tried[values][0]

    cost(np.full(len(names), 0.5))
    if names:
        direct(cost, [(0.0, 1.0)] * len(names), maxfun=evaluations, eps=1e-3, locally_biased=False)
    least, setting = min(tried.values(), key=lambda pair: pair[0])
    return Tuned(setting, least, len(tried))


def setting_at(detector: Detector, parameters: Mapping[str, float], healthy: Sequence[Any], rate: float) -> Setting:
    """The setting with these inner parameters whose level lets at most floor(rate * runs) fault-free runs alarm."""
    blank = Setting(np.inf, parameters, detector.learn(parameters, healthy))
    allowed = int(np.floor(rate * len(healthy) + 1e-9))
    largest: list[float] = []  # the allowed + 1 largest critical levels so far; the least of them is the level
    for prepared in healthy:
        full = len(largest) > allowed
        floor = largest[0] if full else 0.0
        level = detector.critical_level(blank, prepared, floor)
        if not full:
            heapq.heappush(largest, level)
        elif level > floor:
            heapq.heapreplace(largest, level)
    return Setting(largest[0], blank.parameters, blank.learned)


def detection_cost(detector: Detector, setting: Setting, faulty: Sequence[FaultyRun]) -> float:
    """Mean over scenarios of the mean ln(samples to the first alarm); a miss counts as the length of the run.

    By the logarithm, so that being twice as slow costs the same in a scenario of milliseconds and of seconds.
    """
    logs: dict[str, list[float]] = {}
    for run in faulty:
        alarm = detector.run(setting, run.prepared, isolate=False).alarm[run.first_faulty :]
        samples = int(np.argmax(alarm)) + 1 if alarm.any() else alarm.size
        logs.setdefault(run.scenario, []).append(float(np.log(samples)))
    return float(np.mean([np.mean(values) for values in logs.values()]))
