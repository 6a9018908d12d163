"""A bank of window observers as a detector, with its bounds as stated or scaled to a false-alarm rate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from polytopes.shown import Shown
from svo.checks import Array, real_array
from svo.detectors.detector import NOBODY, Detection, Kind, Parameter, Setting
from svo.detectors.scaled_bounds import scaled_bounds
from svo.isolation import ArchitectureI
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.models.nonlinear import NonlinearModel
from svo.observers.window.observer import WindowObserver

NOMINAL = "nominal"
LARGEST_SCALE = 16.0
PRECISION = 0.02  # relative, of a critical scale


@dataclass(frozen=True)
class WindowBank(Shown):
    """Architecture I of window observers; its level is the factor on the bounds of noise and disturbances.

    At level 1 and above, within the stated bounds, an alarm is a proof. Below 1 it is no more than a
    crossed threshold: tuning to an equal false-alarm rate may ask for it.

    Parameters
    ----------
    models : mapping of str to UncertainModel or NonlinearModel
        "nominal" and one for each fault, which contains the nominal plant. Without faults it only detects.
    initial : HPolytope
        Bounded set of the state at the first sample.
    horizon : int or None
        Steps in the window.
    stated : bool
        Keep the bounds as they are, instead of scaling them.
    width_of : (m, n) array, optional
        Directions in which the nominal observer's set is measured at every sample; costs linear programs.
    """

    models: Mapping[str, UncertainModel | NonlinearModel]
    initial: HPolytope
    horizon: int | None = 10
    stated: bool = False
    width_of: ArrayLike | None = None
    kind: Kind = field(default="falsification", init=False)
    parameters: Mapping[str, Parameter] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        if NOMINAL not in self.models:
            raise ValueError(f"models has {', '.join(self.models) or 'nothing'}; expected one named {NOMINAL!r}")

    @property
    def name(self) -> str:
        length = "all data" if self.horizon is None else f"N = {self.horizon}"
        return f"SVO {length}, {'stated' if self.stated else 'scaled'} bounds"

    @property
    def faults(self) -> tuple[str, ...]:
        return tuple(name for name in self.models if name != NOMINAL)

    @property
    def fixed(self) -> Setting | None:
        return Setting(1.0) if self.stated else None

    def prepare(self, log: Log) -> Log:
        return log

    def learn(self, parameters: Mapping[str, float], healthy: Sequence[Any]) -> Mapping[str, Array]:
        return {}

    def critical_level(self, setting: Setting, prepared: Log, floor: float) -> float:
        """By bisection on a logarithmic scale; infinite if even the largest scale does not explain the log."""
        low = max(floor, 1.0 / LARGEST_SCALE)
        if not self._falsified(prepared, low):
            return max(floor, low)
        high = low
        while self._falsified(prepared, high := 2 * high):
            if high > LARGEST_SCALE:
                return np.inf
            low = high
        while high > low * (1 + PRECISION):
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if self._falsified(prepared, middle) else (low, middle)
        return high

    def run(self, setting: Setting, prepared: Log, isolate: bool = True) -> Detection:
        """The whole bank if it is to isolate, the nominal observer alone if not."""
        if isolate and self.faults:
            return self._run_bank(setting.level, prepared)
        return self._run_nominal(setting.level, prepared)

    # -- inside ------------------------------------------------------------------------------------

    def _observer(self, name: str, scale: float, log: Log) -> WindowObserver:
        """Its model is evaluated for the whole log at once; the schedule of a sample is its number."""
        own: Any = self.models[name]
        model = scaled_bounds(own if isinstance(own, NonlinearModel) else own.along(log.schedule), scale)
        return WindowObserver(model, self.initial, horizon=self.horizon)

    def _falsified(self, log: Log, scale: float) -> bool:
        steps = _drive(self._observer(NOMINAL, scale, log), log)
        return any(step.verdict == "falsified" for step in steps)

    def _run_nominal(self, scale: float, log: Log) -> Detection:
        alarm, width = np.zeros(len(log), dtype=bool), self._empty_width(len(log))
        processed = 0
        for k, step in enumerate(_drive(self._observer(NOMINAL, scale, log), log)):
            processed = k + 1
            if step.verdict == "falsified":
                alarm[k:] = True
                break
            self._measure(width, k, step)
        return Detection(alarm, None, processed, width)

    def _run_bank(self, scale: float, log: Log) -> Detection:
        faults = {name: self._observer(name, scale, log) for name in self.faults}
        bank = ArchitectureI(self._observer(NOMINAL, scale, log), faults)
        alarm, isolated = np.zeros(len(log), dtype=bool), np.full(len(log), NOBODY, dtype=np.intp)
        width, processed = self._empty_width(len(log)), 0
        for k, verdict in enumerate(_drive(bank, log)):
            processed = k + 1
            if verdict.state != NOMINAL:
                alarm[k:] = True
            elif NOMINAL in verdict.steps:
                self._measure(width, k, verdict.steps[NOMINAL])
            if verdict.state == "isolated":
                isolated[k:] = self.faults.index(verdict.fault)
            if verdict.state in ("isolated", "unexplained"):
                break  # final: nothing starts again in this bank
        return Detection(alarm, isolated, processed, width)

    def _empty_width(self, samples: int) -> Array | None:
        return None if self.width_of is None else np.full((samples, len(np.atleast_2d(self.width_of))), np.nan)

    def _measure(self, width: Array | None, k: int, step: Any) -> None:
        if width is not None:
            directions = np.atleast_2d(real_array("width_of", self.width_of))
            width[k] = step.support(np.concatenate([directions, -directions])).reshape(2, -1).sum(axis=0)


def _drive(driven: Any, log: Log) -> Iterator[Any]:
    """The answers over a log of what is driven along it: the schedule of sample k is the number k."""
    observers = driven.observers.values() if isinstance(driven, ArchitectureI) else [driven]
    is_linear = not any(isinstance(observer.model, NonlinearModel) for observer in observers)
    return drive(driven, replace(log, schedule=np.arange(len(log), dtype=float) if is_linear else None))
