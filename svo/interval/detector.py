"""The interval detector: prediction, dead zone, filter and threshold (paper 001, section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, isnan, nan
from time import perf_counter
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, expect, expect_kind, expect_shape, real_array
from svo.interval.noise import NoiseCharacterization
from svo.interval.predictor import Interval, IntervalPrediction, IntervalPredictor
from svo.interval.residual import check_pole, first_order_filter
from svo.logs.log import Log

ThresholdVerdict = Literal["consistent", "exceeded"]
"""Of a statistical test. "exceeded" is an alarm, but no proof that the model is wrong: it rests on a noise that keeps
to what was learnt (7). It is never "falsified", carries no certificate, and no isolation bank takes it for one."""


@dataclass(frozen=True, slots=True)
class IntervalStep(Shown):
    """Answer of an `IntervalDetector` at one sample.

    Attributes
    ----------
    sample : int
        Counted from the first measurement, which is sample 0.
    verdict : {"consistent", "exceeded"}
        "exceeded" if the filtered residual is beyond its threshold; see `ThresholdVerdict`.
    interval : Interval
        Prediction of the state. It does not use the measurement.
    residual, filtered, threshold : float
        r (18), its filtered value, and the threshold of that. The residual is NaN where the measurement is missing;
        the other two, and the verdict, then stay as they were (NaN before the first measurement).
    seconds : float
        Wall time of the call.
    """

    sample: int
    verdict: ThresholdVerdict
    interval: Interval
    residual: float
    filtered: float
    threshold: float
    seconds: float

    @property
    def exceeded(self) -> bool:
        """Whether the threshold is crossed."""
        return self.verdict == "exceeded"

    @property
    def box(self) -> tuple[Array, Array]:
        """The interval as (lower, upper), each (1,)."""
        return np.array([self.interval.lower]), np.array([self.interval.upper])

    @property
    def set(self) -> HPolytope:
        """The interval as a polytope."""
        return HPolytope.box(*self.box)


@dataclass(frozen=True, eq=False)
class IntervalRecord(Shown):
    """A detector's run over a log of K samples.

    Attributes
    ----------
    prediction : IntervalPrediction
    residual, filtered, threshold : (K,) arrays
        As in `IntervalStep`.
    exceeded : (K,) array of bool
        Where the filtered residual is beyond its threshold: the Boolean decision of `svo.indices`.
    """

    prediction: IntervalPrediction
    residual: Array
    filtered: Array
    threshold: Array
    exceeded: NDArray[np.bool_]

    @property
    def verdicts(self) -> tuple[ThresholdVerdict, ...]:
        """The verdict at each sample."""
        return tuple("exceeded" if e else "consistent" for e in self.exceeded)

    @property
    def first_alarm(self) -> int | None:
        """First sample beyond the threshold; None if there is none."""
        hits = np.flatnonzero(self.exceeded)
        return int(hits[0]) if hits.size else None

    def first_alarm_from(self, time: float) -> float | None:
        """Time [s] of the first sample at or after a time that is beyond the threshold; None if there is none."""
        times = self.prediction.time
        hits = np.flatnonzero(self.exceeded & (times >= time - 1e-9))
        return float(times[hits[0]]) if hits.size else None


class IntervalDetector(Shown):
    """Detects when the filtered dead-zone residual leaves the band that the characterised noise allows.

    Parameters
    ----------
    predictor : IntervalPredictor
        It belongs to the detector from now on.
    noise : NoiseCharacterization
        Of fault-free residuals, ``predictor.predict(log).residual``. It need not be made again for another pole.
    pole : float
        a of the residual filter e+ = a e + (1 - a) r, 0 <= a < 1: near one for small slow faults, small for fast ones.

    Notes
    -----
    Guarantee: no alarm while the plant keeps to the bounds of g and h and the residual to the characterisation (7).
    """

    def __init__(self, predictor: IntervalPredictor, noise: NoiseCharacterization, pole: float) -> None:
        expect_kind("predictor", predictor, IntervalPredictor, "an IntervalPredictor")
        expect_kind("noise", noise, NoiseCharacterization, "a NoiseCharacterization")
        check_pole(pole)
        self.predictor, self.noise, self.pole = predictor, noise, float(pole)
        self._thresholds = noise.thresholds(pole)
        self._tau: list[float] = self._thresholds.tolist()
        self._started = False
        self._forget()

    def reset(self, center: float, radius: float) -> None:
        """Forget all data; the state at the next measurement is in center +- radius."""
        self.predictor.reset(center, radius)
        self._forget()

    def update(self, y0: ArrayLike, u: ArrayLike | None = None, schedule: Any = None) -> IntervalStep:
        """The first measurement, without a transition.

        Parameters
        ----------
        y0 : float or (1,) array
            NaN = missing.
        u
            Not used; there for the observers' protocol.
        schedule : optional
            Scheduling value at this sample.
        """
        begun = perf_counter()
        if self._started:
            raise ValueError("update was called after the first sample; use step(u=..., y=...), or reset first")
        measured = _number("y", y0, missing=True)
        self._started = True
        return self._judge(measured, schedule, begun)

    def step(
        self,
        u: ArrayLike,
        y: ArrayLike,
        u_next: ArrayLike | None = None,
        schedule: Any = None,
        deadline: float | None = None,
    ) -> IntervalStep:
        """One transition x(k) -> x(k+1) driven by u, then the measurement y at k + 1.

        Parameters
        ----------
        u, y : float or (1,) array
            y may be NaN (missing).
        u_next, deadline
            Not used; there for the observers' protocol.
        schedule : optional
            Scheduling value at the sample of y; it also chooses the bounds of the next transition.

        Raises
        ------
        ValueError
            For values that are no finite numbers, or bounds that break (17). The detector is unchanged.
        """
        begun = perf_counter()
        measured = _number("y", y, missing=True)
        if not self._started:
            if schedule is not None:
                raise ValueError(
                    "step was called before update with a schedule: the first transition needs that of the first "
                    "sample; call update(y0=..., schedule=...) first, with NaN if nothing is measured"
                )
            self.update(nan)
        self.predictor.step(_number("u", u), self._held, self._schedule)
        return self._judge(measured, schedule, begun)

    @options_by_name
    def run(self, log: Log, *, initial: tuple[float, float] | None = None) -> IntervalRecord:
        """All samples of a log with one input and one output, in one call of the core; the online state is left alone.

        The answers are those of `update` and `step` on a fresh detector.

        Parameters
        ----------
        log : Log
        initial : (center, radius), optional
            Interval of the state at the log's first sample; that of the predictor by default.
        """
        prediction = self.predictor.predict(log, initial=initial)
        residual = prediction.residual
        filtered = first_order_filter(residual, self.pole)
        counted = np.cumsum(~np.isnan(residual)) - 1
        threshold = self._thresholds[np.clip(counted, 0, self.noise.qbar)]
        threshold[counted < 0] = np.nan
        return IntervalRecord(prediction, residual, filtered, threshold, np.abs(filtered) > threshold)

    def warm_up(self) -> float:
        """As of an observer: seconds, here none, since nothing is loaded late."""
        return 0.0

    # -- inside ----------------------------------------------------------------------------------

    def _forget(self) -> None:
        self._started = False
        self._held = self.predictor.interval.center
        self._schedule: Any = None
        self._counted = -1  # measurements so far, less one
        self._filtered = self._threshold = nan

    def _judge(self, y: float, schedule: Any, begun: float) -> IntervalStep:
        interval = self.predictor.interval
        residual = nan
        if not isnan(y):
            residual = y - min(max(y, interval.lower), interval.upper)
            self._counted += 1
            first = self._counted == 0
            self._filtered = residual if first else self.pole * self._filtered + (1 - self.pole) * residual
            self._threshold = self._tau[min(self._counted, len(self._tau) - 1)]
            self._held = y
        self._schedule = schedule
        verdict: ThresholdVerdict = "exceeded" if abs(self._filtered) > self._threshold else "consistent"
        return IntervalStep(
            self.predictor.sample, verdict, interval, residual, self._filtered, self._threshold, perf_counter() - begun
        )


def _number(name: str, value: Any, missing: bool = False) -> float:
    """One finite number; NaN too, where it may be missing."""
    if not isinstance(value, float):
        array = real_array(name, value, finite=False, missing=missing)
        expect_shape(array.size == 1, name, array, "one number")
        value = float(array.item())
    fits = isfinite(value) or (missing and isnan(value))
    expect(fits, name, value, "a finite number, or NaN if it is missing" if missing else "a finite number")
    return float(value)
