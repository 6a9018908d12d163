"""The samples of one exemplary run that the pictures need: models alive, boxes, some sets, true states."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.checks import Array, expect_shape
from svo.logs.log import Log
from svo.observers.base import Step
from svo.plant import BankChoice, Plant, fault_start
from svo.plant.choice import ONLY_BANK
from svo.store.npz_file import read_npz
from svo.studies.configuration import Job


@dataclass(frozen=True)
class Snapshot:
    """The sets of the models alive at one sample; ``event`` says what happens at the next one."""

    sample: int
    event: str
    sets: Mapping[str, HPolytope]


@dataclass(frozen=True)
class Exemplar:
    """What one run looked like from inside.

    Attributes
    ----------
    fault, profile, noise : str
    bank : BankChoice
    names : tuple of str
        The observers, "nominal" first.
    time : (K,) array
        Seconds.
    alive : (K, n_observers) array of bool
    lower, upper : (K, n_observers, n) arrays
        Boxes of the state; NaN once a model is falsified.
    x : (K, n) array
        True states.
    snapshots : tuple of Snapshot
        Before each falsification, and at the end.
    """

    fault: str
    profile: str
    noise: str
    names: tuple[str, ...]
    time: Array
    alive: NDArray[np.bool_]
    lower: Array
    upper: Array
    x: Array
    snapshots: tuple[Snapshot, ...]
    bank: BankChoice = ONLY_BANK

    @property
    def last_falsification(self) -> int:
        """Sample at which the last of the falsified models fell; 0 if none did."""
        return max((self.died_at(i) or 0 for i in range(len(self.names))), default=0)

    def died_at(self, observer: int) -> int | None:
        """Sample from which an observer, by its number, is falsified to the end; None if it is alive there."""
        alive = self.alive[:, observer]
        return None if alive[-1] else int(np.flatnonzero(np.append(True, alive))[-1])

    def save(self, path: Path) -> None:
        """Write all of it as a compressed .npz without pickled objects."""
        header: dict[str, Any] = {"fault": self.fault, "profile": self.profile, "noise": self.noise}
        header |= {"names": list(self.names), "bank": list(self.bank)}
        header["snapshots"] = [{"sample": s.sample, "event": s.event, "sets": list(s.sets)} for s in self.snapshots]
        arrays: dict[str, Any] = {"header": np.array(json.dumps(header))}
        arrays |= {name: getattr(self, name) for name in ("time", "alive", "lower", "upper", "x")}
        for i, snapshot in enumerate(self.snapshots):
            for j, polytope in enumerate(snapshot.sets.values()):
                arrays[f"A_{i}_{j}"], arrays[f"b_{i}_{j}"] = polytope.A, polytope.b
        with path.open("wb") as file:
            np.savez_compressed(file, **arrays)

    @classmethod
    def load(cls, path: Path) -> Exemplar:
        """Read what `save` wrote.

        Raises
        ------
        ValueError
            If the file is damaged, is something else, or unpacks to more than `svo.store.unpacking` allows.
        """
        data = read_npz(path)
        try:
            return _decode(data)
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise ValueError(f"{path} holds no samples of a run ({type(error).__name__}: {error})") from error


def _decode(data: Mapping[str, NDArray[Any]]) -> Exemplar:
    header = json.loads(str(data["header"]))
    names = tuple(map(str, header["names"]))
    arrays = {name: data[name] for name in ("time", "alive", "lower", "upper", "x")}
    expect_shape(arrays["x"].ndim == 2, "x", arrays["x"], "(samples, states)")
    samples, states = arrays["x"].shape
    shapes = {"time": (samples,), "alive": (samples, len(names)), "x": (samples, states)}
    shapes |= dict.fromkeys(("lower", "upper"), (samples, len(names), states))
    for name, array in arrays.items():
        if array.shape != shapes[name] or array.dtype != (bool if name == "alive" else float):
            raise ValueError(f"{name} has the shape {array.shape} and type {array.dtype}; expected {shapes[name]}")
    snapshots = tuple(
        Snapshot(
            int(s["sample"]),
            str(s["event"]),
            {str(name): HPolytope(data[f"A_{i}_{j}"], data[f"b_{i}_{j}"]) for j, name in enumerate(s["sets"])},
        )
        for i, s in enumerate(header["snapshots"])
    )
    if any(not 0 <= s.sample < samples or not set(s.sets) <= set(names) for s in snapshots):
        raise ValueError("a snapshot is not one of this run")
    fault, profile, noise = (str(header[name]) for name in ("fault", "profile", "noise"))
    return Exemplar(
        fault, profile, noise, names, snapshots=snapshots, bank=BankChoice(*header["bank"]), **arrays
    )  # fmt: skip


def planar_outline(step: Step) -> HPolytope:
    """Outer polytope of the state whose projection on any two axes has up to 16 sides.

    Directions are spread evenly over each coordinate plane, in units of the box.
    """
    lower, upper = step.box
    width = np.where(upper > lower, upper - lower, 1.0)
    angles = np.delete(np.pi * np.arange(8) / 8, [0, 4])  # the axes are the box's own
    rows = []
    for i, j in itertools.combinations(range(width.size), 2):
        plane = np.zeros((angles.size, width.size))
        plane[:, i], plane[:, j] = np.cos(angles) / width[i], np.sin(angles) / width[j]
        rows += [plane, -plane]
    if not rows:
        return step.set
    directions = np.vstack(rows)
    return step.set.intersection(HPolytope(directions, step.support(directions)))


def follow(plant: Plant, job: Job, log: Log, alive: NDArray[np.bool_]) -> Exemplar:
    """Take a fresh bank over a log and keep what it knew at each sample.

    ``alive`` (K, n_observers) is what a run of the bank said: it tells beforehand at which samples sets are kept, and
    the bank stops there.
    """
    if log.x is None:
        raise ValueError(f"plant {plant.name!r} simulates without true states; expected Log.x for the pictures")
    bank, begins = plant.bank(job.noise), fault_start(plant, job.fault, job.profile)
    names, last = tuple(bank.names), len(log) - 1
    boxes = {name: np.full((len(log), 2, log.x.shape[1]), np.nan) for name in names}
    falls_next = np.vstack([alive[:-1] & ~alive[1:], np.zeros_like(alive[:1])])
    kept = np.union1d(np.flatnonzero(falls_next.any(axis=1)), last).tolist()
    snapshots: list[Snapshot] = []
    for before, k in itertools.pairwise([-1, *kept]):
        rows = slice(max(before, 0), k + 1)
        part = {name: box[rows] for name, box in boxes.items()}
        *_, (verdict, _) = bank.follow(_part(log, rows), part, start=int(before >= 0))
        living = [name for name, is_alive in zip(names, alive[k], strict=True) if is_alive]
        steps = {name: verdict.steps[name] for name in living if name in verdict.steps}  # class II waits
        compared = log.time[k] >= begins - plant.Ts and len(living) > 1
        sets = {name: planar_outline(step) if compared else step.set for name, step in steps.items()}
        fallen = ", ".join(name for name, falls in zip(names, falls_next[k], strict=True) if falls)
        if sets or k == last:
            snapshots.append(Snapshot(k, f"{fallen} falsified next" if k < last else "end of the run", sets))
    bounds = np.stack(list(boxes.values()), axis=1)  # (K, observers, 2, n)
    bounds[~alive] = np.nan
    lower, upper = bounds[:, :, 0], bounds[:, :, 1]
    return Exemplar(
        job.fault, job.profile, job.noise, names, log.time, alive, lower, upper, log.x, tuple(snapshots),
        job.bank,
    )  # fmt: skip


def _part(log: Log, rows: slice) -> Log:
    schedule = None if log.schedule is None else log.schedule[rows]
    return replace(log, time=log.time[rows], u=log.u[rows], y=log.y[rows], x=None, schedule=schedule)
