"""Flights, observers and clocks that the parts of the window observer's benchmark share."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from time import perf_counter_ns, process_time_ns

import numpy as np

from aircraft.eclipse.plant import INITIAL_LOWER, INITIAL_UPPER
from benchmarks._window_references import Floats
from polytopes import HPolytope
from svo.isolation.bank import Bank
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.model import UncertainModel
from svo.observers.window.observer import WindowObserver

NOISE, SEED, HORIZON = "quiet", 20_130_613, 10
SCHEDULES = ("as used", "every sample")
SETTLE = 60  # samples before the first one that counts
TURN = 20  # samples that a method does at a time
Sample = Callable[[int], object]


@dataclass
class Times:
    """Nanoseconds of calls, by the wall's clock and by the process' CPU clock, by sample."""

    wall: dict[int, int] = field(default_factory=dict)
    cpu: dict[int, int] = field(default_factory=dict)

    def measure(self, call: Sample, k: int, at: int | None = None) -> object:
        """Call with sample k, and note the times as those of sample ``at`` (k itself by default)."""
        cpu, wall = process_time_ns(), perf_counter_ns()
        result = call(k)
        wall, cpu = perf_counter_ns() - wall, process_time_ns() - cpu
        at = k if at is None else at
        self.wall[at], self.cpu[at] = wall, cpu
        return result

    def microseconds(self, clock: str, keys: Iterable[int] | None = None) -> Floats:
        """Times of some samples, or of all."""
        values: dict[int, int] = getattr(self, clock)
        return np.array([values[k] for k in (values if keys is None else keys)]) * 1e-3


def observer_of(model: UncertainModel, horizon: int = HORIZON, schedule: str = "as used") -> WindowObserver:
    """A fresh observer of any flight between 25 and 55 m/s."""
    initial = HPolytope.box(INITIAL_LOWER, INITIAL_UPPER)
    observer = WindowObserver(model, initial, horizon=horizon)
    if schedule == "every sample":
        observer._settings.__dict__["block"] = 1
        observer.reset(initial)
    return observer


def sampler(observer: WindowObserver | Bank, log: Log) -> Sample:
    """A function that gives an observer or a bank the samples k = 0, 1, ... of a log."""
    answers = drive(observer, log)
    return lambda k: next(answers)
