"""What a plant's bank cannot confuse: every stated fault against every observer, before any study."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from inspect import signature
from itertools import islice
from typing import Any, Protocol, runtime_checkable

import numpy as np

from polytopes import HPolytope
from polytopes.shown import Shown
from svo.analysis.distinguish import Distinguishability, distinguishability
from svo.checks import Array, expect
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.models.nonlinear import NonlinearModel
from svo.observers.base import Observer
from svo.plant import HEALTHY, OffersModels, Plant, StatedFault


@runtime_checkable
class StatesFaults(Protocol):
    """What a `Plant` offers besides if it can tell, before a study, which faults its bank can isolate."""

    def stated_faults(self, noise: str, size: float = 1.0) -> Mapping[str, StatedFault]:
        """Each fault at ``size`` times that of its first profile, with the bounds of a noise set.

        A plant may leave ``size`` out; then only the full size can be asked for.
        """
        ...


@dataclass(frozen=True)
class Isolability(Shown):
    """Every stated fault of a plant against every observer of its bank, along one flight without a fault.

    Attributes
    ----------
    plant, noise : str
    seed, samples : int
        Seed of the flight, and the largest number of samples that was searched.
    size : float
        Of the faults, as a fraction of those that the plant states.
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
    size: float
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
            "size": self.size,
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
        return horizon_text(self.answers[fault][observer], self.Ts)


def horizon_text(answer: Distinguishability, Ts: float) -> str:
    """A smallest horizon for people: samples and seconds."""
    if answer.horizon is None:
        return f"never within {answer.searched}" if answer.exact else f"not shown within {answer.searched}"
    return f"{'' if answer.exact else '<= '}{answer.horizon} ({answer.horizon * Ts:g} s)"


@dataclass(frozen=True)
class FaultFreeFlight:
    """A flight without a fault from the time of the fault on, and what the bank's observers know there.

    Attributes
    ----------
    u : (K, nu) array
    schedule : (K, ...) array or None
    models : mapping of observer to UncertainModel
    known : mapping of observer to HPolytope
        Sets of the state at the first of these samples, from the data before it.
    """

    u: Array
    schedule: Array | None
    models: Mapping[str, UncertainModel]
    known: Mapping[str, HPolytope]

    @classmethod
    def of(cls, plant: Plant, noise: str, seed: int, horizon: int) -> FaultFreeFlight:
        """Fly once.

        Raises
        ------
        ValueError
            If the flight is too short for the horizon, or falsifies an observer.
        """
        plant = _linear(plant, noise)
        log = plant.simulate(HEALTHY, HEALTHY, noise, seed)
        first = int(np.searchsorted(log.time, plant.fault_time - plant.Ts / 2))
        most = len(log) - first
        expect(1 <= horizon <= most, "horizon", horizon, f"1 to {most}, the samples of a flight from the fault on")
        observers = plant.bank(noise).observers
        return cls(
            u=log.u[first:],
            schedule=None if log.schedule is None else log.schedule[first:],
            models={name: observer.model for name, observer in observers.items()},
            known={name: _predicted(name, observer, log, first) for name, observer in observers.items()},
        )


def isolability(
    plant: Plant,
    noise: str,
    horizon: int,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    size: float = 1.0,
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
    size : float
        Of the faults, as a fraction of those that the plant states.

    Raises
    ------
    ValueError
        If the plant states no faults (or none of another size), if the flight is too short, or if it falsifies an
        observer.
    """
    stated = stated_faults(plant, noise, size)
    flight = FaultFreeFlight.of(plant, noise, seed, horizon)
    answers: dict[str, dict[str, Distinguishability]] = {}
    for fault, case in stated.items():
        answers[fault] = {}
        for i, (name, model) in enumerate(flight.models.items()):
            answers[fault][name] = distinguishability(
                case.model,
                model,
                horizon,
                initial=flight.known["nominal"],  # the plant was healthy until now
                observer_initial=flight.known[name],
                u=flight.u,
                schedule=flight.schedule,
            )
            if progress is not None:
                progress((len(answers) - 1) * len(flight.models) + i + 1, len(stated) * len(flight.models))
    faults = {name: case.description for name, case in stated.items()}
    return Isolability(plant.name, noise, seed, horizon, size, plant.Ts, plant.fault_time, faults, answers)


def stated_faults(plant: Plant, noise: str, size: float) -> Mapping[str, StatedFault]:
    """The plant's faults at a fraction of the size that it states.

    Raises
    ------
    ValueError
        If the plant states no faults, or has no other size than the full one, or refuses this one.
    """
    if not isinstance(plant, StatesFaults):
        raise ValueError(f"plant {plant.name!r} has no method stated_faults(noise); it is needed for the faults' sizes")
    if size == 1.0:
        return plant.stated_faults(noise)
    if "size" not in signature(plant.stated_faults).parameters:
        raise ValueError(f"plant {plant.name!r} states its faults at one size only; leave the size out")
    return plant.stated_faults(noise, size=size)


def _linear(plant: Plant, noise: str) -> Plant:
    """The plant with a bank of linear models, which a fault can be compared with, where it offers one."""
    offered = [plant.with_models(kind) for kind in plant.model_kinds] if isinstance(plant, OffersModels) else []
    for candidate in (plant, *offered):
        if not any(isinstance(o.model, NonlinearModel) for o in candidate.bank(noise).observers.values()):
            return candidate
    return plant


def _predicted(name: str, observer: Observer, log: Log, first: int) -> HPolytope:
    """What an observer knows of the state at a sample from the data before it."""
    y = log.y.copy()
    y[first] = np.nan
    *_, step = islice(drive(observer, replace(log, y=y)), first + 1)
    lower, upper = step.box
    if np.isnan(lower).any():
        raise ValueError(f"the fault-free flight falsifies the observer {name!r}; widen its bounds (svo calibrate)")
    return HPolytope.box(lower, upper)
