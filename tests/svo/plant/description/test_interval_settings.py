"""The table [interval_detector], and the command line with a described plant."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from svo.cli import app
from svo.interval import GainBounds, IntervalDetector, IntervalPredictor, NoiseCharacterization
from svo.logs.file import write_log
from svo.logs.log import Log
from svo.plant.description import DescribedPlant, read_description

TEXT = """
Ts = 0.01
[columns]
inputs = [{ name = "u", unit = "m" }]
outputs = [{ name = "y", unit = "m" }]
[model]
A = [[0.9]]
B = [[0.1]]
C = [[1.0]]
n = [0.05]
[initial]
lower = [-1]
upper = [1]
[interval_detector]
g = [0.9, 0.005]
h = [1.0, 0.0]
initial_radius = 0.02
pole = 0.8
qbar = 20
learn_until_s = 3.0
"""


def run_of(samples: int, seed: int, jam_at: int | None = None) -> Log:
    rng = np.random.default_rng(seed)
    u = np.sin(0.07 * np.arange(samples))
    x = np.zeros(samples)
    for k in range(samples - 1):
        x[k + 1] = 0.9 * x[k] + 0.1 * u[k]
    y = x + rng.uniform(-0.03, 0.03, samples)
    if jam_at is not None:
        y[jam_at:] = y[jam_at]
    return Log(time=np.arange(samples) * 0.01, u=u[:, None], y=y[:, None])


def described(tmp_path: Path, *changes: tuple[str, str]) -> DescribedPlant:
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "servo.toml"
    path.write_text(text)
    return read_description(path)


def by_hand(learning: list[Log], judged: Log) -> Any:
    gains = GainBounds(0.9, 0.005)

    def predictor(log: Log) -> IntervalPredictor:
        return IntervalPredictor(gains, (float(log.y[0, 0]), 0.02))

    noise = NoiseCharacterization.from_records(
        [predictor(log).predict(log).residual for log in learning], 20, safety_factor=1.2
    )
    return IntervalDetector(predictor(judged), noise, 0.8).run(judged)


def test_it_learns_from_the_beginning_of_the_log_and_judges_the_rest(tmp_path: Path) -> None:
    log = run_of(800, 0, jam_at=600)
    found = described(tmp_path).detect_thresholds(log)
    assert found is not None
    first, rest = (Log(time=log.time[s], u=log.u[s], y=log.y[s]) for s in (slice(0, 300), slice(300, None)))
    expected = by_hand([first], rest)
    assert np.array_equal(found.record.exceeded, expected.exceeded)
    assert found.first_alarm_s is not None
    assert 6.0 <= found.first_alarm_s < 6.3
    assert sum(end - begin for begin, end in found.periods_s) < 2.0
    assert found.to_dict()["samples_beyond"] == int(expected.exceeded.sum())


def test_it_learns_from_records_beside_the_file(tmp_path: Path) -> None:
    plant = described(tmp_path, ("learn_until_s = 3.0", 'records = ["a.csv", "b.parquet"]'))
    records = [run_of(300, 1), run_of(400, 2)]
    for name, log in zip(("a.csv", "b.parquet"), records, strict=True):
        write_log(tmp_path / name, log, plant.columns)
    log = run_of(500, 3)
    found = plant.detect_thresholds(log)
    assert found is not None
    assert np.array_equal(found.record.exceeded, by_hand(records, log).exceeded)
    assert found.periods_s == []
    assert "no threshold crossing in 500 samples from 0 s on" in found.to_text()


def test_without_the_table_there_is_none(tmp_path: Path) -> None:
    (tmp_path / "servo.toml").write_text(TEXT.partition("[interval_detector]")[0])
    assert read_description(tmp_path / "servo.toml").detect_thresholds(run_of(10, 0)) is None


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("g = [0.9, 0.005]", "g = [0.9]"), r"key 'g': is \[0.9\]; expected \[centre, radius\]"),
        (("g = [0.9, 0.005]", "g = [0.9, -1]"), "key 'g': .*radius >= 0"),
        (("pole = 0.8", ""), "key 'pole': is missing"),
        (("qbar = 20", "qbr = 20"), "key 'qbr'.*did you mean 'qbar'"),
        (("learn_until_s = 3.0", ""), "either records or learn_until_s"),
        (("learn_until_s = 3.0", "learn_until_s = 3.0\nrecords = ['a.csv']"), "either records or learn_until_s"),
        (("learn_until_s = 3.0", "records = ['../a.csv']"), "key 'records': is '../a.csv'; expected a file beside"),
        (("learn_until_s = 3.0", "records = ['b/../../a.csv']"), "key 'records'.*expected a file beside"),
        (("learn_until_s = 3.0", "records = ['/a.csv']"), "key 'records': is '/a.csv'; expected a file beside"),
        (("learn_until_s = 3.0", "records = ['']"), "key 'records': is ''; expected a file beside"),
        (("learn_until_s = 3.0", "records = []"), "key 'records'.*expected names of files"),
        (("qbar = 20", "input = 'v'"), "key 'input': is 'v'; expected one of the columns u"),
        (("qbar = 20", "slope = -1"), "slope of the gain bounds is -1"),
    ],
)
def test_a_mistake_is_one_error_with_its_place(tmp_path: Path, change: tuple[str, str], expected: str) -> None:
    with pytest.raises(ValueError, match=rf"servo\.toml, \[interval_detector\].*{expected}"):
        described(tmp_path, change)


def test_a_time_outside_the_log_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"learn_until_s is 3 s, but the log goes from 0 s to 0\.99 s"):
        described(tmp_path).detect_thresholds(run_of(100, 0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("g = [0.9, 0.005]", "g = [0.9, 0.2]"), r"'g': is \[0.9, 0.2\], so |g| may be 1.1; expected less than 1"),
        (("g = [0.9, 0.005]", "g = [-1.5, 0.0]"), "may be 1.5; expected less than 1"),
        (("pole = 0.8", "pole = 0.8\nslope = 1.0\nlimit = 0.3"), "may be 1.2; expected less than 1"),
        (("pole = 0.8", "pole = 1.0"), "'pole': is 1; expected 0 <= pole < 1"),
        (("initial_radius = 0.02", "initial_radius = -0.1"), "'initial_radius': is -0.1; expected a number >= 0"),
        (("qbar = 20", "qbar = 20\nsafety_factor = 1.0"), "'safety_factor': is 1; expected a number > 1"),
    ],
)
def test_settings_that_cannot_work_are_refused_before_any_sample(
    tmp_path: Path, change: tuple[str, str], message: str
) -> None:
    with pytest.raises(ValueError, match=message.replace("|", r"\|")):
        described(tmp_path, change)


def test_a_limit_keeps_a_wide_radius_stable(tmp_path: Path) -> None:
    described(tmp_path, ("g = [0.9, 0.005]", "g = [0.9, 0.2]"), ("pole = 0.8", "pole = 0.8\nlimit = 0.05"))


def test_what_the_interval_detector_refuses_costs_no_answer_of_the_bank(tmp_path: Path, monkeypatch: Any) -> None:
    """It is asked first: the bank's whole run was lost before."""
    plant = described(tmp_path, ("learn_until_s = 3.0", "learn_until_s = 99.0"))
    write_log(tmp_path / "log.csv", run_of(100, 0), plant.columns)
    monkeypatch.setattr("svo.isolation.bank.Bank.run", lambda *_, **__: pytest.fail("the bank ran before"))
    done = CliRunner().invoke(app, ["detect", str(tmp_path / "servo.toml"), str(tmp_path / "log.csv")])
    assert done.exit_code == 1
    assert "learn_until_s is 99 s" in done.stderr


