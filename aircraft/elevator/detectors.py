"""The detectors that are compared on the elevator."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from aircraft.elevator.scenarios import TRAVEL
from polytopes import HPolytope
from svo.detectors.detector import Detector
from svo.detectors.interval import IntervalThreshold
from svo.detectors.window_bank import WindowBank
from svo.interval import IntervalPredictor, first_order_model

# Steps in the windows of the observers whose noise bound is tuned. With one state and gains that are free at each
# sample the past is summed up by one interval, so a longer window tells nothing more; two lengths show it.
HORIZONS = (1, 10)
STATED_SIGMAS = (3.0, 4.0, 5.0, 6.0)  # noise bounds that are kept as they are


@dataclass(frozen=True)
class StatedNoiseBound(WindowBank):
    """An observer with a noise bound of so many standard deviations."""

    sigmas: float = 1.0

    @property
    def name(self) -> str:
        return f"SVO N = {self.horizon}, noise {self.sigmas:g} σ"


def detectors(
    predictor: Callable[[float], IntervalPredictor], poles: Sequence[float], qbar: int, sigma: float, Ts: float
) -> list[Detector]:
    """The interval detector with each pole, and set-valued observers with several noise bounds and horizons.

    Parameters
    ----------
    predictor : function of the first command
    poles : sequence of float
        Of the residual filter.
    qbar : int
        Longest window of the noise characterisation.
    sigma : float
        Standard deviation of the sensor noise [rad].
    Ts : float
        Sampling time [s].
    """
    initial, directions = HPolytope.box(*([limit] for limit in TRAVEL)), [[1.0]]
    tuned = {"nominal": first_order_model(STATED_SIGMAS[0] * sigma, Ts)}
    return [
        *(IntervalThreshold(predictor, pole, qbar) for pole in poles),
        *(WindowBank(tuned, initial, horizon, width_of=directions) for horizon in HORIZONS),
        *(
            StatedNoiseBound(
                {"nominal": first_order_model(k * sigma, Ts)}, initial, 1, stated=True, width_of=directions, sigmas=k
            )
            for k in STATED_SIGMAS
        ),
    ]
