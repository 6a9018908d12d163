"""From a plant's name or description and a log's path to a verdict, in Python as on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import svo
from svo import Detection, Log, detect, find_plant, read_log, verify
from svo.cli import app
from svo.logs.columns import LogNote
from svo.logs.file import write_log

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
LOG = CART.with_suffix(".csv")


@pytest.fixture(scope="module")
def found() -> Detection:
    plant = find_plant(CART)
    return detect(plant, read_log(LOG, plant))


def command(*arguments: str | Path) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.parametrize("name", ["find_plant", "read_log", "detect", "verify"])
def test_the_main_verbs_are_functions_of_the_package(name: str) -> None:
    assert callable(getattr(svo, name, None))
    assert name in svo.__all__


def test_a_detection_says_and_writes_what_the_command_line_does(found: Detection, tmp_path: Path) -> None:
    printed = command("detect", CART, LOG, "--out", tmp_path / "command")
    assert printed.stdout.startswith(str(found))
    found.save(tmp_path / "python")
    assert {path.name for path in (tmp_path / "python").iterdir()} == {"alarms.jsonl", "verdict.json", "cart.toml"}
    for path in (tmp_path / "python").iterdir():
        assert path.read_bytes() == (tmp_path / "command" / path.name).read_bytes()
    assert json.loads(command("detect", CART, LOG, "--json").stdout) == found.to_dict()


def test_the_verdict_is_that_of_the_last_sample(found: Detection) -> None:
    verdict = found.verdict
    assert (verdict.state, verdict.fault, verdict.alive) == ("isolated", "sensor", ("sensor",))
    assert (verdict.sample, verdict.detected_at, verdict.isolated_at) == (79, 50, 50)
    assert [alarm.observer for alarm in found.alarms] == ["motor", "nominal"]
    assert len(repr(found)) < 400


def test_times_have_the_digits_of_the_sampling_time_also_in_long_logs(found: Detection) -> None:
    late = detect(found.plant, replace(found.log, time=found.log.time + 1234560.0))
    assert "Fault detected at 1234565.0 s" in str(late)
    assert "nominal: falsified at 1234565.0 s" in str(late)


def test_what_was_saved_is_not_overwritten(found: Detection, tmp_path: Path) -> None:
    found.save(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(ValueError, match="never overwritten"):
        found.save(tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("full", [False, True])
def test_alarms_are_verified_from_the_file_and_at_hand(found: Detection, tmp_path: Path, full: bool) -> None:
    found.save(tmp_path)
    option = "--full" if full else "--log"
    printed = command("verify", tmp_path / "alarms.jsonl", option, LOG)
    stored, by_path = (verify(tmp_path / "alarms.jsonl", log, full=full) for log in (found.log, LOG))
    at_hand = verify(found, full=full)
    assert printed.exit_code == 0
    assert printed.stdout.rpartition(",")[0] == str(stored).rpartition(",")[0]
    for checked in (stored, by_path, at_hand):
        assert checked.ok
        assert checked.proven == 2
        assert [check.reason for check in checked.checks] == [check.reason for check in stored.checks]
    assert str(at_hand).startswith("alarms of cart.csv: 2 of 2 alarms proven in exact arithmetic")


def test_an_alarm_of_another_log_or_model_is_not_proven(found: Detection, tmp_path: Path) -> None:
    moved = replace(found, log=replace(found.log, y=found.log.y + 1.0))
    checked = verify(moved)
    assert not checked.ok
    assert checked.proven == 0
    assert "alarms of cart.csv, motor, sample 50: " in str(checked)
    text = CART.read_text().replace("n = [0.05]", "n = [0.04]")
    (tmp_path / "cart.toml").write_text(text)
    assert "differs from that of the plant's model" in str(
        verify(replace(found, plant=find_plant("cart.toml", tmp_path)))
    )


def test_a_plant_of_ones_own_is_given_by_hand(found: Detection, tmp_path: Path) -> None:
    found.save(tmp_path)
    (tmp_path / "cart.toml").unlink()
    with pytest.raises(OSError, match=r"cart\.toml"):
        verify(tmp_path / "alarms.jsonl", LOG)
    assert verify(tmp_path / "alarms.jsonl", LOG, plant=find_plant(CART)).ok


def test_a_healthy_log_raises_no_alarm_and_proves_nothing(found: Detection, tmp_path: Path) -> None:
    healthy = detect(
        found.plant, replace(found.log, time=found.log.time[:40], u=found.log.u[:40], y=found.log.y[:40], x=None)
    )
    assert str(healthy).startswith("No fault: the nominal model explains all 40 samples (stated noise).")
    assert (healthy.verdict.state, healthy.alarms) == ("nominal", ())
    checked = verify(healthy)
    assert not checked.ok
    assert "there is no alarm, so there is nothing to prove" in str(checked)
    healthy.save(tmp_path)
    assert not verify(tmp_path / "alarms.jsonl").ok


def test_a_choice_of_architecture_is_the_plants(tmp_path: Path) -> None:
    assert find_plant("eclipse", architecture="II").architecture == "II"  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match="has one architecture only"):
        find_plant(CART, architecture="II")


def test_a_sensor_without_measurements_is_noted(found: Detection, tmp_path: Path) -> None:
    (tmp_path / "two.toml").write_text(
        'Ts = 1.0\n[columns]\noutputs = [{ name = "a", unit = "m" }, { name = "b", unit = "m" }]\n'
        "[model]\nA = [[0.5]]\nC = [[1.0], [1.0]]\nn = [0.1, 0.1]\n[initial]\nlower = [-1.0]\nupper = [1.0]\n"
    )
    plant = find_plant("two.toml", tmp_path)
    (tmp_path / "two.csv").write_text("time_s,a,b\n0,0.5,\n1,0.25,\n")
    with pytest.warns(LogNote, match="has no measurement of 'b'; nothing is concluded"):
        log = read_log(tmp_path / "two.csv", plant)
    assert detect(plant, log).verdict.state == "nominal"
    printed = command("detect", tmp_path / "two.toml", tmp_path / "two.csv")
    assert "note: " in printed.stderr
    assert "has no measurement of 'b'" in printed.stderr
    write_log(tmp_path / "none.csv", Log(log.time, log.u, np.full((2, 2), np.nan)), plant.columns)
    with pytest.raises(ValueError, match="has no measurement: 'a', 'b' empty in every row"):
        read_log(tmp_path / "none.csv", plant)


@pytest.mark.parametrize(
    ("call", "kind", "expected"),
    [
        (lambda found: find_plant(3), TypeError, "name is a int; expected the name of a registered plant"),
        (lambda found: find_plant("nothing"), ValueError, "no plant is registered as 'nothing'"),
        (lambda found: read_log(LOG, "eclipse"), TypeError, r"plant is 'eclipse'; .* svo.find_plant\('eclipse'\)"),
        (lambda found: read_log(LOG, found.plant.columns), TypeError, "plant is Columns; expected a plant"),
        (lambda found: detect(str(CART), found.log), TypeError, r"expected a plant, such as svo.find_plant\("),
        (lambda found: detect(found.plant, LOG), TypeError, "expected an svo.Log, such as svo.read_log gives"),
        (lambda found: detect(found.plant, found.log, "loud"), ValueError, "no noise set 'loud'; it has stated"),
        (lambda found: verify(found.record), TypeError, "alarms is a BankRecord; expected what svo.detect gives"),
        (lambda found: verify(found, LOG), ValueError, "a detection, which has its own; leave"),
        (lambda found: found.plot(3), TypeError, "ax is a int; expected axes of matplotlib"),
        (lambda found: verify(CART, full=True), ValueError, "full is True and there is no log; give the log"),
    ],
)
def test_wrong_use_is_one_error(
    found: Detection, call: Callable[[Detection], Any], kind: type[Exception], expected: str
) -> None:
    with pytest.raises(kind, match=expected):
        call(found)
