"""The detectors that are compared on the Eclipse."""

from __future__ import annotations

from collections.abc import Mapping

from polytopes import HPolytope
from svo.baselines import GaussianModel
from svo.detectors.detector import Detector
from svo.detectors.residuals import residual_test_detectors
from svo.detectors.standard import standard_detectors
from svo.detectors.window_bank import WindowBank
from svo.models import UncertainModel

HORIZONS = (5, 20)  # steps in the windows of the set-valued observers whose bounds are scaled
STATED_HORIZON = 10  # the bank of the studies, with its bounds as they are


def detectors(
    models: Mapping[str, UncertainModel], stated: Mapping[str, UncertainModel], initial: HPolytope
) -> list[Detector]:
    """Set-valued observers with stated and with scaled bounds, and what a user would pick instead.

    Parameters
    ----------
    models : mapping of str to UncertainModel
        "nominal" and the observers' model of each fault, which contains the nominal one.
    stated : mapping of str to UncertainModel
        The aircraft with each fault at one size.
    initial : HPolytope
        Set of the state at the first sample.
    """
    nominal = GaussianModel(models["nominal"], initial)
    faulty = {name: GaussianModel(model, initial) for name, model in stated.items()}
    return [
        WindowBank(models, initial, STATED_HORIZON, stated=True),
        *(WindowBank(models, initial, horizon) for horizon in HORIZONS),
        *standard_detectors(nominal, faulty),
        *residual_test_detectors(nominal),
    ]
