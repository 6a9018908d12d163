"""One run of a study of interval detectors: learn from fault-free records, then look for the fault in another run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from svo.indices import first_true, judge_alarm
from svo.interval.detector import IntervalDetector
from svo.interval.noise import NoiseCharacterization
from svo.logs.log import Log
from svo.plant import HEALTHY, Plant, first_faulty_sample
from svo.studies.configuration import Job

LEARNING_RECORDS = (1, 5)


@runtime_checkable
class LearnsDetectors(Plant, Protocol):
    """A plant whose study is one of interval detectors, not of an isolation bank.

    Attributes
    ----------
    detection_reference : mapping of (fault, profile) to mapping of detector to float
        A paper's detection times [s], printed beside ours; may be empty.
    """

    @property
    def detection_reference(self) -> Mapping[tuple[str, str], Mapping[str, float]]: ...

    def label(self, fault: str, profile: str) -> str:
        """A scenario in words."""
        ...

    def learning_log(self, noise: str, seed: int | np.random.SeedSequence) -> Log:
        """A fault-free record to learn from."""
        ...

    def characterise(self, records: Sequence[Log]) -> NoiseCharacterization:
        """The noise of the residual in fault-free records."""
        ...

    def residual(self, log: Log) -> NDArray[np.float64]:
        """The unfiltered residual of a run, (K,)."""
        ...

    def interval_detectors(self, noise: NoiseCharacterization, first_command: float) -> Mapping[str, IntervalDetector]:
        """The detectors of the study by name, for a run that starts with this command."""
        ...


@dataclass(frozen=True)
class DetectorRow:
    """A row of the run table: one detector in one run.

    Attributes
    ----------
    run, seed : int
        Number of the run and its own seed: ``svo simulate`` with it makes the same log.
    fault, profile, noise : str
        What was simulated; "none" without a fault.
    records : int
        Fault-free records that the noise was learnt from.
    detector : str
    first_alarm_s : float or None
        Time of the first alarm of the run [s].
    detection_delay_s : float or None
        From the first faulty sample, which itself counts as one sampling time, to that alarm; None if there is none,
        or if it came before the fault: that is a false alarm and no detection.
    false_alarm : bool or None
        An alarm before the fault (at any time, without one).
    violated : tuple of int
        Window lengths q at which the run's fault-free residual exceeds what was learnt: assumption (7) fails there.
        Empty in runs with a fault.
    error : str or None
        Why the run failed; its only row then has no records, no detector, and None for what they would have said.
    """

    run: int
    seed: int
    fault: str
    profile: str
    noise: str
    records: int
    detector: str
    first_alarm_s: float | None
    detection_delay_s: float | None
    false_alarm: bool | None
    violated: tuple[int, ...]
    error: str | None = None

    @classmethod
    def failed(cls, job: Job, error: str) -> DetectorRow:
        """The only row of a run that failed."""
        return cls(job.run, job.seed, job.fault, job.profile, job.noise, 0, "", None, None, None, (), error)


def execute(plant: LearnsDetectors, job: Job) -> list[DetectorRow]:
    """Learn and judge every detector once for each number of records; the same rows for the same job.

    The records' seeds are spawned from that of the run; the first of them is the only one of the smallest number.
    """
    log: Log = plant.simulate(job.fault, job.profile, job.noise, job.seed)
    seeds = np.random.SeedSequence(job.seed).spawn(max(LEARNING_RECORDS))
    records = [plant.learning_log(job.noise, seed) for seed in seeds]
    healthy = job.fault == HEALTHY
    rows = []
    for count in LEARNING_RECORDS:
        noise = plant.characterise(records[:count])
        violated = tuple(noise.check(plant.residual(log)).violated.tolist()) if healthy else ()
        for name, detector in plant.interval_detectors(noise, float(log.u[0, 0])).items():
            alarm = detector.run(log).exceeded
            rows.append(judge(plant, job, log, count, name, alarm, violated))
    return rows


def judge(
    plant: LearnsDetectors,
    job: Job,
    log: Log,
    records: int,
    detector: str,
    alarm: NDArray[np.bool_],
    violated: tuple[int, ...],
) -> DetectorRow:
    first = first_true(alarm)
    found = judge_alarm(first, first_faulty_sample(plant, job.fault, job.profile, log.time), plant.Ts)
    return DetectorRow(
        run=job.run,
        seed=job.seed,
        fault=job.fault,
        profile=job.profile,
        noise=job.noise,
        records=records,
        detector=detector,
        first_alarm_s=None if first is None else float(log.time[first]),
        detection_delay_s=found.delay,
        false_alarm=found.false_alarm,
        violated=violated,
    )