def test_calibrated_figures_typed_into_the_file_explain_the_log(tmp_path: Path) -> None:
    """Rounded to nearest they did not, in 12 of 12."""
    for seed in range(12):
        shorter = ("learn_until_s = 3.0", "learn_until_s = 0.3")
        plant = described(tmp_path, ("n = [0.05]", "n = [0.02]"), shorter)
        write_log(tmp_path / "log.csv", run_of(60, seed), plant.columns)
        arguments = [str(tmp_path / "servo.toml"), str(tmp_path / "log.csv")]
        text = CliRunner().invoke(app, ["calibrate", *arguments]).stdout
        amount, percent = re.search(r"noise y: \+ (\S+) \((\S+) %", text).groups()  # type: ignore[union-attr]
        for wider in (0.02 + float(amount), 0.02 * (1 + float(percent) / 100)):
            described(tmp_path, ("n = [0.05]", f"n = [{wider!r}]"), shorter)
            assert "No fault: the nominal model explains" in CliRunner().invoke(app, ["detect", *arguments]).stdout


def test_a_model_that_was_falsified_and_began_again_has_a_remark(tmp_path: Path) -> None:
    log = run_of(400, 1)
    log.y[200:203] += 0.5
    plant = described(tmp_path, ("[interval_detector]", "[bank]\ndebounce = 2\nrecovery = 20\n[interval_detector]"))
    write_log(tmp_path / "log.csv", log, plant.columns)
    arguments = ["detect", str(tmp_path / "servo.toml"), str(tmp_path / "log.csv")]
    text = CliRunner().invoke(app, arguments).stdout
    assert "nominal: falsified at 2.01 s" in text
    assert "nominal: explains the data to the end, begun again after it was falsified" in text
    assert json.loads(CliRunner().invoke(app, [*arguments, "--json"]).stdout)["restarted"] == ["nominal"]


