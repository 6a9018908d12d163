"""Table and picture of a comparison, from rows made by hand, and the command on its cheapest detectors."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from svo.cli import app
from svo.comparison.comparison import Compared, Comparison
from svo.comparison.detector import Setting
from svo.comparison.publish import publish
from svo.comparison.run import ComparedRun
from svo.comparison.summary import summarise
from svo.comparison.tables import comparison_table
from svo.comparison.tuning import Tuned
from svo.plant import load_plant


def row(detector: str, fault: str, alarm: float | None, early: bool = False, width: float | None = None) -> ComparedRun:
    return ComparedRun(
        "bounded", detector, fault, "none" if fault == "none" else "steady", 0, alarm, alarm, early, None, None, None,
        None, 2.0, width,
    )  # fmt: skip


def compared() -> Compared:
    rows = [
        row("fast", "none", None, width=0.2), row("fast", "none", None, early=True, width=0.4),
        row("fast", "jam", 0.5), row("fast", "jam", None), row("fast", "jam", 0.01, early=True),
        row("early", "none", None, early=True), row("early", "jam", 0.01, early=True),
    ]  # fmt: skip
    tuned = {("bounded", name): Tuned(Setting(1.25), 0.0, 1) for name in ("fast", "early")}
    return Compared(Comparison("elevator", "quiet"), tuned, rows)


def test_runs_with_an_alarm_before_the_fault_have_no_delay() -> None:
    fast, early = summarise(compared())
    assert (fast.false_alarms.count, fast.false_alarms.of) == (1, 2)
    assert fast.width == pytest.approx(0.3)
    (jam,) = fast.scenarios
    assert (jam.missed.count, jam.missed.of, jam.early.count, jam.early.of) == (1, 2, 1, 3)
    assert early.scenarios[0].detect is None


def test_the_table_counts_misses_and_early_alarms() -> None:
    table = comparison_table(summarise(compared()))
    assert table.rows[0] == ("fast", "1.25", "1/2", "∞\n∞–∞\n1 missed\n1 early", "0.3", "2")
    assert table.rows[1][3:] == ("–\nall 1 early", "–", "2")


def test_what_is_published_with_the_runs_of_the_paper(tmp_path: Path) -> None:
    publish(compared(), load_plant("elevator"), tmp_path)
    files = {path.name for path in tmp_path.iterdir()}
    assert files == {
        "delays.png", "report.html", "run_faults.png", "run_healthy.png", "run_zoom.png", "runs.csv"
    }  # fmt: skip
    assert len((tmp_path / "runs.csv").read_text(encoding="utf-8").splitlines()) == 8


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


def test_the_command_refuses_a_folder_that_is_in_use(tmp_path: Path) -> None:
    (tmp_path / "something").touch()
    answer = CliRunner().invoke(app, ["compare", "elevator", "--out", str(tmp_path)])
    assert answer.exit_code == 1
    assert "is not empty" in answer.output
