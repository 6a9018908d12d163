"""The alarms of a bank's run, and what says of each which bank it is from."""

from __future__ import annotations

from collections.abc import Mapping

from svo.checks import Array
from svo.isolation import NONLINEAR, Alarm, BankRecord, Outcome
from svo.logs.log import Log
from svo.models import model_digest
from svo.models.nonlinear import NonlinearModel
from svo.observers.base import Certificate, Observer
from svo.plant import BankChoice, MonitoredPlant, bank_choice


def alarms_of(
    record: BankRecord,
    log: Log,
    source: Mapping[str, str | int | float],
    observers: Mapping[str, Observer] | None = None,
) -> tuple[Alarm, ...]:
    """Every certified falsification of a record, in order of time.

    With the ``observers`` of the bank each alarm carries the digest of its model.
    """
    return alarms_at(record, log.time, source, observers)


def alarms_at(
    outcome: BankRecord | Outcome,
    times: Mapping[int, float] | Array,
    source: Mapping[str, str | int | float],
    observers: Mapping[str, Observer] | None = None,
) -> tuple[Alarm, ...]:
    """As `alarms_of`, where the ``times`` [s] of some samples are known: at least those of the falsifications."""
    died = sorted((sample, name) for name, sample in outcome.died_at.items() if sample is not None)
    alarms = []
    for k, name in died:
        proof = outcome.certificates[name]
        assert proof is not None  # banks take no falsification without one
        alarms.append(alarm_of(name, k, float(times[k]), proof, source, None if observers is None else observers[name]))
    return tuple(alarms)


def alarm_of(
    name: str,
    sample: int,
    time: float,
    proof: Certificate,
    source: Mapping[str, str | int | float],
    observer: Observer | None,
) -> Alarm:
    """The alarm of a falsification; with its ``observer`` it carries the digest of its model."""
    if observer is None:
        return Alarm(name, sample, time, proof, source)
    if isinstance(observer.model, NonlinearModel):
        source = {**source, "model": NONLINEAR}
    return Alarm(name, sample, time, proof, source, digest_of_alarm(observer, proof))


def digest_of_alarm(observer: Observer, certificate: Certificate) -> str:
    """Digest of an observer's model and options with the numbers that a certificate holds of it."""
    return model_digest(observer.model, observer.options, certificate.model_data())


def source_of_bank(plant: MonitoredPlant) -> dict[str, str]:
    """Which bank an alarm comes from, as stored with it: the plant, and which of its banks if there is a choice."""
    chosen = {name: value for name, value in bank_choice(plant)._asdict().items() if value is not None}
    return {"plant": plant.name, **chosen}


def bank_of_source(source: Mapping[str, str | int | float]) -> BankChoice:
    """Which bank of its plant the source of an alarm names."""
    return BankChoice(*(None if (value := source.get(name)) is None else str(value) for name in BankChoice._fields))
