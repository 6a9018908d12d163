"""One table of a comparison: a row for each distribution, detector and scenario."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from svo.detectors.detector import Kind
from svo.plant import HEALTHY
from svo.store import write_csv
from svo.studies.comparison.comparison import Compared
from svo.studies.comparison.run import ComparedRun
from svo.studies.comparison.tuning import Tuned
from svo.studies.statistics import Delays, Share, grouped


@dataclass(frozen=True)
class ComparisonRow:
    """What one detector did in one scenario.

    Attributes
    ----------
    distribution, detector, kind, fault, profile : str
    false_alarms : Share
        Of the judged runs WITHOUT a fault of this distribution; the same in every row of a detector.
    detect : Delays
        To the first alarm from the fault on; None where there was none, or one before the fault: that is a false
        alarm and no detection.
    settled : Delays
        To the last switch from false to true (section 2.4): an alarm that drops out again is not settled.
    non_detection_rate : float or None
        Mean share of the time from the fault on without an alarm.
    isolate : Delays
        To the right fault's first naming.
    wrong_isolations : Share
        Runs in which the first fault named is another one.
    microseconds_per_sample : float
        Median over the runs; CPU time.
    width : float or None
        Mean width of the detector's bounds.
    tuned : Tuned
    """

    distribution: str
    detector: str
    kind: Kind
    fault: str
    profile: str
    false_alarms: Share
    detect: Delays
    settled: Delays
    non_detection_rate: float | None
    isolate: Delays
    wrong_isolations: Share
    microseconds_per_sample: float
    width: float | None
    tuned: Tuned

    def to_dict(self) -> dict[str, Any]:
        """As a flat mapping of the columns of the CSV; None where something does not exist."""
        low, high = self.false_alarms.interval
        setting = self.tuned.setting
        return {
            "noise": self.distribution,
            "detector": self.detector,
            "kind": self.kind,
            "fault": self.fault,
            "profile": self.profile,
            "fault_free_runs": self.false_alarms.of,
            "false_alarms": self.false_alarms.count,
            "false_alarms_low": low,
            "false_alarms_high": high,
            "runs": self.detect.reached.of,
            **_times("first_alarm", self.detect),
            **_times("settled", self.settled),
            "non_detection_rate": self.non_detection_rate,
            **_times("isolated", self.isolate),
            "wrong_isolations": self.wrong_isolations.count,
            "microseconds_per_sample": self.microseconds_per_sample,
            "width": self.width,
            "level": setting.level,
            "parameters": json.dumps(dict(setting.parameters)),
        }


def comparison_table(compared: Compared) -> list[ComparisonRow]:
    """Rows in the order of distributions, detectors and scenarios; runs that failed are left out."""
    groups = grouped(compared.rows, "distribution", "detector", "fault", "profile")
    healthy = {key[:2]: runs for key, runs in groups.items() if key[2] == HEALTHY}
    return [
        _row(key, runs, healthy[key[:2]], compared.kinds[key[1]], compared.tuned[key[:2]])
        for key, runs in groups.items()
        if key[2] != HEALTHY and key[:2] in healthy
    ]


def write_table(path: Path, rows: Sequence[ComparisonRow]) -> None:
    """Write the table as CSV; what does not exist is left empty."""
    write_csv(path, [row.to_dict() for row in rows])


def write_runs(path: Path, runs: Iterable[ComparedRun]) -> None:
    """Write every judged run as CSV."""
    write_csv(path, [asdict(run) for run in runs], [field.name for field in fields(ComparedRun)])


def _row(
    key: tuple[str, str, str, str],
    runs: Sequence[ComparedRun],
    healthy: Sequence[ComparedRun],
    kind: Kind,
    tuned: Tuned,
) -> ComparisonRow:
    distribution, detector, fault, profile = key
    widths = [run.width for run in runs if run.width is not None]
    missed = [run.non_detection_rate for run in runs if run.non_detection_rate is not None]
    return ComparisonRow(
        distribution,
        detector,
        kind,
        fault,
        profile,
        false_alarms=Share.true([run.false_alarm for run in healthy]),
        detect=Delays.of([None if run.false_alarm else run.first_alarm_s for run in runs]),
        settled=Delays.of([run.delay_s for run in runs]),
        non_detection_rate=float(np.mean(missed)) if missed else None,
        isolate=Delays.of([run.isolation_delay_s for run in runs]),
        wrong_isolations=Share.true([run.isolated_as not in (None, fault) for run in runs]),
        microseconds_per_sample=float(np.median([run.microseconds_per_sample or 0.0 for run in runs])),
        width=float(np.mean(widths)) if widths else None,
        tuned=tuned,
    )


def _times(name: str, delays: Delays) -> dict[str, Any]:
    return {
        name: delays.reached.count,
        f"{name}_mean_s": delays.mean,
        f"{name}_median_s": delays.median,
        f"{name}_p05_s": delays.p05,
        f"{name}_p95_s": delays.p95,
    }
