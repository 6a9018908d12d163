"""Calibration of a plant's nominal model on a log file."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_CEILING, Decimal, localcontext
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.analysis.calibration import Calibration, calibrate
from svo.detection.detect import check_log
from svo.logs.log import Log
from svo.plant import MonitoredPlant
from svo.plant.dialects import on_log
from svo.plant.scheduling import scheduled


@dataclass(frozen=True)
class LogCalibration:
    """What is too narrow in a plant's nominal model, with the log's own times (K,) [s]."""

    plant: str
    noise: str
    time: NDArray[np.float64]
    result: Calibration

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "plant": self.plant,
            "noise": self.noise,
            "samples": len(self.time),
            "smallest": self.result.smallest,
            "chosen": list(self.result.chosen),
            "widenings": [
                {
                    "bound": w.bound,
                    "amount": w.amount,
                    "relative": w.relative if isfinite(w.relative) else None,
                    "sample": w.sample,
                    "time_s": float(self.time[w.sample]),
                }
                for w in self.result.widenings
            ],
        }

    def to_text(self) -> str:
        """For people: one line a bound."""
        samples = f"all {len(self.time)} samples ({self.noise} noise)"
        if not self.result.widenings:
            return f"Nothing to widen: the nominal model explains {samples}."
        kind = "The smallest" if self.result.smallest else "A sufficient"
        lines = [
            f"    {w.bound}: + {rounded_up(w.amount, 4)} ({_share(w.relative)}), "
            f"first needed at {self.time[w.sample]:.9g} s (sample {w.sample})"
            for w in self.result.widenings
        ]
        return "\n".join([f"{kind} widening with which the nominal model explains {samples}, in model units:", *lines])


def _share(relative: float) -> str:
    return f"{rounded_up(100 * relative, 3)} % of the bound" if isfinite(relative) else "the bound is zero"


def rounded_up(value: float, digits: int) -> str:
    """A positive number in so many digits, and no smaller than it: what is typed into a file must suffice."""
    exact = Decimal(value)
    with localcontext() as context:
        context.prec, context.rounding = digits, ROUND_CEILING
        return f"{(+exact).normalize():g}"


def calibrate_log(plant: MonitoredPlant, log: Log, noise: str) -> LogCalibration:
    """Calibrate the model of a bank's nominal observer; the plant's own scheduler makes the schedule from y.

    Raises as `svo.detection.detect.detect` and `svo.analysis.calibration.calibrate` do.
    """
    check_log(plant, log)
    nominal, log = on_log(plant, log).bank(noise).observers["nominal"], scheduled(plant.scheduler(), log)
    # Nothing measured yet, so this is the set that the observer starts from.
    start = nominal.update(np.full(log.y.shape[1], np.nan), u=log.u[0], schedule=log.schedule_at(0)).box
    result = calibrate(nominal.model, log, HPolytope.box(*start))
    return LogCalibration(plant.name, noise, log.time, result)
