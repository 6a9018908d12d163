"""The comparison on the elevator: what is published of rows made by hand, and the words of the command."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from svo.cli import app
from svo.detectors.detector import Setting
from svo.plant import load_plant
from svo.studies.comparison.comparison import Compared, Comparison
from svo.studies.comparison.publish import publish_comparison
from svo.studies.comparison.run import ComparedRun
from svo.studies.comparison.tuning import Tuned


def row(fault: str, profile: str, alarm: float | None) -> ComparedRun:
    blank = (None, None, None, None, 2.0, 0.1)
    return ComparedRun("bounded", "interval, a = 0.9", fault, profile, 0, alarm, alarm, False, *blank)


def test_the_paper_s_figures_are_drawn_beside_the_comparison(tmp_path: Path) -> None:
    rows = [row("none", "none", None), row("jam", "steady", 0.5), row("jam", "moving", None)]
    tuned = {("bounded", "interval, a = 0.9"): Tuned(Setting(1.25), 0.0, 1)}
    compared = Compared(Comparison("elevator", "quiet"), {"interval, a = 0.9": "threshold"}, tuned, rows)
    table = publish_comparison(tmp_path, compared, load_plant("elevator"))
    assert [(r.fault, r.profile, r.detect.reached.count) for r in table] == [("jam", "steady", 1), ("jam", "moving", 0)]
    assert {path.name for path in tmp_path.glob("*.png")} == {
        "comparison.png", "run_faults.png", "run_healthy.png", "run_zoom.png"
    }  # fmt: skip


def test_the_time_axis_reaches_from_one_sample_to_the_end_of_a_run_that_begins_late(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The missile's logs begin at 25 s of the flight, and its faults at 30 s."""
    seen: list[float] = []
    plot = "svo.studies.comparison.publish.plot_comparison"
    monkeypatch.setattr(plot, lambda *given: seen.extend(given[2:]) or Figure())
    rows = [row("none", "none", None), row("propulsion", "step", 0.03)]
    tuned = {("bounded", "interval, a = 0.9"): Tuned(Setting(1.25), 0.0, 1)}
    compared = Compared(Comparison("missile", "bounded"), {"interval, a = 0.9": "threshold"}, tuned, rows)
    publish_comparison(tmp_path, compared, load_plant("missile"))
    assert seen == pytest.approx([0.01, 10.0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--distribution", "cauchy"], "distribution is 'cauchy'; expected one of bounded, gaussian"),
        (["--noise", "loud"], "no noise set 'loud'"),
    ],
)
def test_the_command_says_what_it_knows(tmp_path: Path, arguments: list[str], message: str) -> None:
    answer = CliRunner().invoke(app, ["compare", "elevator", "--out", str(tmp_path / "out"), *arguments])
    assert answer.exit_code == 1
    assert message in answer.output
