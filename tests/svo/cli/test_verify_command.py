"""`svo verify`: alarms proven alone, with their log, and in full."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.svo.commands import edited, one_line, svo
from tests.svo.observers.long_chains import long_chains


def test_a_log_is_detected_on_and_its_alarms_are_verified(log: Path, tmp_path: Path) -> None:
    found = svo("detect", "tank", log, "--out", tmp_path / "found")
    assert found.exit_code == 0
    assert "Fault detected at 1.0 s" in found.stdout
    assert "Fault isolated at 1.0 s: gauge" in found.stdout
    assert "leak: falsified at 1.0 s" in found.stdout
    assert "gauge: explains the data to the end" in found.stdout
    verdict = json.loads((tmp_path / "found" / "verdict.json").read_text())
    assert verdict["falsified_s"] == {"nominal": 1.0, "leak": 1.0}
    assert [change["state"] for change in verdict["changes"]] == ["nominal", "isolated"]
    alarms = tmp_path / "found" / "alarms.jsonl"
    assert "2 of 2 alarms proven" in svo("verify", alarms).stdout
    assert svo("verify", alarms, "--log", log).exit_code == 0
    checks = json.loads(svo("verify", alarms, "--json").stdout)
    assert [check["ok"] for check in checks] == [True, True]


def test_alarms_do_not_verify_against_another_log(log: Path, tmp_path: Path) -> None:
    svo("detect", "tank", log, "--out", tmp_path)
    edited(log, 12, "gauge_1", "1.4142")
    result = svo("verify", tmp_path / "alarms.jsonl", "--log", log)
    assert result.exit_code == 1
    assert "0 of 2 alarms proven" in result.stdout
    assert "line 1" in result.stderr


def test_an_alarm_with_a_changed_number_is_rejected(log: Path, tmp_path: Path) -> None:
    svo("detect", "tank", log, "--out", tmp_path)
    alarms = tmp_path / "alarms.jsonl"
    alarms.write_text(
        alarms.read_text().replace('"sample": 10', '"sample": 11', 1).replace('"sample":10', '"sample":11', 1)
    )
    result = svo("verify", alarms)
    assert result.exit_code == 1
    assert "1 of 2 alarms proven" in result.stdout


def test_what_is_no_alarm_is_a_failed_one(tmp_path: Path) -> None:
    (tmp_path / "alarms.jsonl").write_bytes(b"{}\n")
    result = svo("verify", tmp_path / "alarms.jsonl")
    assert result.exit_code == 1
    assert "0 of 1 alarms proven" in result.stdout
    assert "alarms.jsonl, line 1: " in result.stderr


@pytest.mark.parametrize("more", [(), ("--json",), ("--log", "log.csv"), ("--full", "log.csv")])
@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "alarms.jsonl holds no alarm, so there is nothing to prove"),
        (b"\n\n", "alarms.jsonl holds no alarm, so there is nothing to prove"),
        (b"hello\n", "alarms.jsonl is no file of alarms (line 1 is no JSON object"),
        (b"time_s,u,y\n0,1,2\n0.1,1,2\n", "alarms.jsonl is no file of alarms (line 1 is no JSON object"),
        (b"\n1\n2\n", "alarms.jsonl is no file of alarms (line 2 is no JSON object"),
        (bytes(range(128, 256)), "expected an alarms.jsonl that svo detect, svo watch or svo study wrote"),
    ],
)
def test_a_file_without_alarms_is_one_error(
    log: Path, tmp_path: Path, content: bytes, expected: str, more: tuple[str, ...]
) -> None:
    (tmp_path / "alarms.jsonl").write_bytes(content)
    options = [str(tmp_path / option) if option.endswith(".csv") else option for option in more]
    result = svo("verify", tmp_path / "alarms.jsonl", *options)
    assert expected in one_line(result)
    assert result.stdout == ""


def test_the_whole_chain_is_proven(log: Path, tmp_path: Path) -> None:
    assert svo("detect", "tank", log, "--out", tmp_path).exit_code == 0
    result = svo("verify", tmp_path / "alarms.jsonl", "--full", log, "--json")
    assert result.exit_code == 0, result.output
    assert all("proven from the readings since" in check["reason"] for check in json.loads(result.stdout))
    assert "leave --log out" in one_line(svo("verify", tmp_path / "alarms.jsonl", "--full", log, "--log", log))


def test_an_alarm_is_compared_with_the_models_of_its_own_bank(log: Path, tmp_path: Path) -> None:
    for kind, words in (("lpv", ""), ("nonlinear", "is not checked again")):
        assert svo("detect", "tank2", log, "--models", kind, "--out", tmp_path / kind).exit_code == 0
        alarms = tmp_path / kind / "alarms.jsonl"
        assert {json.loads(line)["source"]["models"] for line in alarms.read_text().splitlines()} == {kind}
        result = svo("verify", alarms, "--log", log)
        assert result.exit_code == 0, result.output
        assert words in result.stdout


def test_the_chain_of_a_model_that_starts_late_is_proven_from_its_start(registered_tank: str, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    assert svo("simulate", "tank2", "--fault", "leak", "--seed", "3", "--out", log).exit_code == 0
    result = svo("detect", "tank2", log, "--architecture", "II", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    result = svo("verify", tmp_path / "alarms.jsonl", "--full", log, "--json")
    assert result.exit_code == 0, result.output
    reasons = {check["observer"]: check["reason"] for check in json.loads(result.stdout)}
    assert "proven from the readings since sample" in reasons["nominal"]
    assert "proven from sample" in reasons["gauge"]
    assert "given the global set" in reasons["gauge"]


def test_a_bound_that_is_not_proven_fails_the_chain(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from svo.observers.window import prover

    honest = prover.BoundProver.arrival

    def check_after_cheating(self: prover.BoundProver, window: Any, program: int) -> None:
        if program == 0:
            window.memory.arrays["new_upper"][0] -= 1e-9
        honest(self, window, program)

    assert svo("detect", "tank", log, "--out", tmp_path).exit_code == 0
    monkeypatch.setattr(prover.BoundProver, "arrival", check_after_cheating)
    with long_chains():
        result = svo("verify", tmp_path / "alarms.jsonl", "--full", log, "--json")
    assert result.exit_code == 1
    reasons = [check["reason"] for check in json.loads(result.stdout)]
    assert all("bounds are not proven, first: arrival bound 0" in reason for reason in reasons)
