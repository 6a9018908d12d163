"""Detection on a log in a file, portion by portion: what it needs does not grow with the log."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from svo.detection.bank_alarms import KEPT_SCHEDULES, alarms_at, source_of_bank, with_intervals
from svo.detection.findings import ChangeAt, Findings
from svo.detection.thresholds import DetectsThresholds
from svo.interval.on_log import ThresholdDetection
from svo.isolation import Alarm, Bank, Outcome
from svo.logs.log import Log
from svo.logs.portions import joined
from svo.plant import MonitoredPlant, chosen_noise
from svo.plant.dialects import on_log
from svo.plant.long_log import LongLog
from svo.plant.scheduling import Scheduler, scheduled


@dataclass(frozen=True, eq=False, repr=False)
class StreamedDetection(Findings):
    """What a plant's bank found in a log that was not kept; as a `svo.detection.found.Detection` without a record.

    Attributes
    ----------
    plant : MonitoredPlant
    noise : str
        The noise set whose bounds were assumed.
    log : LongLog
    outcome : Outcome
    times : mapping of int to float
        Of the samples that the outcome names [s].
    alarms : tuple of Alarm
        Every certified falsification, in order of time.
    thresholds : ThresholdDetection or None
        What an interval detector beside the bank says, if the plant has one; it is no proof.
    """

    plant: MonitoredPlant
    noise: str
    log: LongLog
    outcome: Outcome
    times: Mapping[int, float]
    alarms: tuple[Alarm, ...]
    thresholds: ThresholdDetection | None = None

    @property
    def samples(self) -> int:
        return self.log.samples

    @property
    def detected_s(self) -> float | None:
        return self._at(self.outcome.detected_at)

    @property
    def isolated_s(self) -> float | None:
        return self._at(self.outcome.isolated_at)

    @property
    def fault(self) -> str | None:
        return self.outcome.fault

    @property
    def undecided(self) -> int:
        return self.outcome.undecided

    @property
    def reason(self) -> str | None:
        return self.outcome.reason

    @property
    def stopped(self) -> int:
        return self.outcome.stopped

    @property
    def changes(self) -> tuple[ChangeAt, ...]:
        return tuple(ChangeAt(self.times[c.sample], c.state, c.alive) for c in self.outcome.changes)

    def _at(self, sample: int | None) -> float | None:
        return None if sample is None else self.times[sample]


def detect_streamed(
    plant: MonitoredPlant,
    log: LongLog,
    noise: str | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> StreamedDetection:
    """What `svo.detect` finds in a log, read portion by portion; its alarms are the same to the byte.

    Parameters
    ----------
    plant : MonitoredPlant
    log : LongLog
        As `svo.plant.long_log.survey_log` gives it for this plant.
    noise : str, optional
        Noise set whose bounds the observers assume; by default the plant's first.
    progress : callable, optional
        Called with (samples done, samples in all) as they are done.

    Raises
    ------
    ValueError
        For an unknown noise set, and a file that is no more what it was.
    """
    noise = chosen_noise(plant, noise)
    # First, for it takes no time, and what it may refuse would cost the bank's answer.
    asked = isinstance(plant, DetectsThresholds) and plant.has_thresholds
    thresholds = plant.detect_thresholds(joined(list(log.portions()))) if asked else None  # type: ignore[attr-defined]
    bank = on_log(plant, log).bank(noise)
    outcome, times, schedules = Outcome(bank.names), dict[int, float](), _Schedules()
    for portion, done in follow_portions(bank, plant.scheduler(), log.portions(), outcome):
        times |= _times(outcome, portion, done)
        schedules.add(outcome, portion, done)
        if progress is not None:
            progress(done, log.samples)
    source = {**source_of_bank(plant), "noise": noise, "log": log.path.name}
    alarms = alarms_at(outcome, times, source, bank.observers, schedules.of_alarms)
    if log.kept is not None:
        alarms = with_intervals(alarms, log.kept)
    return StreamedDetection(plant, noise, log, outcome, times, alarms, thresholds)


def follow_portions(
    bank: Bank, scheduler: Scheduler, portions: Iterable[Log], outcome: Outcome
) -> Iterator[tuple[Log, int]]:
    """Drive a fresh bank over a log; ``outcome`` learns what it says.

    After each portion this gives it, with its schedule and the last sample of the one before in front, and how many
    samples are done.
    """
    before: Log | None = None
    done = 0
    for portion in portions:
        log = scheduled(scheduler, portion)
        if before is not None:
            log = joined([before, log])
        start = 0 if before is None else 1
        for verdict, samples in bank.follow(log, start=start):
            outcome.add(verdict, samples)
        done += len(log) - start
        yield log, done
        before = _last_sample(log)


class _Schedules:
    """Scheduling values of the samples that alarms are about, of those that are still known where they are raised."""

    def __init__(self) -> None:
        self.of_alarms: dict[int, float] = {}
        self._recent: dict[int, float] = {}

    def add(self, outcome: Outcome, portion: Log, done: int) -> None:
        """A portion of the log that ends with sample ``done`` - 1."""
        if portion.schedule is None or portion.schedule.ndim != 1:
            return
        first = done - len(portion)
        self._recent |= enumerate(portion.schedule.tolist(), start=first)
        for name, k in outcome.died_at.items():
            proof = outcome.certificates.get(name)
            if k is not None and k >= first and proof is not None:
                about = range(k + 1 - len(proof.samples), k + 1)
                self.of_alarms |= {i: self._recent[i] for i in about if i in self._recent}
        self._recent = {i: value for i, value in self._recent.items() if i >= done - KEPT_SCHEDULES}


def _last_sample(log: Log) -> Log:
    schedule = None if log.schedule is None else log.schedule[-1:]
    return replace(log, time=log.time[-1:], u=log.u[-1:], y=log.y[-1:], x=None, schedule=schedule)


def _times(outcome: Outcome, portion: Log, done: int) -> dict[int, float]:
    """Times of the samples that an outcome names, those in a portion that ends with sample ``done`` - 1."""
    first = done - len(portion)
    named = [*outcome.died_at.values(), *(c.sample for c in outcome.changes), outcome.detected_at, outcome.isolated_at]
    return {k: float(portion.time[k - first]) for k in named if k is not None and k >= first}
