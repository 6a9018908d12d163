"""The studies of recorded data: what must hold of them, on the real files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks._servo_detectors import learn, predictor, run_interval
from benchmarks._servo_records import COLUMNS, VARIABLE, Ts, data_folder, halves, jam, part, record, runaway
from benchmarks.real_flight import LEARN, angle, between, failure_time, main
from benchmarks.real_servo import FAULTS, INSTANTS, pole_at
from svo.cli import app
from svo.interval import IntervalDetector
from svo.logs.log import Log

FOLDER = data_folder()
SERVO = Path(__file__).parents[2] / "docs" / "examples" / "servo.toml"
needs_data = pytest.mark.skipif(FOLDER is None, reason=f"{VARIABLE} is not set: no recorded data")


@needs_data
def test_every_jam_in_a_real_servo_is_found_and_the_healthy_half_is_quiet() -> None:
    assert FOLDER is not None
    learning, running = halves(record(FOLDER, "standard"))
    fit, noise = learn(learning)
    assert fit.gains.gc == pytest.approx(0.847, abs=0.002)
    assert noise.check(predictor(fit, running).predict(running).residual).holds
    outcome = run_interval(IntervalDetector(predictor(fit, running), noise, 0.9), running, FAULTS, INSTANTS)
    assert outcome.alarm_share == 0.0
    assert all(np.isfinite(delays).all() for delays in outcome.delays.values())
    assert 0.002 <= np.median(outcome.delays["jam"]) <= 0.02


@needs_data
def test_pulses_that_were_not_learnt_break_the_assumption_and_alarm() -> None:
    assert FOLDER is not None
    fit, noise = learn(halves(record(FOLDER, "standard"))[0])
    pushed = halves(record(FOLDER, "pulses"))[1]
    assert noise.check(predictor(fit, pushed).predict(pushed).residual).violated.size == noise.qbar
    assert IntervalDetector(predictor(fit, pushed), noise, 0.9).run(pushed).exceeded.mean() > 0.2


@needs_data
def test_at_ten_milliseconds_there_is_no_pole_left() -> None:
    assert FOLDER is not None
    assert pole_at(FOLDER, 1) == pytest.approx(0.847, abs=0.002)
    assert pole_at(FOLDER, 10) < 0.0


@needs_data
def test_a_real_flight_passes_through_the_tools(capsys: pytest.CaptureFixture[str]) -> None:
    assert FOLDER is not None
    roll = angle(FOLDER, "roll")
    assert failure_time(FOLDER) == pytest.approx(116.27, abs=0.01)
    assert len(between(roll, *LEARN)) == pytest.approx(1000, abs=2)
    main()
    assert "roll" in capsys.readouterr().out


@needs_data
def test_the_described_servo_explains_the_healthy_recording_from_the_command_line() -> None:
    assert FOLDER is not None
    recording = str(FOLDER / "emps" / "DATA_EMPS.mat")
    done = CliRunner().invoke(app, ["detect", str(SERVO), recording, "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert (found["state"], found["samples"]) == ("nominal", 24841)
    assert found["interval_detector"]["samples_beyond"] == 0


def test_without_data_the_study_says_so(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    main()
    assert capsys.readouterr().out.startswith(f"skipped: set {VARIABLE}")


def test_faults_are_injected_from_their_sample_on() -> None:
    log = Log(time=np.arange(5) * Ts, u=np.zeros((5, 1)), y=np.arange(5.0)[:, None])
    assert jam(log, 2).y[:, 0].tolist() == [0, 1, 2, 2, 2]
    assert runaway(log, 3, 1.0).y[:, 0] == pytest.approx([0, 1, 2, 3 + Ts, 4 + 2 * Ts])
    assert len(part(log, 1, None, 2)) == 2
    assert COLUMNS.time == "t"
