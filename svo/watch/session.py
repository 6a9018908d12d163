"""A bank fed with the lines of a CSV log, one at a time."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from svo.alarms import Alarm
from svo.detect import digest_of_alarm, source_of_bank
from svo.isolation.record import Verdict
from svo.log_columns import is_sampled, wrong_step
from svo.log_csv import DIALECT, RowParser, csv_errors
from svo.plant import MonitoredPlant, schedule_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Status:
    """What a bank says at the latest sample.

    Attributes
    ----------
    samples : int
        Samples so far.
    time : float
        Time of the latest one [s].
    verdict : Verdict
    boxes : mapping of str to (lower, upper)
        Bounds (n,) of the state by each model that is alive.
    dead : mapping of str to Alarm
        The falsification of each model that is not.
    undecided : int
        Answers so far that were neither a proof nor a point.
    seconds_per_sample : float
        Time of computation, as a mean over all samples.
    """

    samples: int
    time: float
    verdict: Verdict
    boxes: Mapping[str, tuple[Array, Array]]
    dead: Mapping[str, Alarm]
    undecided: int
    seconds_per_sample: float


class Session:
    """Reads a log line by line under the rules of `svo.log_columns`, and drives a plant's bank.

    Parameters
    ----------
    plant : MonitoredPlant
    noise : str
        Noise set whose bounds the observers assume.
    source : str
        Name of the log, for messages and alarms.

    Attributes
    ----------
    names : tuple of str
        The models.
    states : tuple of str
        Names of the nominal model's states with their units.
    """

    def __init__(self, plant: MonitoredPlant, noise: str, source: str) -> None:
        self.plant, self.noise, self.source = plant, noise, source
        self._bank = plant.bank(noise)
        self.names = self._bank.names
        self.states = _state_names(plant, self._bank.observers["nominal"].model.n_states)
        self._scheduler = plant.scheduler()
        self._parser: RowParser | None = None
        self._line = 0
        self._held: Array | None = None
        self._time = 0.0
        self._verdict: Verdict | None = None
        self._dead: dict[str, Alarm] = {}
        self._samples = self._undecided = 0
        self._seconds = 0.0

    def warm_up(self) -> float:
        """Compile whatever a sample needs; returns the seconds that it took."""
        return self._bank.warm_up()

    def feed(self, line: str) -> list[Alarm]:
        """The next line: the header first, then samples; blank lines are ignored.

        Returns
        -------
        list of Alarm
            Models that this sample falsified, with their proofs.

        Raises
        ------
        ValueError
            Naming the line and the column.
        """
        self._line += 1
        if not line.strip():
            return []
        with csv_errors(f"{self.source}, line {self._line}:"):
            cells = next(csv.reader([line], **DIALECT))
        if self._parser is None:
            self._parser = RowParser(self.source, cells, self.plant.columns)
            return []
        return self._sample(np.array(self._parser.parse(self._line, cells)))

    def status(self) -> Status | None:
        """The conclusion at the latest sample, with bounds of the states; None before the first one."""
        verdict = self._verdict
        if verdict is None:
            return None
        boxes = {name: verdict.steps[name].box for name in verdict.alive if name in verdict.steps}
        per_sample = self._seconds / self._samples
        return Status(self._samples, self._time, verdict, boxes, dict(self._dead), self._undecided, per_sample)

    def _sample(self, row: Array) -> list[Alarm]:
        begun = perf_counter()
        time, n_inputs = float(row[0]), len(self.plant.columns.inputs)
        u = row[1 : 1 + n_inputs]
        y = row[1 + n_inputs : 1 + n_inputs + len(self.plant.columns.outputs)]
        if self._held is not None and not is_sampled(self._time, time, self.plant.Ts):
            where = f"{self.source}, line {self._line}, column {self.plant.columns.time!r}"
            raise wrong_step(where, self._time, time, self.plant.Ts)
        schedule = schedule_of(self._scheduler, y, u)
        if self._held is None:
            verdict = self._bank.update(y, u=u, schedule=schedule)
        else:
            verdict = self._bank.step(self._held, y, u_next=u, schedule=schedule)
        self._held, self._time, self._verdict = u, time, verdict
        self._samples += 1
        self._undecided += sum(step.verdict == "undecided" for step in verdict.steps.values())
        alarms = self._alarms(verdict)
        self._seconds += perf_counter() - begun
        return alarms

    def _alarms(self, verdict: Verdict) -> list[Alarm]:
        """Models that died just now; one that is alive again is forgotten."""
        self._dead = {name: alarm for name, alarm in self._dead.items() if name not in verdict.alive}
        origin = source_of_bank(self.plant) | {"noise": self.noise, "log": Path(self.source).name}
        new = []
        for name in self.names:
            if name not in verdict.alive and name not in self._dead and name in verdict.steps:
                proof = verdict.steps[name].certificate
                model = digest_of_alarm(self._bank.observers[name], proof)
                new.append(Alarm(name, verdict.sample, self._time, proof, origin, model))
        self._dead |= {alarm.observer: alarm for alarm in new}
        return new


def _state_names(plant: MonitoredPlant, n: int) -> tuple[str, ...]:
    """As the plant's columns call its states, if there is one each."""
    columns = plant.columns.states
    if len(columns) != n:
        return tuple(f"x{i + 1}" for i in range(n))
    return tuple(f"{c.name} [{c.unit}]" for c in columns)
