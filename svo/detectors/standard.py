"""The detectors that a user would take instead of set-valued observers, tuned as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import Shown
from svo.baselines.kalman import InnovationFilter
from svo.baselines.linear_gaussian import GaussianModel, GaussianSamples, fault_effect
from svo.baselines.multiple_model import MultipleModelFilter
from svo.baselines.parity import ParitySpace
from svo.checks import Array
from svo.detectors.detector import NOBODY, Detection, Parameter, Setting
from svo.detectors.threshold import ThresholdDetector
from svo.logs.log import Log
from svo.residual_tests.interface import above, row_sums

PROCESS_NOISE = Parameter(1e-2, 1e2, logarithmic=True)
WINDOW = Parameter(1, 40, integer=True, logarithmic=True)
CONFIDENT = 0.95  # share of the faults' probability that isolates one of them


@dataclass(frozen=True)
class Evaluated(Shown):
    """A log along the fault-free model, and along that of each fault at one size."""

    nominal: GaussianSamples
    faulty: tuple[GaussianSamples, ...] = ()


@dataclass(frozen=True)
class KalmanChiSquare(ThresholdDetector):
    """Kalman filter, and the chi-square statistic of its last innovations; it only detects."""

    model: GaussianModel
    name = "Kalman, chi-square"
    parameters = MappingProxyType({"process_noise": PROCESS_NOISE, "samples": WINDOW})

    def prepare(self, log: Log) -> Evaluated:
        return Evaluated(self.model.samples(log))

    def scores(self, setting: Setting, prepared: Evaluated) -> Array:
        filter_ = InnovationFilter(self.model, process_noise=setting.parameters["process_noise"])
        return window_sums(filter_.over(prepared.nominal).squares, setting.parameters["samples"])


@dataclass(frozen=True)
class StatedFaults(ThresholdDetector):
    """What the detectors share that know the plant with each fault at one size."""

    model: GaussianModel
    stated: Mapping[str, GaussianModel]

    @property
    def faults(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(self.stated)

    def prepare(self, log: Log) -> Evaluated:
        return Evaluated(self.model.samples(log), tuple(model.samples(log) for model in self.stated.values()))


class MultipleModels(StatedFaults):
    """Interacting multiple models; the score is the log odds of a fault, the isolated fault the one that has 95 %."""

    name = "Kalman bank, IMM"
    parameters = MappingProxyType(
        {"process_noise": PROCESS_NOISE, "switching": Parameter(1e-6, 1e-2, logarithmic=True)}
    )

    def scores(self, setting: Setting, prepared: Evaluated) -> Array:
        return self._filter(setting).over([prepared.nominal, *prepared.faulty]).log_odds

    def run(self, setting: Setting, prepared: Evaluated, isolate: bool = True) -> Detection:
        found = self._filter(setting).over([prepared.nominal, *prepared.faulty])
        alarm, faults = above(found.log_odds, setting.level), found.posterior[:, 1:]
        total = faults.sum(axis=1)
        sure = alarm & (total > 0) & (faults.max(axis=1) >= CONFIDENT * total)
        return Detection(alarm, np.where(sure, np.argmax(faults, axis=1), NOBODY) if isolate else None)

    def _filter(self, setting: Setting) -> MultipleModelFilter:
        models = {"nominal": self.model, **self.stated}
        return MultipleModelFilter(
            models, switching=setting.parameters["switching"], process_noise=setting.parameters["process_noise"]
        )


class ParityTest(StatedFaults):
    """Parity space; a fault is isolated if it alone brings the parity vector below the threshold."""

    name = "parity space"
    parameters = MappingProxyType({"order": Parameter(1, 6, integer=True)})

    def scores(self, setting: Setting, prepared: Evaluated) -> Array:
        return self._space(setting).over(prepared.nominal).squares

    def run(self, setting: Setting, prepared: Evaluated, isolate: bool = True) -> Detection:
        if not isolate:
            return super().run(setting, prepared)
        states = InnovationFilter(self.model).over(prepared.nominal).states
        effects = [fault_effect(prepared.nominal, faulty, states) for faulty in prepared.faulty]
        found = self._space(setting).over(prepared.nominal, effects)
        alarm = above(found.squares, setting.level)
        return Detection(alarm, the_only_explanation(found.unexplained, setting.level, alarm))

    def _space(self, setting: Setting) -> ParitySpace:
        return ParitySpace(self.model, order=int(setting.parameters["order"]))


class UnknownInputBank(StatedFaults):
    """One unknown-input observer a fault, blind to it; a fault is isolated if its observer alone stays quiet.

    Detection is by the observer without unknown inputs, the Kalman filter.
    """

    name = "unknown-input bank"
    parameters = MappingProxyType({"process_noise": PROCESS_NOISE, "samples": WINDOW})

    def scores(self, setting: Setting, prepared: Evaluated) -> Array:
        return window_sums(self._filter(setting).over(prepared.nominal).squares, setting.parameters["samples"])

    def run(self, setting: Setting, prepared: Evaluated, isolate: bool = True) -> Detection:
        filter_, samples = self._filter(setting), setting.parameters["samples"]
        found = filter_.over(prepared.nominal)
        alarm = above(window_sums(found.squares, samples), setting.level)
        if not isolate:
            return Detection(alarm)
        sums = []
        for faulty in prepared.faulty:
            unknown = _unknown_inputs(*fault_effect(prepared.nominal, faulty, found.states))
            sums.append(window_sums(filter_.over(prepared.nominal, *unknown).squares, samples))
        return Detection(alarm, the_only_explanation(np.array(sums).T, setting.level, alarm))

    def _filter(self, setting: Setting) -> InnovationFilter:
        return InnovationFilter(self.model, process_noise=setting.parameters["process_noise"])


def the_only_explanation(scores: Array, level: float, alarm: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The fault whose score (K, n_faults) alone is not above the level at a sample with an alarm, -1 if not one."""
    explains = scores <= level
    return np.where(alarm & (explains.sum(axis=1) == 1), np.argmax(explains, axis=1), NOBODY)


def window_sums(squares: Array, samples: float) -> Array:
    """Sums of the last so many values (K,); NaN while there are too few."""
    count = int(samples)
    sums = np.full(squares.size, np.nan)
    if squares.size >= count:
        # Not as differences of running totals: after one huge value these have lost all the small ones.
        sums[count - 1 :] = row_sums(np.lib.stride_tricks.sliding_window_view(squares, count))
    return sums


def _unknown_inputs(state: Array, output: Array) -> tuple[Array, Array]:
    """Directions (K, n, nd), (K, ny, nd) of a fault; each of its two ways in, if it has it, is one unknown input."""
    ways = [effect for effect in (state, output) if np.any(effect)]
    E = np.zeros((*state.shape, len(ways)))
    D = np.zeros((*output.shape, len(ways)))
    for column, effect in enumerate(ways):
        target = E if effect is state else D
        target[:, :, column] = _unit(effect)
    return E, D


def _unit(effect: Array) -> Array:
    size = np.linalg.norm(effect, axis=1, keepdims=True)
    return np.asarray(effect / np.where(size > 0, size, 1.0))


def standard_detectors(model: GaussianModel, stated: Mapping[str, GaussianModel]) -> list[ThresholdDetector]:
    """All of this file for one plant.

    Parameters
    ----------
    model : GaussianModel
        The plant without a fault.
    stated : mapping of str to GaussianModel
        The plant with each fault at one size.
    """
    return [
        KalmanChiSquare(model),
        MultipleModels(model, stated),
        ParityTest(model, stated),
        UnknownInputBank(model, stated),
    ]
