"""The two detectors of the servo study: learnt on one healthy log, run on another, healthy and with injected faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from benchmarks._servo_records import Ts
from polytopes import HPolytope
from svo.interval import (
    GainBounds,
    IntervalDetector,
    IntervalPredictor,
    NoiseCharacterization,
    first_order_model,
    first_order_schedule,
)
from svo.interval.identification import FirstOrderFit, identify_first_order
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.observers.window.observer import WindowObserver

SAFETY = 1.2
QBAR = 200
START_RADIUS = 2e-4  # of the first state about the first measurement [m]
PATIENCE_S = 2.0  # a fault that is not found within it is missed

Fault = Callable[[Log, int], Log]


@dataclass(frozen=True)
class Outcome:
    """What a detector does on a healthy log, and how long it takes for each fault.

    Attributes
    ----------
    alarm_share : float
        Fraction of the healthy samples in alarm; for a set-valued observer, which starts again after each, the
        number of falsifications per sample.
    delays : mapping of fault to (n_instants,) array
        Seconds from the first faulty sample to the first alarm that the healthy run does not have there, plus one
        sampling time; Inf if there is none in the time given.
    microseconds : float
        Per sample, on the healthy log: the quickest of five runs of the interval detector, and the median over the
        observer's samples.
    """

    alarm_share: float
    delays: dict[str, NDArray[np.float64]]
    microseconds: float


def learn(records: Log) -> tuple[FirstOrderFit, NoiseCharacterization]:
    """Bounds of g and h, and the noise left by them, from one healthy log."""
    fit = identify_first_order(records)
    fit = replace(fit, gains=gains_of_parts(fit))
    residual = predictor(fit, records).predict(records).residual
    return fit, NoiseCharacterization.from_records(residual, QBAR, safety_factor=SAFETY)


def gains_of_parts(fit: FirstOrderFit) -> GainBounds:
    """Bounds that reach the fits of the parts and no further: what happens from sample to sample is learnt as noise."""
    radii = np.abs(fit.parts - [fit.gains.gc, fit.gains.hc]).max(axis=0, initial=0.0)
    return GainBounds(fit.gains.gc, float(radii[0]), hc=fit.gains.hc, hr=float(radii[1]))


def predictor(fit: FirstOrderFit, log: Log) -> IntervalPredictor:
    """A predictor that starts at the log's first measurement."""
    return IntervalPredictor(fit.gains, (float(log.y[0, 0]), START_RADIUS))


# -- the interval detector ---------------------------------------------------------------------------------------


def run_interval(
    detector: IntervalDetector, healthy: Log, faults: Mapping[str, Fault], instants: Sequence[int]
) -> Outcome:
    """Alarms on a healthy log, and delays of faults injected into it at each of the instants (samples)."""
    detector.warm_up()
    calm, seconds = detector.run(healthy).exceeded, min(_seconds_of(detector, healthy) for _ in range(5))
    delays = {
        name: np.array([_first(detector.run(fault(healthy, k)).exceeded & ~calm, k) for k in instants])
        for name, fault in faults.items()
    }
    return Outcome(float(calm.mean()), delays, 1e6 * seconds / len(healthy))


def _seconds_of(detector: IntervalDetector, log: Log) -> float:
    begun = perf_counter()
    detector.run(log)
    return perf_counter() - begun


def _first(alarm: NDArray[np.bool_], instant: int) -> float:
    hits = np.flatnonzero(alarm[instant : instant + round(PATIENCE_S / Ts)])
    return float((hits[0] + 1) * Ts) if hits.size else np.inf


# -- the set-valued observer -------------------------------------------------------------------------------------


def smallest_noise(fit: FirstOrderFit, healthy: Log, horizon: int) -> float:
    """The smallest half-width of the noise, within 1 %, with which the observer explains a healthy log."""
    log = first_order_schedule(predictor(fit, healthy).predict(healthy))
    lower, upper = 0.0, 2.0 * fit.largest_error
    while upper - lower > 0.01 * upper:
        middle = 0.5 * (lower + upper)
        if _explains(_observer(middle, log, horizon), log):
            upper = middle
        else:
            lower = middle
    return upper


def run_observer(
    fit: FirstOrderFit, noise: float, horizon: int, healthy: Log, faults: Mapping[str, Fault], instants: Sequence[int]
) -> Outcome:
    """The same as `run_interval` for a set-valued observer; it starts again from a wide set after a falsification."""
    log = first_order_schedule(predictor(fit, healthy).predict(healthy))
    observer = _observer(noise, log, horizon)
    model, calm, at, seconds, answers = observer.model, set(), {}, [], drive(observer, log)
    for k in range(len(log)):
        if k in instants:
            at[k] = observer.state_dict()
        step = next(answers)
        seconds.append(step.seconds)
        if step.verdict == "falsified":
            calm.add(k)
            _start_again(observer, log, k)
    delays = {
        name: np.array([_delay(WindowObserver.from_state_dict(model, at[k]), log, fault, k, calm) for k in instants])
        for name, fault in faults.items()
    }
    return Outcome(len(calm) / len(log), delays, 1e6 * float(np.median(seconds)))


def _observer(noise: float, log: Log, horizon: int) -> WindowObserver:
    """An observer before its first sample."""
    observer = WindowObserver(first_order_model(noise, Ts), _near(log, 0, noise), horizon=horizon)
    observer.warm_up()
    return observer


def _near(log: Log, sample: int, noise: float) -> HPolytope:
    """States that explain the measurement at a sample, and some more."""
    centre, radius = float(log.y[sample, 0]), START_RADIUS + noise
    return HPolytope.box([centre - radius], [centre + radius])


def _start_again(observer: WindowObserver, log: Log, k: int) -> None:
    noise = float(observer.model.bounds(log.schedule_at(k))[2][0])
    observer.reset(_near(log, k, noise))
    observer.update(log.y[k], u=log.u[k], schedule=log.schedule_at(k))


def _explains(observer: WindowObserver, log: Log) -> bool:
    return all(step.verdict != "falsified" for step in drive(observer, log))


def _delay(observer: WindowObserver, log: Log, fault: Fault, instant: int, calm: set[int]) -> float:
    faulty = replace(fault(log, instant), schedule=log.schedule)
    answers = islice(drive(observer, faulty, start=instant), round(PATIENCE_S / Ts))
    for k, step in enumerate(answers, instant):
        if step.verdict == "falsified":
            if k not in calm:
                return (k - instant + 1) * Ts
            _start_again(observer, faulty, k)
    return np.inf
