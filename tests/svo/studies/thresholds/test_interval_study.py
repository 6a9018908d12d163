"""The study of interval detectors: rows by hand, the same for any number of workers, resumed, and published."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from svo.cli import app
from svo.logs.log import Log
from svo.plant import load_plant
from svo.studies.configuration import Job, StudyConfiguration
from svo.studies.isolation.store import StudyFolder
from svo.studies.thresholds import LearnsDetectors, publish, run_detection_study, summarise
from svo.studies.thresholds.run import DetectorRow, execute, judge
from svo.studies.thresholds.runner import read_rows
from svo.studies.thresholds.summary import summarise_assumption
from svo.studies.thresholds.tables import assumption_lines, detection_table

pytest.importorskip("pyarrow")

PLANT = load_plant("elevator")
assert isinstance(PLANT, LearnsDetectors)
CONFIGURATION = StudyConfiguration.for_plant(PLANT, runs=2, seed=3, faults=["none", "jam"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory):  # type: ignore[no-untyped-def]
    return run_detection_study(CONFIGURATION, tmp_path_factory.mktemp("study"))


def test_rows_are_those_of_the_detector_itself(folder) -> None:  # type: ignore[no-untyped-def]
    rows = read_rows(folder)
    assert len(rows) == 2 * 3 * 2 * 5  # runs, conditions, numbers of records, poles
    row = next(r for r in rows if (r.profile, r.records, r.detector) == ("moving", 1, "a = 0.9"))
    log = PLANT.simulate("jam", "moving", row.noise, row.seed)
    learnt = PLANT.learning_log(row.noise, np.random.SeedSequence(row.seed).spawn(1)[0])
    noise = PLANT.characterise([learnt])
    record = PLANT.interval_detectors(noise, float(log.u[0, 0]))["a = 0.9"].run(log)
    alarm = record.first_alarm_from(14.5)
    assert alarm is not None
    assert row.detection_delay_s == pytest.approx(alarm - 14.5 + 0.01)
    assert row.false_alarm == (record.first_alarm is not None and record.first_alarm < 1_450)


def test_two_processes_and_a_resumed_study_give_the_same_rows(folder, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    other = run_detection_study(CONFIGURATION, tmp_path / "two", workers=2)
    assert read_rows(other) == read_rows(folder)
    lost = sorted(other.parts.glob("*.parquet"))[1]
    lost.unlink()
    seen: list[tuple[int, int]] = []
    again = run_detection_study(CONFIGURATION, other.path, resume=True, progress=lambda *done: seen.append(done))
    assert seen == [(5, 6), (6, 6)]
    assert read_rows(again) == read_rows(folder)


def test_a_cluster_gives_the_same_rows(folder, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    distributed = pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    size = {"n_workers": 1, "threads_per_worker": 1}
    with distributed.LocalCluster(**size, processes=False, dashboard_address=None) as cluster:
        command = ["study", "elevator", "--runs", "2", "--seed", "3", "--fault", "none", "--fault", "jam"]
        command += ["--scheduler", cluster.scheduler_address, "--out", str(tmp_path / "spread")]
        answer = CliRunner().invoke(app, command)
    assert answer.exit_code == 0, answer.output
    assert read_rows(StudyFolder(tmp_path / "spread")) == read_rows(folder)


def test_a_scheduler_that_does_not_answer_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    monkeypatch.setattr("svo.studies.cluster._CONNECT", "0.5s")
    command = ["study", "elevator", "--runs", "1", "--scheduler", "tcp://127.0.0.1:9", "--out", str(tmp_path / "out")]
    answer = CliRunner().invoke(app, command)
    assert answer.exit_code == 1
    assert "no dask scheduler answers" in answer.output


def test_what_is_published(folder) -> None:  # type: ignore[no-untyped-def]
    found = publish(folder, PLANT)
    files = {path.name for path in folder.path.iterdir()}
    assert {"report.html", "summary.csv", "detection_times_conservative.png", "assumption_conservative.png"} <= files
    assert "://" not in (folder.path / "report.html").read_text(encoding="utf-8").replace("http://www.w3.org", "")
    jam = next(s for s in found.summaries if (s.profile, s.detector, s.records) == ("moving", "a = 0.6", 1))
    assert jam.paper == 14.55
    assert jam.time_of(jam.detect.median) == pytest.approx(14.55, abs=0.02)
    assert json.dumps(found.to_dict())


def made_rows() -> list[DetectorRow]:
    blank = DetectorRow(0, 0, "none", "none", "conservative", 1, "a = 0.6", None, None, False, ())
    healthy = [
        replace(blank, run=0, violated=(3, 4, 5, 9)),
        replace(blank, run=0, detector="a = 0.8", violated=(3, 4, 5, 9)),
        replace(blank, run=1, first_alarm_s=7.0, false_alarm=True, violated=(4, 5)),
        replace(blank, run=1, detector="a = 0.8", violated=(4, 5)),
        replace(blank, run=2),
        replace(blank, run=2, detector="a = 0.8"),
    ]
    jam = replace(blank, run=3, fault="jam", profile="steady", detection_delay_s=1.01)
    return [*healthy, jam, replace(jam, run=4, detection_delay_s=None)]


def test_summaries_of_rows_made_by_hand() -> None:
    summaries = summarise(PLANT, made_rows())
    jam = summaries[-1]
    assert (jam.start, jam.paper) == (66.0, 68.46)
    assert jam.detect.reached.count == 1
    assert jam.time_of(jam.detect.p05) is None  # between the two runs, one of which never got there
    first = summaries[0]
    assert (first.false_alarms.count, first.false_alarms.of) == (1, 3)
    (assumption,) = summarise_assumption(made_rows())
    assert (assumption.runs.count, assumption.alarmed.count, assumption.runs.of) == (2, 1, 3)
    assert assumption.by_window == {3: 1, 4: 2, 5: 2, 9: 1}
    (line,) = assumption_lines([assumption])
    assert "in 1 of 3" not in line
    assert "q from 3 to 9, 4 of them; most often, in up to 2 runs, at q = 3–5, 9" in line


def test_the_table_says_infinity_where_a_quantile_was_never_reached() -> None:
    rows = [r for r in made_rows() if r.detector == "a = 0.6"]
    table = detection_table(PLANT, summarise(PLANT, rows))
    assert table.rows[0][:2] == ("DV3: jam near steady state", "66")
    assert table.rows[0][2] == "∞\n∞–∞\npaper 68.46"
    assert table.rows[1][2] == "1/3"


def test_a_job_gives_the_same_rows_twice() -> None:
    job = CONFIGURATION.jobs(PLANT)[0]
    assert execute(PLANT, job) == execute(PLANT, job)


def test_a_plant_without_interval_detectors_is_refused(tmp_path: Path) -> None:
    configuration = StudyConfiguration("eclipse", ("quiet",), ("none",), 1, 0)
    with pytest.raises(TypeError, match="'eclipse' has no interval detectors"):
        run_detection_study(configuration, tmp_path / "out")


def test_the_command_prints_table_1(tmp_path: Path) -> None:
    arguments = ["study", "elevator", "--runs", "1", "--workers", "1", "--fault", "runaway", "--out"]
    answer = CliRunner().invoke(app, [*arguments, str(tmp_path / "out")])
    assert answer.exit_code == 0, answer.output
    assert "DV1: runaway -5 deg/s" in answer.output
    assert "paper 50.05" in answer.output
    assert (tmp_path / "out" / "report.html").exists()


@pytest.mark.slow
def test_workers_of_a_killed_study_end(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "svo", "study", "elevator", "--runs", "60", "--workers", "2", "--out"]
    process = subprocess.Popen([*command, str(tmp_path / "out")], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    workers: list[int] = []
    end = time.monotonic() + 300.0
    while len(workers) < 2 and process.poll() is None and time.monotonic() < end:
        time.sleep(0.1)
        workers = _workers_of(process.pid)
    process.kill()
    process.wait()
    end = time.monotonic() + 30.0
    while any(map(_is_alive, workers)) and time.monotonic() < end:
        time.sleep(0.1)
    left = [pid for pid in workers if _is_alive(pid)]
    for pid in left:
        os.kill(pid, 9)
    assert len(workers) >= 2
    assert left == []


def _workers_of(parent: int) -> list[int]:
    found = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return [int(pid) for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def _is_alive(pid: int) -> bool:
    try:
        return ") Z " not in Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False


@pytest.mark.parametrize(
    ("first", "stop", "delay", "false_alarm"),
    [(20, 40, 0.1, False), (23, 40, 0.4, False), (10, 40, None, True), (19, 25, None, True), (0, 0, None, False)],
)
def test_an_alarm_before_the_fault_is_no_detection(
    first: int, stop: int, delay: float | None, false_alarm: bool
) -> None:
    alarm = np.zeros(40, dtype=bool)
    alarm[first:stop] = True
    log = Log(time=0.1 * np.arange(40), u=np.zeros((40, 1)), y=np.zeros((40, 1)))
    plant: Any = SimpleNamespace(Ts=0.1, fault_time=2.0)
    row = judge(plant, Job(0, "jam", "step", "calm", 0, False), log, 1, "detector", alarm, ())
    assert (row.detection_delay_s, row.false_alarm) == (delay, false_alarm)
    healthy = judge(plant, Job(0, "none", "none", "calm", 0, False), log, 1, "detector", alarm, ())
    assert (healthy.detection_delay_s, healthy.false_alarm) == (None, alarm.any())
