"""One run of a study: simulate, drive the isolation bank over the log, say what happened."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import numpy as np

from svo.detection.detect import alarms_of, source_of_bank
from svo.indices import judge_alarm
from svo.isolation.alarms import Alarm
from svo.isolation.record import BankRecord
from svo.logs.log import Log
from svo.plant import HEALTHY, Plant, first_faulty_sample, in_architecture, load_plant
from svo.studies.configuration import Job
from svo.studies.isolation.exemplar import Exemplar, follow


@dataclass(frozen=True)
class RunRow:
    """One row of the run table. Delays that were not reached within the run are None.

    Attributes
    ----------
    run, seed : int
        Number of the run and its own seed.
    fault, profile, noise : str
        What was simulated; "none" without a fault.
    first_alarm_s : float or None
        Time of the first falsification of the nominal model [s].
    detection_delay_s, isolation_delay_s : float or None
        Counted from the first faulty sample, which itself counts as one sampling time: t_alarm - t_fault + Ts.
        Isolation is that of the true fault; an alarm before the fault is a false alarm and no detection.
    isolated_as : str or None
        The fault whose observer was left alone.
    false_alarm : bool
        The nominal model was falsified before the fault (at any time, without one).
    wrong_isolation : bool
        The true fault's observer was falsified, or another one was left alone.
    alive_end : str
        Models alive at the end of the run, separated by ", ".
    microseconds_per_step, microseconds_p99 : float
        Median and 99th percentile over the observers that were alive and the samples.
    undecided : int
        Answers of observers that were neither a proof nor a point: solver trouble, never an alarm.
    architecture : str or None
        Of the bank; None for a plant that has one kind of bank only.
    """

    run: int
    seed: int
    fault: str
    profile: str
    noise: str
    first_alarm_s: float | None
    detection_delay_s: float | None
    isolation_delay_s: float | None
    isolated_as: str | None
    false_alarm: bool
    wrong_isolation: bool
    alive_end: str
    microseconds_per_step: float
    microseconds_p99: float
    undecided: int
    architecture: str | None = None


@dataclass(frozen=True)
class RunOutcome:
    """A run's row, its certified alarms, and the samples for the pictures if the run is exemplary."""

    row: RunRow
    alarms: tuple[Alarm, ...]
    exemplar: Exemplar | None


@cache
def registered_plant(name: str) -> Plant:
    """A plant by its name; loaded once a process, since its tables may take a while."""
    return load_plant(name)


def run_registered(plant: str, job: Job) -> RunOutcome:
    """One run of a registered plant, in whatever process; RuntimeError that names the run if it fails."""
    with failure_named(job):
        return execute(registered_plant(plant), job)


@contextmanager
def failure_named(job: Job) -> Iterator[None]:
    """Turn what a run raises into a RuntimeError that names the run."""
    try:
        yield
    except Exception as error:
        where = f"fault {job.fault}, profile {job.profile}, noise {job.noise}, seed {job.seed}"
        raise RuntimeError(f"run {job.run} ({where}) failed: {type(error).__name__}: {error}") from error


def execute(plant: Plant, job: Job) -> RunOutcome:
    """Simulate one run and judge it; bit for bit the same for the same job, times of computation aside."""
    plant = in_architecture(plant, job.architecture)
    log = plant.simulate(job.fault, job.profile, job.noise, job.seed)
    bank = plant.bank(job.noise)
    record = bank.run(log)
    exemplar = follow(plant, job, log) if job.exemplary else None
    alarms = alarms_of(record, log, source_of(plant, job), bank.observers)
    return RunOutcome(judge(plant, job, log, record), alarms, exemplar)


def judge(plant: Plant, job: Job, log: Log, record: BankRecord) -> RunRow:
    """The row of a run, from the record of its bank."""
    healthy = job.fault == HEALTHY
    first_faulty = first_faulty_sample(plant, job.fault, job.profile, log.time)
    detected, isolated = record.detected_at, record.isolated_at
    found = judge_alarm(detected, first_faulty, plant.Ts)
    isolated_as = record.fault if isolated is not None else None
    true_died = not healthy and record.died_at[job.fault] is not None
    rightly = isolated if isolated_as == job.fault else None
    seconds = record.seconds[~np.isnan(record.seconds)]  # a falsified observer is no longer stepped
    return RunRow(
        run=job.run,
        seed=job.seed,
        fault=job.fault,
        profile=job.profile,
        noise=job.noise,
        first_alarm_s=None if detected is None else float(log.time[detected]),
        detection_delay_s=found.delay,
        isolation_delay_s=judge_alarm(rightly, first_faulty, plant.Ts).delay,
        isolated_as=isolated_as,
        false_alarm=found.false_alarm,
        wrong_isolation=true_died or (isolated_as is not None and isolated_as != job.fault),
        alive_end=", ".join(name for name, alive in zip(record.names, record.alive[-1], strict=True) if alive),
        microseconds_per_step=float(np.median(seconds) * 1e6),
        microseconds_p99=float(np.quantile(seconds, 0.99) * 1e6),
        undecided=int(record.undecided.sum()),
        architecture=job.architecture,
    )


def source_of(plant: Plant, job: Job) -> dict[str, str | int | float]:
    """Where the alarms of a run come from, as stored with them."""
    return {
        **source_of_bank(plant),
        "fault": job.fault,
        "profile": job.profile,
        "noise": job.noise,
        "seed": job.seed,
        "run": job.run,
    }
