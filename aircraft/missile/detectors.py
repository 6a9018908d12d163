"""The detectors that are compared on the missile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from aircraft.missile.airframe import INPUTS, Airframe
from aircraft.missile.models import measurement_of
from aircraft.missile.redundancy import TABLE_1, moving_mean, residuals, signature_matrix
from polytopes import HPolytope
from svo.baselines import GaussianModel
from svo.checks import Array
from svo.detectors.detector import NOBODY, Detection, Detector, Parameter, Setting
from svo.detectors.residuals import residual_test_detectors
from svo.detectors.standard import standard_detectors
from svo.detectors.threshold import ThresholdDetector
from svo.detectors.window_bank import WindowBank
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.residual_tests.interface import above

HORIZONS = (5, 10)  # steps in the windows of the set-valued observers
STATED_HORIZON = 10  # the bank of the studies, with its bounds as they are
ACTUATORS = {"eta": "propulsion", "dm": "pitch_fin", "dn": "yaw_fin"}


@dataclass(frozen=True)
class Redundancy(ThresholdDetector):
    """The residuals of Table I: moving mean of each, in standard deviations of fault-free runs; the largest decides.

    A fault is isolated where its signature alone has all residuals above the level in it and all others not. It
    knows actuators only, so the accelerometer is not among its faults.
    """

    airframe: Airframe
    name = "control-induced redundancy"
    faults = tuple(ACTUATORS.values())
    parameters = MappingProxyType({"samples": Parameter(1, 40, integer=True, logarithmic=True)})

    def prepare(self, log: Log) -> Array:
        """Residuals (K, 12)."""
        if log.schedule is None:
            raise ValueError("log has no schedule; expected the measurements that the residuals need")
        return residuals(measurement_of(log.schedule), log.u[:, : len(INPUTS)], self.airframe).values

    def learn(self, parameters: Mapping[str, float], healthy: Sequence[Array]) -> dict[str, Array]:
        means = np.vstack([moving_mean(values, int(parameters["samples"])) for values in healthy])
        return {"mean": np.nanmean(means, axis=0), "sigma": np.nanstd(means, axis=0)}

    def scores(self, setting: Setting, prepared: Array) -> Array:
        return np.max(self._each(setting, prepared), axis=1)

    def run(self, setting: Setting, prepared: Array, isolate: bool = True) -> Detection:
        each = self._each(setting, prepared)
        alarm = above(np.max(each, axis=1), setting.level)
        signature = signature_matrix(self.airframe, TABLE_1)
        matches = np.column_stack(
            [((each > setting.level) == signature[:, INPUTS.index(j)]).all(axis=1) for j in ACTUATORS]
        )
        named = np.where(alarm & (matches.sum(axis=1) == 1), np.argmax(matches, axis=1), NOBODY)
        return Detection(alarm, named if isolate else None)

    def _each(self, setting: Setting, prepared: Array) -> Array:
        means = moving_mean(prepared, int(setting.parameters["samples"]))
        return np.asarray(np.abs(means - setting.learned["mean"]) / setting.learned["sigma"])


def detectors(
    models: Mapping[str, UncertainModel],
    nominal: UncertainModel,
    stated: Mapping[str, UncertainModel],
    initial: HPolytope,
    airframe: Airframe,
) -> list[Detector]:
    """Set-valued observers with stated and with scaled bounds, residuals by redundancy, and the usual ones.

    Parameters
    ----------
    models : mapping of str to UncertainModel
        The observers' models, "nominal" among them.
    nominal : UncertainModel
        The missile without a fault and without disturbances in the output, for the Gaussian methods.
    stated : mapping of str to UncertainModel
        The same with each fault at one size.
    initial : HPolytope
        Set of the state at the first sample.
    airframe : Airframe
    """
    gaussian = GaussianModel(nominal, initial)
    faulty = {name: GaussianModel(model, initial) for name, model in stated.items()}
    return [
        WindowBank(models, initial, STATED_HORIZON, stated=True),
        *(WindowBank(models, initial, horizon) for horizon in HORIZONS),
        Redundancy(airframe),
        *standard_detectors(gaussian, faulty),
        *residual_test_detectors(gaussian),
    ]