def test_the_command_reports_both_and_keeps_them_apart(tmp_path: Path) -> None:
    plant = described(tmp_path)
    write_log(tmp_path / "log.mat", run_of(800, 0, jam_at=600), plant.columns)
    arguments = [str(tmp_path / "servo.toml"), str(tmp_path / "log.mat")]
    done = CliRunner().invoke(app, ["detect", *arguments, "--out", str(tmp_path / "found")])
    assert done.exit_code == 0, done.output
    assert "nominal: falsified at 6." in done.stdout
    assert "This rests on the learnt noise; it is no proof." in done.stdout
    verdict = json.loads((tmp_path / "found" / "verdict.json").read_text())
    assert 6.0 <= verdict["interval_detector"]["first_alarm_s"] < 6.3
    assert len((tmp_path / "found" / "alarms.jsonl").read_text().splitlines()) == 1
    full = CliRunner().invoke(app, ["verify", str(tmp_path / "found" / "alarms.jsonl"), "--full", arguments[1]])
    assert full.exit_code == 0, full.output
    as_json = json.loads(CliRunner().invoke(app, ["detect", *arguments, "--json"]).stdout)
    assert as_json["interval_detector"] == verdict["interval_detector"]


def test_another_model_beside_the_alarms_is_noticed(tmp_path: Path) -> None:
    plant = described(tmp_path)
    write_log(tmp_path / "log.csv", run_of(800, 0, jam_at=600), plant.columns)
    CliRunner().invoke(
        app, ["detect", str(tmp_path / "servo.toml"), str(tmp_path / "log.csv"), "--out", str(tmp_path / "f")]
    )
    copy = tmp_path / "f" / "servo.toml"
    copy.write_text(copy.read_text().replace("n = [0.05]", "n = [0.5]"))
    full = CliRunner().invoke(
        app, ["verify", str(tmp_path / "f" / "alarms.jsonl"), "--full", str(tmp_path / "log.csv")]
    )
    assert full.exit_code == 1
    assert "differs from that of the plant's model 'nominal'" in full.stderr


def test_calibration_takes_a_described_plant(tmp_path: Path) -> None:
    plant = described(tmp_path, ("n = [0.05]", "n = [0.02]"))
    write_log(tmp_path / "log.csv", run_of(200, 5), plant.columns)
    done = CliRunner().invoke(app, ["calibrate", str(tmp_path / "servo.toml"), str(tmp_path / "log.csv")])
    assert done.exit_code == 0, done.output
    assert "noise y: +" in done.stdout


def test_a_mistake_in_the_file_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "servo.toml").write_text(TEXT.replace("[initial]", "[intial]"))
    for command in ("detect", "watch", "calibrate"):
        done = CliRunner().invoke(app, [command, str(tmp_path / "servo.toml"), "log.csv"])
        assert done.exit_code == 1
        assert done.stderr.startswith(f"error: {tmp_path / 'servo.toml'}, key 'intial'")
        assert done.stderr.count("\n") == 1
