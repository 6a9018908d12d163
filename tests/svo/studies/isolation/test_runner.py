from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from svo.cli import app
from svo.plant import load_plant
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.publish import publish
from svo.studies.isolation.run import RunRow
from svo.studies.isolation.runner import run_study
from svo.studies.isolation.store import StudyFolder


def configuration(tank: str, **changes: Any) -> StudyConfiguration:
    given = {"runs": 2, "seed": 3, "noise": ("calm", "rough")} | changes
    return StudyConfiguration.for_plant(load_plant(tank), **given)


def untimed(rows: list[RunRow]) -> list[RunRow]:
    return [replace(row, microseconds_per_step=0.0, microseconds_p99=0.0) for row in rows]


def test_results_do_not_depend_on_the_number_of_workers(registered_tank: str, tmp_path: Path) -> None:
    one = run_study(configuration(registered_tank), tmp_path / "one", workers=1)
    two = run_study(configuration(registered_tank), tmp_path / "two", workers=2)
    assert untimed(one.rows()) == untimed(two.rows())
    assert one.alarms.read_bytes() == two.alarms.read_bytes()
    assert len(one.rows()) == 2 * 4 * 2


def test_a_killed_study_goes_on_where_it_was(registered_tank: str, tmp_path: Path) -> None:
    wanted = configuration(registered_tank, runs=20, noise=("calm",))
    command = [sys.executable, "-m", "svo", "study", "tank", "--runs", "20", "--seed", "3", "--workers", "2"]
    process = subprocess.Popen(
        [*command, "--out", tmp_path / "cut"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    parts = tmp_path / "cut" / "runs.parquet"
    while len(list(parts.glob("run-*"))) < 5:
        assert process.poll() is None
        time.sleep(0.002)
    process.kill()
    process.wait()
    before = {path.name: path.stat().st_mtime_ns for path in parts.glob("run-*")}
    assert len(before) < 80
    calls: list[tuple[int, int]] = []
    # Workers notice the death of their parent; until then they may still finish the run that they have.
    resumed = run_study(wanted, tmp_path / "cut", resume=True, progress=lambda done, of: calls.append((done, of)))
    assert calls[0][0] >= len(before)
    assert calls[-1] == (80, 80)
    assert all((parts / name).stat().st_mtime_ns == at for name, at in before.items())
    whole = run_study(wanted, tmp_path / "whole")
    assert untimed(resumed.rows()) == untimed(whole.rows())
    assert resumed.alarms.read_bytes() == whole.alarms.read_bytes()
    assert not list(tmp_path.rglob(".unfinished-*"))


def test_an_interruption_from_the_keyboard_keeps_what_is_done(registered_tank: str, tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "svo",
        "study",
        "tank",
        "--runs",
        "400",
        "--workers",
        "2",
        "--out",
        tmp_path / "out",
    ]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    parts = tmp_path / "out" / "runs.parquet"
    while len(list(parts.glob("run-*"))) < 5:
        assert process.poll() is None
        time.sleep(0.002)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.splitlines()[-1].startswith("error: interrupted;")
    assert "Traceback" not in errors
    assert 5 <= len(StudyFolder(tmp_path / "out").rows()) < 800


def test_a_folder_that_is_in_use_is_not_touched(registered_tank: str, tmp_path: Path) -> None:
    wanted = configuration(registered_tank, faults=("gauge",), noise=("calm",))
    folder = run_study(wanted, tmp_path / "out")
    with pytest.raises(ValueError, match="is not empty; give --resume"):
        run_study(wanted, folder.path)
    with pytest.raises(ValueError, match=r"holds another study .*seed was 3, now 4"):
        run_study(replace(wanted, seed=4), folder.path, resume=True)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").write_text("years of work")
    with pytest.raises(ValueError, match="holds no study"):
        run_study(wanted, tmp_path / "other", resume=True)
    assert len(StudyFolder(folder.path).rows()) == 2


def test_a_finished_study_can_be_resumed_without_running_anything(registered_tank: str, tmp_path: Path) -> None:
    wanted = configuration(registered_tank, faults=("gauge",))
    folder = run_study(wanted, tmp_path)
    alarms = folder.alarms.read_bytes()
    calls: list[tuple[int, int]] = []
    run_study(wanted, tmp_path, resume=True, progress=lambda done, of: calls.append((done, of)))
    assert calls == [(4, 4)]
    assert folder.alarms.read_bytes() == alarms


def burst(monkeypatch: pytest.MonkeyPatch, how: str) -> None:
    monkeypatch.setenv("TANK_BURSTS_IN", "gauge")
    monkeypatch.setenv("TANK_BURSTS", how)


@pytest.mark.parametrize(("how", "error"), [("raise", "ArithmeticError: the tank burst"), ("exit", "SystemExit: 0")])
def test_a_run_that_fails_is_a_row_and_can_be_tried_again(
    registered_tank: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str, error: str
) -> None:
    wanted = configuration(registered_tank, noise=("calm",))
    whole = run_study(wanted, tmp_path / "whole")
    burst(monkeypatch, how)
    rows = run_study(wanted, tmp_path / "out").rows()
    assert [row.error for row in rows] == [None] * 6 + [error] * 2
    assert untimed(rows[:6]) == untimed(whole.rows()[:6])
    assert rows[6] == RunRow(6, whole.rows()[6].seed, "gauge", "step", "calm", error=error)
    calls: list[tuple[int, int]] = []
    run_study(wanted, tmp_path / "out", resume=True, progress=lambda *done: calls.append(done))
    assert calls == [(8, 8)]  # a run that failed is done, unless it is asked for
    monkeypatch.delenv("TANK_BURSTS_IN")
    again = run_study(wanted, tmp_path / "out", resume=True, retry_failed=True, progress=lambda *d: calls.append(d))
    assert calls[1:] == [(6, 8), (7, 8), (8, 8)]
    assert untimed(again.rows()) == untimed(whole.rows())
    assert again.alarms.read_bytes() == whole.alarms.read_bytes()


def test_a_crash_in_a_plant_is_a_row_and_the_command_names_it(
    registered_tank: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With one worker too: the command gives every run a process that may die."""
    burst(monkeypatch, "segfault")
    command = ["study", "tank", "--runs", "1", "--seed", "3", "--workers", "1", "--out", str(tmp_path / "out")]
    answer = CliRunner().invoke(app, command)
    assert answer.exit_code == 1
    assert "error: run 3 (fault gauge, profile step, noise calm, seed " in answer.output
    assert "failed: its process was ended by SIGSEGV" in answer.output
    assert "--resume --retry-failed" in answer.output
    assert "detected: 2 of 2" in answer.output  # the others are judged
    table = pq.read_table(tmp_path / "out" / "runs.parquet")
    assert [error is not None for error in table["error"].to_pylist()] == [False, False, False, True]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "its process was ended by SIGSEGV" in page


def test_a_study_in_which_all_runs_fail_is_one_clear_error(
    registered_tank: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    burst(monkeypatch, "raise")
    folder = run_study(configuration(registered_tank, faults=("gauge",)), tmp_path)
    with pytest.raises(ValueError, match=r"all 4 runs failed; run 0 \(fault gauge, .*burst; --resume --retry-failed"):
        publish(folder, load_plant(registered_tank))


def test_at_least_one_worker(registered_tank: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="workers is 0"):
        run_study(configuration(registered_tank), tmp_path, workers=0)
