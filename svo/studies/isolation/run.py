"""One run of a study: simulate, drive the isolation bank over the log, say what happened."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from svo.detection.bank_alarms import alarms_of, source_of_bank
from svo.indices import judge_alarm
from svo.isolation import Alarm, BankRecord
from svo.logs.log import Log
from svo.plant import HEALTHY, BankChoice, Plant, first_faulty_sample, with_bank
from svo.studies.configuration import Job
from svo.studies.isolation.exemplar import Exemplar, follow
from svo.studies.runs import registered_plant


@dataclass(frozen=True)
class RunRow:
    """One row of the run table. Delays that were not reached within the run are None.

    Of a run that failed it has what was asked for and the error, and None for the rest.

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
    false_alarm : bool or None
        The nominal model was falsified before the fault (at any time, without one).
    wrong_isolation : bool or None
        The true fault's observer was falsified, or another one was left alone.
    alive_end : str or None
        Models alive at the end of the run, separated by ", ".
    microseconds_per_step, microseconds_p99 : float or None
        Median and 99th percentile over the observers that were alive and the samples.
    undecided : int or None
        Answers of observers that were neither a proof nor a point: solver trouble, never an alarm.
    stopped : int or None
        Programs of observers that ended at a limit, so that sets are wider.
    architecture : str or None
        Of the bank; None for a plant that has one kind of bank only.
    models : str or None
        Kind of the observers' models, likewise.
    error : str or None
        Why the run failed; None if it did not.
    """

    run: int
    seed: int
    fault: str
    profile: str
    noise: str
    first_alarm_s: float | None = None
    detection_delay_s: float | None = None
    isolation_delay_s: float | None = None
    isolated_as: str | None = None
    false_alarm: bool | None = None
    wrong_isolation: bool | None = None
    alive_end: str | None = None
    microseconds_per_step: float | None = None
    microseconds_p99: float | None = None
    undecided: int | None = None
    stopped: int | None = None
    architecture: str | None = None
    models: str | None = None
    error: str | None = None

    @classmethod
    def failed(cls, job: Job, error: str) -> RunRow:
        """The row of a run that failed."""
        return cls(job.run, job.seed, job.fault, job.profile, job.noise, error=error, **job.bank._asdict())

    @property
    def bank(self) -> BankChoice:
        """Which of the plant's banks it was."""
        return BankChoice(self.architecture, self.models)


@dataclass(frozen=True)
class RunOutcome:
    """A run's row, its certified alarms, and the samples for the pictures if the run is exemplary."""

    row: RunRow
    alarms: tuple[Alarm, ...]
    exemplar: Exemplar | None


def run_registered(plant: str, job: Job) -> RunOutcome:
    """One run of a registered plant, in whatever process."""
    return execute(registered_plant(plant), job)


def execute(plant: Plant, job: Job) -> RunOutcome:
    """Simulate one run and judge it; bit for bit the same for the same job, times of computation aside."""
    plant = with_bank(plant, job.bank)
    log = plant.simulate(job.fault, job.profile, job.noise, job.seed)
    bank = plant.bank(job.noise)
    record = bank.run(log)
    exemplar = follow(plant, job, log, record.alive) if job.exemplary else None
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
        stopped=int(record.stopped.sum()),
        **job.bank._asdict(),
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
