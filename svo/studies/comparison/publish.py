"""From a finished comparison to what people read: two CSV files, a picture, and a few lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from svo.plant import Plant, fault_start
from svo.studies.comparison.comparison import Compared
from svo.studies.comparison.picture import plot_comparison
from svo.studies.comparison.table import ComparisonRow, comparison_table, write_runs, write_table
from svo.studies.drawing import Gallery
from svo.studies.thresholds.run import LearnsDetectors
from svo.studies.thresholds.run_figures import write_run_figures


def publish_comparison(out: Path, compared: Compared, plant: Plant, formats: Sequence[str] = ()) -> list[ComparisonRow]:
    """Write comparison.csv, runs.csv and pictures into a folder; returns the table.

    The pictures are comparison.png and, of a plant with interval detectors, runs of these (run_*.png).
    """
    out.mkdir(parents=True, exist_ok=True)
    rows = comparison_table(compared)
    write_table(out / "comparison.csv", rows)
    write_runs(out / "runs.csv", compared.rows)
    scenarios = {(row.fault, row.profile) for row in rows}
    longest = max(_seconds_after(plant, *scenario, compared.comparison.noise) for scenario in scenarios)
    figure = plot_comparison(rows, compared.comparison.rate, plant.Ts, longest)
    Gallery(out, formats).save("comparison", figure, "Detectors side by side", "")
    if isinstance(plant, LearnsDetectors):
        write_run_figures(out, plant, compared.comparison.noise, compared.comparison.seed, formats)
    return rows


def _seconds_after(plant: Plant, fault: str, profile: str, noise: str) -> float:
    """How long a run goes on from its fault on; a log need not begin at time zero."""
    log = plant.simulate(fault, profile, noise, 0)
    return float(log.time[-1]) + plant.Ts - fault_start(plant, fault, profile)


def to_text(rows: Sequence[ComparisonRow]) -> str:
    """Median delays to the first alarm / to the right isolation [s], a line a detector and distribution."""
    scenarios = list(dict.fromkeys((row.fault, row.profile) for row in rows))
    table: dict[tuple[str, str], dict[tuple[str, str], ComparisonRow]] = {}
    for row in rows:
        table.setdefault((row.distribution, row.detector), {})[row.fault, row.profile] = row
    width = max(len(row.detector) for row in rows)
    head = f"{'':8}  {'':{width}}  {'false':>6}  {'us':>5}  " + "  ".join(f"{f'{f} {p}':>14}" for f, p in scenarios)
    lines = ["median seconds to the first alarm / to isolate the right fault; - where half of the runs do not", head]
    for (distribution, detector), cells in table.items():
        one = next(iter(cells.values()))
        cost = sorted(row.microseconds_per_sample for row in cells.values())[len(cells) // 2]
        times = "  ".join(f"{_cell(cells[scenario]):>14}" for scenario in scenarios)
        alarms = f"{100 * one.false_alarms.value:.1f}%"
        lines.append(f"{distribution:8}  {detector:{width}}  {alarms:>6}  {cost:5.0f}  {times}")
    return "\n".join(lines)


def _cell(row: ComparisonRow) -> str:
    return f"{_seconds(row.detect.median)} / {_seconds(row.isolate.median)}"


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
