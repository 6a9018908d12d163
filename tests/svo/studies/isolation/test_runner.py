from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from svo.plant import load_plant
from svo.studies.configuration import StudyConfiguration
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


@pytest.mark.parametrize("workers", [1, 2])
def test_a_run_that_fails_is_named(
    registered_tank: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, workers: int
) -> None:
    monkeypatch.setenv("TANK_BURSTS", "1")
    with pytest.raises(
        RuntimeError, match=r"run \d \(fault gauge, profile step, noise (calm|rough), seed \d+\) failed: .*burst"
    ):
        run_study(configuration(registered_tank, faults=("gauge",)), tmp_path, workers=workers)


def test_at_least_one_worker(registered_tank: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="workers is 0"):
        run_study(configuration(registered_tank), tmp_path, workers=0)
