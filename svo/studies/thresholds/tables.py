"""The tables of a study of interval detectors as rows of text, for the terminal and for the report alike."""

from __future__ import annotations

from collections.abc import Sequence

from svo.pages.tables import TextTable
from svo.plant import HEALTHY
from svo.studies.statistics import Share
from svo.studies.thresholds.run import LearnsDetectors
from svo.studies.thresholds.summary import AssumptionSummary, DetectorSummary, learning_records

NEVER = "∞"
_MOST_RANGES = 8


def detection_table(plant: LearnsDetectors, summaries: Sequence[DetectorSummary]) -> TextTable:
    """Detection times of one noise set and number of records: median and 5-95 % over all runs, and the paper's.

    Times are those of the run's clock, in seconds; an infinity sign where the quantile falls among runs without an
    alarm.
    """
    faulty = [s for s in summaries if s.fault != HEALTHY]
    detectors = list(dict.fromkeys(s.detector for s in summaries))
    rows = []
    for fault, profile in dict.fromkeys((s.fault, s.profile) for s in faulty):
        group = {s.detector: s for s in faulty if (s.fault, s.profile) == (fault, profile)}
        first = group[detectors[0]]
        rows.append((plant.label(fault, profile), f"{first.start:g}", *(_cell(group[d]) for d in detectors)))
    healthy = {s.detector: s for s in summaries if s.fault == HEALTHY}
    if healthy:
        cells = (f"{healthy[d].false_alarms.count}/{healthy[d].false_alarms.of}" for d in detectors)
        rows.append(("no fault: runs with an alarm", "", *cells))
    records = learning_records(summaries[0].records)
    title = f"Detection times in s, {summaries[0].noise} noise, {records}: median, 5–95 %, paper"
    return TextTable(title, ("scenario", "fault\nat", *detectors), tuple(rows), labels=1)


def assumption_lines(summaries: Sequence[AssumptionSummary]) -> list[str]:
    """What became of assumption (7) and of the promise of no false alarm in fault-free runs."""
    return [
        f"{s.noise} noise, {learning_records(s.records)}: fault-free runs with an alarm of any detector "
        f"{_with_interval(s.alarmed)}; assumption (7) fails at some q in {_with_interval(s.runs)}{_windows(s)}"
        for s in summaries
    ]


def _cell(s: DetectorSummary) -> str:
    low, median, high = (
        NEVER if time is None else f"{time:.2f}"
        for time in map(s.time_of, (s.detect.p05, s.detect.median, s.detect.p95))
    )
    paper = "" if s.paper is None else f"\npaper {s.paper:.2f}"
    return f"{median}\n{low}–{high}{paper}"


def _with_interval(share: Share) -> str:
    low, high = share.interval
    return f"{share.count} of {share.of} ({low:.1%} to {high:.1%})"


def _windows(s: AssumptionSummary) -> str:
    """Where it fails most, as ranges of q that fail in at least half as many runs as the worst q."""
    if not s.by_window:
        return ""
    worst = max(s.by_window.values())
    often = [q for q, count in s.by_window.items() if 2 * count >= worst]
    ranges: list[tuple[int, int]] = []
    for q in often:
        if ranges and q == ranges[-1][1] + 1:
            ranges[-1] = (ranges[-1][0], q)
        else:
            ranges.append((q, q))
    shown = ", ".join(f"{a}" if a == b else f"{a}–{b}" for a, b in ranges[:_MOST_RANGES])
    more = ", ..." if len(ranges) > _MOST_RANGES else ""
    every = f"q from {min(s.by_window)} to {max(s.by_window)}, {len(s.by_window)} of them"
    return f" ({every}; most often, in up to {worst} runs, at q = {shown}{more})"
