"""Detection on a log, sample by sample, as an online loop would do it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.detection.alarm_folder import ALARMS, VERDICT, check_no_results
from svo.isolation import Alarm, BankRecord, write_alarms
from svo.logs.columns import check_times
from svo.logs.log import Log, expect_log
from svo.models import model_digest
from svo.observers.base import Certificate, Observer
from svo.plant import MonitoredPlant, architecture_of, schedule_of
from svo.plant.protocol import expect_plant
from svo.store import write_text, write_whole


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

    @property
    def restarted(self) -> tuple[str, ...]:
        """Models that were falsified, began again (`recovery` of the bank) and explain the data to the end."""
        falsified = {alarm.observer for alarm in self.alarms}
        return tuple(name for name in self.alive if name in falsified)

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
            "restarted": list(self.restarted),
            "falsified_s": {alarm.observer: alarm.time for alarm in self.alarms},
            "undecided": int(record.undecided.sum()),
            "stopped": int(record.stopped.sum()),
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


def check_log(plant: MonitoredPlant, log: Log) -> None:
    """Raise an error if a log is not one of a plant: its channels, and its sampling time within 1 %."""
    expect_plant(plant)
    expect_log(log)
    replace(log, x=None).to_columns(plant.columns)
    check_times(log.time, plant.Ts, lambda k: f"log, sample {k}")


def detect(
    plant: MonitoredPlant,
    log: Log,
    noise: str,
    *,
    source: Mapping[str, str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Detection:
    """Run a plant's bank over a log and collect what it found.

    Parameters
    ----------
    plant : MonitoredPlant
    log : Log
        Only time, u and y are used; the plant's own scheduler makes the schedule of them.
    noise : str
        Noise set whose bounds the observers assume.
    source : mapping, optional
        Where the log comes from; stored in each alarm beside plant and noise set.
    progress : callable, optional
        Called with (samples done, samples in all) after each sample.

    Raises
    ------
    TypeError
        If the plant is a name, or the log no `svo.Log`.
    ValueError
        For an unknown noise set, and for a log without samples, with other channels, or of another sampling time.
    """
    check_log(plant, log)
    bank, scheduler = plant.bank(noise), plant.scheduler()
    schedule = [schedule_of(scheduler, y, u) for y, u in zip(log.y, log.u, strict=True)]
    known = None if schedule[0] is None else np.array(schedule)
    record = bank.run(replace(log, schedule=known), progress=progress)
    origin = {**source_of_bank(plant), "noise": noise, **(source or {})}
    return Detection(plant.name, noise, log.time, record, alarms_of(record, log, origin, bank.observers))


def alarms_of(
    record: BankRecord,
    log: Log,
    source: Mapping[str, str | int | float],
    observers: Mapping[str, Observer] | None = None,
) -> tuple[Alarm, ...]:
    """Every certified falsification of a record, in order of time.

    With the ``observers`` of the bank each alarm carries the digest of its model.
    """
    died = sorted((sample, name) for name, sample in record.died_at.items() if sample is not None)
    alarms = []
    for k, name in died:
        proof = record.certificates[name]
        assert proof is not None  # banks take no falsification without one
        model = None if observers is None else digest_of_alarm(observers[name], proof)
        alarms.append(Alarm(name, k, float(log.time[k]), proof, source, model))
    return tuple(alarms)


def digest_of_alarm(observer: Observer, certificate: Certificate) -> str:
    """Digest of an observer's model and options with the numbers that a certificate holds of it."""
    return model_digest(observer.model, observer.options, certificate.model_data())


def source_of_bank(plant: MonitoredPlant) -> dict[str, str]:
    """Which bank an alarm comes from, as stored with it: the plant and, if it offers a choice, the architecture."""
    architecture = architecture_of(plant)
    return {"plant": plant.name} | ({} if architecture is None else {"architecture": architecture})


def write_detection(folder: str | Path, detection: Detection, beside: Mapping[str, Any] | None = None) -> None:
    """Write alarms.jsonl (with certificates) and verdict.json into a folder, which is made if need be.

    ``beside`` is added to verdict.json: what detectors without certificates say, by name.

    Raises
    ------
    ValueError
        If the folder holds results already; nothing is overwritten.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    check_no_results(folder)
    write_whole(folder / ALARMS, lambda file: write_alarms(file, detection.alarms))
    verdict = {**detection.to_dict(), **(beside or {})}
    write_text(folder / VERDICT, json.dumps(verdict, indent=2) + "\n")
