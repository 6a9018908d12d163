"""The table of a comparison as rows of text, for the terminal and for the report alike."""

from __future__ import annotations

from collections.abc import Sequence

from svo.comparison.summary import DetectorComparison, ScenarioSummary
from svo.study.tables import TextTable


def comparison_table(summaries: Sequence[DetectorComparison]) -> TextTable:
    """One distribution: false alarms, delays (median, 5-95 %), misses and alarms before the fault, width, cost."""
    scenarios = [f"{s.fault}\n{s.profile}" for s in summaries[0].scenarios]
    header = ("detector", "level", "false\nalarms", *scenarios, "width", "µs per\nsample")
    return TextTable(
        f"Delays in s (median, 5–95 %) at equal false-alarm rate, {summaries[0].distribution} noise",
        header,
        tuple(_row(s) for s in summaries),
        labels=1,
    )


def _row(s: DetectorComparison) -> tuple[str, ...]:
    alarms = f"{s.false_alarms.count}/{s.false_alarms.of}"
    width = "–" if s.width is None else f"{s.width:.2g}"
    cells = (_cell(scenario) for scenario in s.scenarios)
    return (s.detector, f"{s.level:.3g}", alarms, *cells, width, f"{s.microseconds:.2g}")


def _cell(s: ScenarioSummary) -> str:
    if s.detect is None:
        return f"–\nall {s.early.of} early"
    low, median, high = ("∞" if d is None else f"{d:.2f}" for d in (s.detect.p05, s.detect.median, s.detect.p95))
    trouble = [f"{s.missed.count} missed"] * bool(s.missed.count) + [f"{s.early.count} early"] * bool(s.early.count)
    return "\n".join([median, f"{low}–{high}", *trouble])
