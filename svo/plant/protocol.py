"""The protocol behind the entry points of the group ``svo.plants``.

A study, the command line and a report know a plant only through these names, so a user's own plant
registers exactly as the ones that ship: an object that satisfies :class:`Plant`, named in the entry
points of its distribution.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import Shown
from svo.isolation import Bank
from svo.logs.log import Log
from svo.logs.names import Columns
from svo.plant.scheduling import Scheduler

HEALTHY = "none"
Distribution = Literal["bounded", "gaussian"]


@dataclass(frozen=True)
class Reference(Shown):
    """What a paper reports for one fault and profile, as it is to be printed: times to ``detect`` and ``isolate`` it.

    In seconds, "-" where it is silent.
    """

    detect: str
    isolate: str


class MonitoredPlant(Protocol):
    """What detection on recorded data needs to know of a plant: a model and the columns, no simulator.

    Attributes
    ----------
    name, title : str
        The key in the registry (or the name of the file that describes it), and one line for people.
    Ts : float
        Sampling time [s].
    noise_sets : tuple of str
        Names of the noise and disturbance bounds; the first is the default.
    columns : Columns
        Names and units of the channels of a log file.
    """

    @property
    def name(self) -> str: ...

    @property
    def title(self) -> str: ...

    @property
    def Ts(self) -> float: ...

    @property
    def noise_sets(self) -> tuple[str, ...]: ...

    @property
    def columns(self) -> Columns: ...

    def bank(self, noise: str) -> Bank:
        """A fresh isolation bank for the bounds of the noise set ``noise``."""
        ...

    def scheduler(self) -> Scheduler:
        """A fresh causal scheduling filter: called with each y in turn, returns the schedule of that sample."""
        ...


@runtime_checkable
class Plant(Protocol):
    """What a study needs to know of a plant; every one is a `MonitoredPlant` too.

    Attributes
    ----------
    name, title : str
        The key in the registry, and one line for people.
    Ts : float
        Sampling time [s].
    fault_time : float
        Time of the first faulty sample [s].
    faults : mapping of str to tuple of str
        Fault names and, for each, its profiles ("step", "hard", "soft").
    noise_sets : tuple of str
        Names of the noise and disturbance bounds; the first is the default.
    columns : Columns
        Names and units of the channels of a log file.
    reference : mapping of (fault, profile) to Reference
        The paper's figures, printed beside ours; may be empty.
    reference_title : str
        Where those figures come from.
    """

    name: str
    title: str
    Ts: float
    fault_time: float
    faults: Mapping[str, tuple[str, ...]]
    noise_sets: tuple[str, ...]
    columns: Columns
    reference: Mapping[tuple[str, str], Reference]
    reference_title: str

    def duration(self, fault: str, profile: str) -> float:
        """Length of a run with a profile of a fault [s]; ``fault`` may be "none"."""
        ...

    def simulate(self, fault: str, profile: str, noise: str, seed: int | np.random.SeedSequence) -> Log:
        """One run with its true states; the log carries the schedule of `scheduler`.

        Parameters
        ----------
        fault, profile : str
            As in `faults`, or "none" for a healthy run.
        noise : str
            One of `noise_sets`, whose bounds noise and disturbances keep.
        seed : int or numpy.random.SeedSequence
            The same seed gives the same log.
        """
        ...

    def bank(self, noise: str) -> Bank:
        """A fresh isolation bank for the bounds of a noise set; its fault observers are named as in `faults`.

        ``noise`` is one of `noise_sets`.
        """
        ...

    def scheduler(self) -> Scheduler:
        """A fresh causal scheduling filter: called with each y in turn, returns the schedule of that sample."""
        ...


@dataclass(frozen=True)
class StatedFault(Shown):
    """A plant with one fault of one size, held from its first sample on.

    Attributes
    ----------
    description : str
        The fault and its size, for people.
    model : UncertainModel or NonlinearModel
        The plant with exactly this fault; unlike an observer's model it does not contain the fault-free plant.
    """

    description: str
    model: Any


@dataclass(frozen=True)
class Exhibit(Shown):
    """A picture that a plant adds to its study: its ``path``, and what it shows as ``title`` and ``caption``."""

    path: Path
    title: str
    caption: str


@dataclass(frozen=True)
class AddedStudy(Shown):
    """A study that a plant adds to that of its bank: jobs for the engine of all studies.

    Attributes
    ----------
    name : str
        Of its folder in the study's.
    configuration : mapping
        What its rows depend on besides the versions of the software; plain data.
    jobs : sequence
        Can be pickled.
    work : function of a job
        Its row; can be pickled.
    row : type
        The dataclass of rows; its ``error`` says why a job failed, and is None otherwise.
    failed : function of a job and an error
        The row of a job that failed.
    write : function of a folder and rows
        Writes tables of the rows that did not fail into the study's folder.
    """

    name: str
    configuration: Mapping[str, Any]
    jobs: Sequence[Any]
    work: Callable[[Any], Any]
    row: type[Any]
    failed: Callable[[Any, str], Any]
    write: Callable[[Path, Sequence[Any]], None]


@runtime_checkable
class TimesFaults(Protocol):
    """What a `Plant` offers besides if its faults do not all begin at `fault_time`."""

    def fault_start(self, fault: str, profile: str) -> float:
        """Time of the first faulty sample of a fault and profile [s]."""
        ...


def fault_start(plant: Plant, fault: str, profile: str) -> float:
    """Time of the first faulty sample of a fault and profile [s]; the plant's `fault_time` without a fault."""
    if fault != HEALTHY and isinstance(plant, TimesFaults):
        return plant.fault_start(fault, profile)
    return plant.fault_time


def first_faulty_sample(plant: Plant, fault: str, profile: str, time: NDArray[np.float64]) -> int:
    """Index of the first sample of a run of a plant at which a fault acts; K without a fault.

    ``profile`` is that of the fault, ``time`` (K,) the times of the run's samples [s].
    """
    if fault == HEALTHY:
        return len(time)
    return round((fault_start(plant, fault, profile) - float(time[0])) / plant.Ts)


def chosen_noise(plant: MonitoredPlant, noise: str | None) -> str:
    """The ``noise`` set that was named, or the first of a ``plant``.

    Raises
    ------
    ValueError
        If the plant has none of that name.
    """
    chosen = plant.noise_sets[0] if noise is None else noise
    if chosen not in plant.noise_sets:
        raise ValueError(f"plant {plant.name!r} has no noise set {chosen!r}; it has {', '.join(plant.noise_sets)}")
    return chosen


def expect_plant(plant: Any) -> None:
    """Raise a TypeError for what is no plant, such as its name or its class."""
    if not isinstance(plant, type) and callable(getattr(plant, "bank", None)):
        return
    if isinstance(plant, str | Path):
        raise TypeError(f"plant is {str(plant)!r}; expected a plant, such as svo.find_plant({str(plant)!r}) gives")
    raise TypeError(f"plant is {type(plant).__name__}; expected a plant (svo.plant.Plant), which has a bank(noise)")
