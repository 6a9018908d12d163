"""What a comparison found: one line for each detector and distribution, with its delays in every scenario."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from svo.comparison.comparison import Compared
from svo.comparison.run import ComparedRun
from svo.plant import HEALTHY
from svo.study.summary import Delays, Share


@dataclass(frozen=True)
class ScenarioSummary:
    """One detector in the judged runs of one fault and profile.

    Attributes
    ----------
    detect : Delays or None
        First alarm from the fault on [s], over the runs without an alarm before it; a miss is infinite. None if there
        is no such run.
    missed : Share
        Of these runs, those without an alarm.
    early : Share
        Of all runs, those with an alarm before the fault.
    """

    fault: str
    profile: str
    detect: Delays | None
    missed: Share
    early: Share


@dataclass(frozen=True)
class DetectorComparison:
    """One detector under one distribution of the noise.

    Attributes
    ----------
    level : float
        Found by tuning (1 for bounds as stated).
    false_alarms : Share
        Judged fault-free runs with an alarm.
    scenarios : tuple of ScenarioSummary
    width : float or None
        Mean width of the detector's bounds in fault-free runs; None without sets.
    microseconds : float
        Median over all judged runs of the computing time per sample.
    """

    distribution: str
    detector: str
    level: float
    false_alarms: Share
    scenarios: tuple[ScenarioSummary, ...]
    width: float | None
    microseconds: float


def summarise(compared: Compared) -> list[DetectorComparison]:
    """One summary for each distribution and detector, in the order of the comparison."""
    found = []
    for (distribution, detector), tuned in compared.tuned.items():
        rows = [r for r in compared.rows if (r.distribution, r.detector) == (distribution, detector)]
        healthy = [r for r in rows if r.fault == HEALTHY]
        widths = [r.width for r in healthy if r.width is not None]
        scenarios = dict.fromkeys((r.fault, r.profile) for r in rows if r.fault != HEALTHY)
        found.append(
            DetectorComparison(
                distribution,
                detector,
                tuned.setting.level,
                Share(sum(r.false_alarm for r in healthy), len(healthy)),
                tuple(_scenario(key, [r for r in rows if (r.fault, r.profile) == key]) for key in scenarios),
                float(np.mean(widths)) if widths else None,
                float(np.median([r.microseconds_per_sample for r in rows])),
            )
        )
    return found


def write_runs(path: Path, rows: Sequence[ComparedRun]) -> None:
    """Write the judged runs as CSV, one row a run; what does not exist is left empty."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=[f.name for f in fields(ComparedRun)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


def _scenario(key: tuple[str, str], rows: Sequence[ComparedRun]) -> ScenarioSummary:
    clean = [r.first_alarm_s for r in rows if not r.false_alarm]
    return ScenarioSummary(
        *key,
        detect=Delays.of(clean) if clean else None,
        missed=Share(sum(alarm is None for alarm in clean), len(clean)),
        early=Share(len(rows) - len(clean), len(rows)),
    )
