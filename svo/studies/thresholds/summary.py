"""Statistics of a study of interval detectors: detection times, false alarms, and where assumption (7) fails."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from svo.plant import HEALTHY, fault_start
from svo.store import write_csv
from svo.studies.statistics import Delays, Share, grouped
from svo.studies.thresholds.run import DetectorRow, LearnsDetectors

_HEADER = (
    *("noise", "fault", "profile", "records", "detector", "runs", "detected_runs"),
    *("median_s", "p05_s", "p95_s", "paper_s"),
    *("false_alarm_runs", "false_alarm_share", "false_alarm_low", "false_alarm_high"),
)


def learning_records(count: int) -> str:
    """How many there are, in words."""
    return f"{count} learning record{'s' * (count > 1)}"


@dataclass(frozen=True)
class DetectorSummary:
    """What one detector did in the runs of one noise set, fault and profile, learnt from so many records.

    Attributes
    ----------
    detect : Delays
    false_alarms : Share
    start : float
        Time of the first faulty sample [s].
    Ts : float
        Sampling time [s].
    paper : float or None
        Detection time that a paper gives [s].
    """

    noise: str
    fault: str
    profile: str
    records: int
    detector: str
    detect: Delays
    false_alarms: Share
    start: float
    Ts: float
    paper: float | None

    def time_of(self, delay: float | None) -> float | None:
        """The alarm's time in the run [s] of a delay; None of None."""
        return None if delay is None else self.start + delay - self.Ts


@dataclass(frozen=True)
class AssumptionSummary:
    """Fault-free runs of one noise set that break assumption (7), learnt from so many records.

    Attributes
    ----------
    runs : Share
        Runs in which any q fails.
    alarmed : Share
        Runs in which any detector raises an alarm.
    by_window : mapping of int to int
        For each q that fails in some run, in how many.
    """

    noise: str
    records: int
    runs: Share
    alarmed: Share
    by_window: dict[int, int]


def summarise(plant: LearnsDetectors, rows: Iterable[DetectorRow]) -> list[DetectorSummary]:
    """One summary per noise set, fault, profile, number of records and detector, in the order of their first runs.

    Runs that failed are left out.
    """
    groups = grouped(rows, "noise", "fault", "profile", "records", "detector")
    return [
        DetectorSummary(
            noise,
            fault,
            profile,
            records,
            detector,
            detect=Delays.of([row.detection_delay_s for row in group]),
            false_alarms=Share.true([row.false_alarm for row in group]),
            start=fault_start(plant, fault, profile),
            Ts=plant.Ts,
            paper=plant.detection_reference.get((fault, profile), {}).get(detector),
        )
        for (noise, fault, profile, records, detector), group in groups.items()
    ]


def summarise_assumption(rows: Iterable[DetectorRow]) -> list[AssumptionSummary]:
    """One summary per noise set and number of records, of the fault-free runs; empty if there are none."""
    found = []
    for (noise, records), healthy in grouped((r for r in rows if r.fault == HEALTHY), "noise", "records").items():
        runs = grouped(healthy, "run")
        violated = [group[0].violated for group in runs.values()]
        found.append(
            AssumptionSummary(
                noise,
                records,
                runs=Share.true([bool(v) for v in violated]),
                alarmed=Share.true([any(row.false_alarm for row in group) for group in runs.values()]),
                by_window=dict(sorted(Counter(q for v in violated for q in v).items())),
            )
        )
    return found


def write_summary(path: Path, summaries: Sequence[DetectorSummary]) -> None:
    """Write summaries as CSV, one row a detector and condition; what does not exist is left empty."""
    rows = []
    for s in summaries:
        times = [s.time_of(d) for d in (s.detect.median, s.detect.p05, s.detect.p95)]
        share = [s.false_alarms.count, s.false_alarms.value, *s.false_alarms.interval]
        row = [s.noise, s.fault, s.profile, s.records, s.detector, s.detect.reached.of, s.detect.reached.count]
        rows.append(dict(zip(_HEADER, [*row, *times, s.paper, *share], strict=True)))
    write_csv(path, rows, _HEADER)
