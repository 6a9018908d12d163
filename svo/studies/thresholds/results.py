"""From a finished study of interval detectors to what people read: summary.csv, pictures and report.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from svo.pages.tables import TextTable
from svo.plant import HEALTHY
from svo.studies.page import Picture, Report, study_command, write_page
from svo.studies.runs import finished_runs, publish_beside
from svo.studies.statistics import Share
from svo.studies.store import StudyStore
from svo.studies.thresholds import tables
from svo.studies.thresholds.figures import write_pictures
from svo.studies.thresholds.run import LEARNING_RECORDS, LearnsDetectors
from svo.studies.thresholds.runner import read_rows
from svo.studies.thresholds.summary import (
    AssumptionSummary,
    DetectorSummary,
    learning_records,
    summarise,
    summarise_assumption,
    write_summary,
)

_GLOSSARY = {
    "alarm": "The filtered residual is beyond its threshold. It is a statistical alarm, not a proof: it rests on "
    "assumption (7), that the noise keeps to what was learnt.",
    "detection time": "Time of the first alarm at or after the first faulty sample, on the clock of the run.",
    "median (5–95 %)": "Over all runs; ∞ where the quantile falls among runs without an alarm.",
    "learning records": "Fault-free runs of the learning scenario, new ones for every run, from which the detector is "
    "made with the paper's safety factor.",
    "false alarm": "An alarm before the fault, or at any time in a fault-free run. Intervals of shares are exact 95 % "
    "intervals (Clopper and Pearson).",
}


@dataclass(frozen=True)
class DetectionStudy:
    """A finished study: its summaries, and its tables and findings as text."""

    summaries: list[DetectorSummary]
    assumption: list[AssumptionSummary]
    tables: list[TextTable]
    findings: list[str]

    def to_dict(self) -> dict[str, Any]:
        """All of it as plain data, for JSON."""
        return {
            "summary": [_plain(s) for s in self.summaries],
            "assumption": [
                {
                    "noise": s.noise,
                    "records": s.records,
                    "alarmed": _share(s.alarmed),
                    "violated": _share(s.runs),
                    "by_window": {str(q): count for q, count in s.by_window.items()},
                }
                for s in self.assumption
            ],
        }


def publish(
    folder: StudyStore[Any], plant: LearnsDetectors, without_damaged: bool = False, formats: Sequence[str] = ()
) -> DetectionStudy:
    """Write summary.csv, the pictures and report.html into the study's folder; errors as `StudyStore.rows`."""
    every = read_rows(folder, without_damaged)
    rows = finished_runs(every)
    summaries, assumption = summarise(plant, rows), summarise_assumption(rows)
    write_summary(folder.path / "summary.csv", summaries)
    windows = max((q for s in assumption for q in s.by_window), default=1)
    pictures = write_pictures(folder.path, plant, summaries, assumption, windows, formats)
    groups = [
        [s for s in summaries if (s.noise, s.records) == key]
        for key in dict.fromkeys((s.noise, s.records) for s in summaries)
    ]
    study = DetectionStudy(
        summaries,
        assumption,
        [tables.detection_table(plant, group) for group in groups],
        [*publish_beside(folder, plant, every), *tables.assumption_lines(assumption), *_before_the_fault(summaries)],
    )
    _write_report(folder.path / "report.html", plant, folder.identity(), study, pictures)
    return study


def _before_the_fault(summaries: Sequence[DetectorSummary]) -> list[str]:
    lines = []
    for records in LEARNING_RECORDS:
        faulty = [s for s in summaries if s.fault != HEALTHY and s.records == records]
        if faulty:
            alarmed, runs = (sum(getattr(s.false_alarms, n) for s in faulty) for n in ("count", "of"))
            reached = sum(s.detect.reached.count for s in faulty)
            lines.append(
                f"faulty runs, all detectors, {learning_records(records)}: detected "
                f"{reached} of {runs}, alarm before the fault in {alarmed} of {runs}"
            )
    return lines


def _write_report(
    path: Path, plant: LearnsDetectors, identity: Mapping[str, Any], study: DetectionStudy, pictures: Sequence[Picture]
) -> None:
    configuration = identity["configuration"]
    report = Report(
        f"{configuration['runs']} runs of each scenario, seed {configuration['seed']}",
        study.findings,
        study.tables,
        f"Paper: {plant.reference_title}.",
        pictures,
        _GLOSSARY,
        study_command(plant, configuration),
        configuration,
        identity["versions"],
    )
    write_page(path, f"Study of interval detectors: {plant.title}", report=report)


def _plain(s: DetectorSummary) -> dict[str, Any]:
    names = ("noise", "fault", "profile", "records", "detector")
    times = {f"{q}_s": s.time_of(getattr(s.detect, q)) for q in ("median", "p05", "p95")}
    return (
        {name: getattr(s, name) for name in names}
        | times
        | {"paper_s": s.paper, "detected": _share(s.detect.reached), "false_alarms": _share(s.false_alarms)}
    )


def _share(share: Share) -> dict[str, Any]:
    return {"count": share.count, "of": share.of, "interval": list(share.interval)}
