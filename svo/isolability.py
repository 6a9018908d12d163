"""What a plant's bank cannot confuse: every stated fault against every observer, before any study."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.distinguish import Distinguishability, distinguishability
from svo.log import Log
from svo.observers.step import Observer
from svo.plant import HEALTHY, Plant, StatesFaults


@dataclass(frozen=True)
class Isolability:
    """Every stated fault of a plant against every observer of its bank, along one flight without a fault.

    Attributes
    ----------
    plant, noise : str
    seed, samples : int
        Seed of the flight, and the largest number of samples that was searched.
    Ts, fault_time : float
        Sampling time and time of the first faulty sample [s].
    faults : mapping of str to str
        Fault to its description, size included.
    answers : mapping of fault to mapping of observer to Distinguishability
    """

    plant: str
    noise: str
    seed: int
    samples: int
    Ts: float
    fault_time: float
    faults: Mapping[str, str]
    answers: Mapping[str, Mapping[str, Distinguishability]]

    def to_dict(self) -> dict[str, Any]:
        """For JSON; ``horizon`` counts samples, null = never within those searched."""
        return {
            "plant": self.plant,
            "noise": self.noise,
            "seed": self.seed,
            "searched": self.samples,
            "Ts": self.Ts,
            "fault_time": self.fault_time,
            "faults": {
                fault: {
                    "description": self.faults[fault],
                    "observers": {
                        observer: {"horizon": a.horizon, "exact": a.exact, "separation": a.separation}
                        for observer, a in answers.items()
                    },
                }
                for fault, answers in self.answers.items()
            },
        }

    def cell(self, fault: str, observer: str) -> str:
        """One answer for people."""
        answer = self.answers[fault][observer]
        if answer.horizon is None:
            return f"never within {self.samples}" if answer.exact else f"not shown within {self.samples}"
        return f"{'' if answer.exact else '<= '}{answer.horizon} ({answer.horizon * self.Ts:g} s)"


def isolability(
    plant: Plant, noise: str, horizon: int, seed: int = 0, progress: Callable[[int, int], None] | None = None
) -> Isolability:
    """Compare a plant's stated faults with the observers of its bank.

    One flight without a fault gives inputs and schedule, and the observers' knowledge of the state at the first faulty
    sample. From there on the same inputs drive the plant with the fault; everything else is free within its bounds.

    Parameters
    ----------
    plant : Plant
        One that also has ``stated_faults``.
    noise : str
        Noise set.
    horizon : int
        Largest number of samples to search.
    seed : int
        Of the flight.
    progress : callable, optional
        Called with (pairs done, pairs in all).

    Raises
    ------
    ValueError
        If the plant states no faults, if the flight is too short, or if it falsifies an observer.
    """
    if not isinstance(plant, StatesFaults):
        raise ValueError(f"plant {plant.name!r} has no method stated_faults(noise); it is needed for the faults' sizes")
    log = plant.simulate(HEALTHY, HEALTHY, noise, seed)
    first = int(np.searchsorted(log.time, plant.fault_time - plant.Ts / 2))
    if not 1 <= horizon <= len(log) - first:
        raise ValueError(
            f"horizon is {horizon}; expected 1 to {len(log) - first}, the samples of a flight from the fault on"
        )
    observers = plant.bank(noise).observers
    known = {name: _predicted(name, observer, log, first) for name, observer in observers.items()}
    stated = plant.stated_faults(noise)
    answers: dict[str, dict[str, Distinguishability]] = {}
    for fault, case in stated.items():
        answers[fault] = {}
        for i, (name, observer) in enumerate(observers.items()):
            answers[fault][name] = distinguishability(
                case.model,
                observer.model,
                horizon,
                initial=known["nominal"],  # the plant was healthy until now
                observer_initial=known[name],
                u=log.u[first:],
                schedule=None if log.schedule is None else log.schedule[first:],
            )
            if progress is not None:
                progress((len(answers) - 1) * len(observers) + i + 1, len(stated) * len(observers))
    faults = {name: case.description for name, case in stated.items()}
    return Isolability(plant.name, noise, seed, horizon, plant.Ts, plant.fault_time, faults, answers)


def _predicted(name: str, observer: Observer, log: Log, first: int) -> HPolytope:
    """What an observer knows of the state at a sample from the data before it."""
    missing = np.full(log.y.shape[1], np.nan)
    for k in range(first + 1):
        y = log.y[k] if k < first else missing
        schedule = log.schedule_at(k)
        if k == 0:
            step = observer.update(y, u=log.u[0], schedule=schedule)
        else:
            step = observer.step(log.u[k - 1], y, u_next=log.u[k], schedule=schedule)
    lower, upper = step.box
    if np.isnan(lower).any():
        raise ValueError(f"the fault-free flight falsifies the observer {name!r}; widen its bounds (svo calibrate)")
    return HPolytope.box(lower, upper)
