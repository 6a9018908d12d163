"""Detection on a log, sample by sample, as an online loop would do it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.alarms import Alarm, write_alarms
from svo.isolation.bank import Bank
from svo.isolation.record import BankRecord, Recorder, Verdict
from svo.log import Log
from svo.plant import Plant, Scheduler, schedule_of


@dataclass(frozen=True)
class Detection:
    """What a bank said about a log, with the log's own times [s].

    Attributes
    ----------
    plant, noise : str
    time : (K,) array
    record : BankRecord
    alarms : tuple of Alarm
        Every certified falsification, in order of time.
    """

    plant: str
    noise: str
    time: NDArray[np.float64]
    record: BankRecord
    alarms: tuple[Alarm, ...]

    @property
    def detected_s(self) -> float | None:
        """Time of the first falsification of the nominal model."""
        return self._at(self.record.detected_at)

    @property
    def isolated_s(self) -> float | None:
        """First time at which exactly one fault was left."""
        return self._at(self.record.isolated_at)

    @property
    def alive(self) -> tuple[str, ...]:
        """Models that explain the data to the end."""
        return self._alive(-1)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the certificates, for JSON; ``changes`` lists the verdict whenever it changed."""
        record = self.record
        return {
            "plant": self.plant,
            "noise": self.noise,
            "samples": len(self.time),
            "state": record.states[-1],
            "detected_s": self.detected_s,
            "isolated_s": self.isolated_s,
            "fault": record.fault,
            "alive": list(self.alive),
            "falsified_s": {alarm.observer: alarm.time for alarm in self.alarms},
            "undecided": int(record.undecided.sum()),
            "changes": [
                {"time_s": float(self.time[k]), "state": record.states[k], "alive": list(self._alive(k))}
                for k in range(len(self.time))
                if k == 0 or (record.states[k], self._alive(k)) != (record.states[k - 1], self._alive(k - 1))
            ],
        }

    def _at(self, sample: int | None) -> float | None:
        return None if sample is None else float(self.time[sample])

    def _alive(self, sample: int) -> tuple[str, ...]:
        return tuple(name for name, alive in zip(self.record.names, self.record.alive[sample], strict=True) if alive)


def verdicts(bank: Bank, log: Log, scheduler: Scheduler | None = None) -> Iterator[Verdict]:
    """The bank's verdict at each sample of a log.

    Without a ``scheduler`` the schedule is the log's own. Sets and boxes of a verdict's steps must be read before
    the next verdict is asked for.
    """
    for k in range(len(log)):
        schedule = log.schedule_at(k) if scheduler is None else schedule_of(scheduler, log.y[k], log.u[k])
        if k == 0:
            yield bank.update(log.y[0], u=log.u[0], schedule=schedule)
        else:
            yield bank.step(log.u[k - 1], log.y[k], u_next=log.u[k], schedule=schedule)


def detect(
    plant: Plant,
    log: Log,
    noise: str,
    *,
    source: Mapping[str, str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Detection:
    """Run a plant's bank over a log and collect what it found.

    Parameters
    ----------
    plant : Plant
    log : Log
        Only time, u and y are used; the plant's own scheduler makes the schedule of them.
    noise : str
        Noise set whose bounds the observers assume.
    source : mapping, optional
        Where the log comes from; stored in each alarm beside plant and noise set.
    progress : callable, optional
        Called with (samples done, samples in all) after each sample.
    """
    bank = plant.bank(noise)
    bank.warm_up()  # no sample waits for a compiler
    recorder = Recorder(bank.names, len(log))
    for verdict in verdicts(bank, log, plant.scheduler()):
        recorder.add(verdict)
        if progress is not None:
            progress(verdict.sample + 1, len(log))
    record = recorder.record()
    origin = {"plant": plant.name, "noise": noise, **(source or {})}
    return Detection(plant.name, noise, log.time, record, alarms_of(record, log, origin))


def alarms_of(record: BankRecord, log: Log, source: Mapping[str, str | int | float]) -> tuple[Alarm, ...]:
    """Every certified falsification of a record, in order of time."""
    died = sorted((sample, name) for name, sample in record.died_at.items() if sample is not None)
    return tuple(Alarm(name, k, float(log.time[k]), record.certificates[name], source) for k, name in died)


def write_detection(folder: Path, detection: Detection) -> None:
    """Write alarms.jsonl (with certificates) and verdict.json into a folder, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    write_alarms(folder / "alarms.jsonl", detection.alarms)
    (folder / "verdict.json").write_text(json.dumps(detection.to_dict(), indent=2) + "\n", encoding="utf-8")
