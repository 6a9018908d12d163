"""The alarms of a bank's run, and what says of each which bank it is from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from svo.checks import Array
from svo.isolation import NONLINEAR, STAMPED, Alarm, BankRecord, Outcome
from svo.logs.log import Log
from svo.models import model_digest
from svo.models.nonlinear import NonlinearModel
from svo.models.scheduled_stacks import ScheduledStacks
from svo.observers.base import Certificate, Observer
from svo.plant import BankChoice, MonitoredPlant, bank_choice

KEPT_SCHEDULES = 4096
"""Scheduling values that are kept of a log that is not; of a longer proof the matrices are stored."""


def alarms_of(
    record: BankRecord,
    log: Log,
    source: Mapping[str, str | int | float],
    observers: Mapping[str, Observer] | None = None,
) -> tuple[Alarm, ...]:
    """Every certified falsification of a record, in order of time.

    With the ``observers`` of the bank each alarm carries the digest of its model.
    """
    found = alarms_at(record, log.time, source, observers, record.log.schedule)
    return with_intervals(found, log) if observers else found


def with_intervals(alarms: tuple[Alarm, ...], log: Log) -> tuple[Alarm, ...]:
    """Alarms of a log with the seconds between the samples of their proofs, where it keeps its own times."""
    if not log.keeps_its_times:
        return alarms
    first = [alarm.sample + 1 - len(alarm.certificate.samples) for alarm in alarms]
    return tuple(replace(a, dt=np.diff(log.time[k : a.sample + 1])) for a, k in zip(alarms, first, strict=True))


def alarms_at(
    outcome: BankRecord | Outcome,
    times: Mapping[int, float] | Array,
    source: Mapping[str, str | int | float],
    observers: Mapping[str, Observer] | None = None,
    schedule: Mapping[int, float] | Array | None = None,
) -> tuple[Alarm, ...]:
    """As `alarms_of`, where the ``times`` [s] of some samples are known: at least those of the falsifications.

    Where the scheduling values of the samples of a proof are known, its record holds them instead of matrices.
    """
    died = sorted((sample, name) for name, sample in outcome.died_at.items() if sample is not None)
    alarms = []
    for k, name in died:
        proof = outcome.certificates[name]
        assert proof is not None  # banks take no falsification without one
        first = k + 1 - len(proof.samples)
        values = None if schedule is None else [_value_at(schedule, i) for i in range(max(first, 0), k + 1)]
        alarms.append(alarm_of(name, k, float(times[k]), proof, source, (observers or {}).get(name), values))
    return tuple(alarms)


def alarm_of(
    name: str,
    sample: int,
    time: float,
    proof: Certificate,
    source: Mapping[str, str | int | float],
    observer: Observer | None,
    schedule: Sequence[Any] | None,
) -> Alarm:
    """One alarm; with its ``observer`` it says whose model that is, and what is promised of the state.

    Parameters
    ----------
    name, sample, time, proof, source
        As of `Alarm`; the proof is its certificate.
    observer : Observer or None
    schedule : sequence or None
        Scheduling value of each sample of the proof; None where one is not known.
    """
    if observer is None:
        return Alarm(name, sample, time, proof, source)
    if (kind := kind_of_model(observer)) is not None:
        source = {**source, "model": kind}
    digest, promises = digest_of_alarm(observer, proof), promises_of(observer)
    return Alarm(name, sample, time, proof, source, digest, promises, _scheduled(observer, proof, schedule))


def kind_of_model(observer: Observer) -> str | None:
    """What the source of an alarm says of its model, so that it is told what of that is not checked; None = nothing."""
    if isinstance(observer.model, NonlinearModel):
        return NONLINEAR
    return None if observer.jitter is None else STAMPED


def promises_of(observer: Observer) -> dict[str, tuple[Array, Array]]:
    """What an observer's model promises of the state besides its bounds, as alarms state it."""
    model = observer.model
    ranges = {"physical": model.physical_range, "largest": model.start_range}
    return {name: (r.lower, r.upper) for name, r in ranges.items() if r is not None}


def _scheduled(observer: Observer, proof: Certificate, schedule: Sequence[Any] | None) -> ScheduledStacks | None:
    """How the matrices of a proof follow from the schedule, where the model is a table over scalars."""
    table = None if isinstance(observer.model, NonlinearModel) else observer.model.stack_table
    if table is None or schedule is None or len(schedule) != len(proof.samples):
        return None
    if not all(isinstance(value, float) for value in schedule):
        return None
    return ScheduledStacks.of(table, np.array(schedule))


def _value_at(schedule: Mapping[int, float] | Array, sample: int) -> Any:
    if isinstance(schedule, Mapping):
        return schedule.get(sample)
    value = schedule[sample]
    return float(value) if value.ndim == 0 else value


def digest_of_alarm(observer: Observer, certificate: Certificate) -> str:
    """Digest of an observer's model and options with the numbers that a certificate holds of it."""
    return model_digest(observer.model, observer.options, certificate.model_data())


def source_of_bank(plant: MonitoredPlant) -> dict[str, str]:
    """Which bank an alarm comes from, as stored with it: the plant, and which of its banks if there is a choice."""
    chosen = {name: value for name, value in bank_choice(plant)._asdict().items() if value is not None}
    return {"plant": Path(plant.name).name, **chosen}  # a file stands beside its alarms


def bank_of_source(source: Mapping[str, str | int | float]) -> BankChoice:
    """Which bank of its plant the source of an alarm names."""
    return BankChoice(*(None if (value := source.get(name)) is None else str(value) for name in BankChoice._fields))
