"""`svo study` and `svo report`: tables, files, banks side by side."""

from __future__ import annotations

import json
from pathlib import Path

from svo.studies.isolation.store import StudyFolder
from tests.svo.commands import one_line, svo


def test_a_study_prints_its_table_and_writes_its_files(registered_tank: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ("study", "tank", "--runs", "2", "--workers", "1", "--noise", "calm", "--noise", "rough", "--out", out)
    result = svo(*command)
    assert result.exit_code == 0, result.stderr
    assert "Fault-free runs with an alarm: 0 of 2" in result.stdout
    assert "Runs with a wrong isolation: 0 of 8" in result.stdout
    assert "about 0.3" in result.stdout
    names = {path.name for path in out.iterdir()}
    assert names >= {
        "runs.parquet",
        "summary.csv",
        "alarms.jsonl.gz",
        "report.html",
        "delays_calm.png",
        "alive_rough.png",
    }
    assert "is not empty; give --resume" in one_line(svo(*command))
    again = json.loads(svo(*command, "--resume", "--json").stdout)
    assert again["configuration"]["runs"] == 2
    assert len(again["summary"]) == 8
    assert "noise was" in one_line(svo("study", "tank", "--runs", "2", "--out", out, "--resume"))
    assert svo("verify", out / "alarms.jsonl").exit_code == 0
    svo("simulate", "tank", "--out", tmp_path / "log.csv")
    assert "several runs" in one_line(svo("verify", out / "alarms.jsonl", "--log", tmp_path / "log.csv"))


def test_a_row_of_the_run_table_can_be_simulated_and_verified(registered_tank: str, tmp_path: Path) -> None:
    svo("study", "tank", "--runs", "1", "--workers", "1", "--fault", "gauge", "--out", tmp_path / "out")
    row = StudyFolder(tmp_path / "out").rows()[0]
    log = tmp_path / "log.csv"
    seed = str(row.seed)
    svo(
        "simulate",
        "tank",
        "--fault",
        row.fault,
        "--profile",
        row.profile,
        "--noise",
        row.noise,
        "--seed",
        seed,
        "--out",
        log,
    )
    assert svo("verify", tmp_path / "out" / "alarms.jsonl", "--log", log).exit_code == 0
    found = json.loads(svo("detect", "tank", log, "--json").stdout)
    assert found["detected_s"] == row.first_alarm_s


def test_both_architectures_see_the_same_runs_side_by_side(registered_tank: str, tmp_path: Path) -> None:
    out = tmp_path / "study"
    options = ["--runs", "2", "--workers", "1", "--architecture", "I", "--architecture", "II"]
    result = svo("study", "tank2", *options, "--out", out)
    assert result.exit_code == 0, result.output
    table = [line.split() for line in result.stdout.splitlines() if line.strip().startswith(("leak", "gauge"))]
    kinds = [("leak", "step"), ("leak", "ramp"), ("gauge", "step")]
    assert [row[:3] for row in table] == [[*kind, a] for kind in kinds for a in ("I", "II")]
    rows = StudyFolder(out).rows()
    first, second = ([row for row in rows if row.architecture == a] for a in ("I", "II"))
    assert len(first) == len(second) == 8
    for a, b in zip(first, second, strict=True):
        assert (a.seed, a.fault, a.profile) == (b.seed, b.fault, b.profile)
        assert a.detection_delay_s == b.detection_delay_s  # the nominal observer runs from the start in both
    assert not any(row.wrong_isolation or row.false_alarm for row in rows)
    assert json.loads((out / "study.json").read_text())["configuration"]["architectures"] == ["I", "II"]
    assert "--architecture I --architecture II" in (out / "report.html").read_text()
    assert (out / "delays_calm.png").exists()
    assert (out / "alive_calm_II.png").exists()
    assert svo("verify", out / "alarms.jsonl").exit_code == 0


def test_both_kinds_of_models_see_the_same_runs_side_by_side(registered_tank: str, tmp_path: Path) -> None:
    out = tmp_path / "study"
    options = ["--runs", "2", "--workers", "1", "--fault", "gauge", "--models", "lpv", "--models", "nonlinear"]
    result = svo("study", "tank2", *options, "--out", out)
    assert result.exit_code == 0, result.output
    table = [line.split() for line in result.stdout.splitlines() if line.strip().startswith("gauge")]
    assert [row[:3] for row in table] == [["gauge", "step", kind] for kind in ("lpv", "nonlinear")]
    linear, other = ([row for row in StudyFolder(out).rows() if row.models == kind] for kind in ("lpv", "nonlinear"))
    for a, b in zip(linear, other, strict=True):
        assert (a.seed, a.detection_delay_s, a.isolated_as) == (b.seed, b.detection_delay_s, b.isolated_as)
    assert "--models lpv --models nonlinear" in (out / "report.html").read_text()
    assert (out / "bounds_calm_nonlinear.png").exists()
    assert svo("verify", out / "alarms.jsonl").exit_code == 0


def test_a_report_is_written_from_the_runs_so_far(registered_tank: str, tmp_path: Path) -> None:
    out = tmp_path / "study"
    svo("study", "tank", "--runs", "2", "--workers", "1", "--noise", "calm", "--out", out)
    written = (out / "report.html").read_text(encoding="utf-8")
    (out / "report.html").unlink()
    assert "Report:" in svo("report", out).stdout
    assert (out / "report.html").read_text(encoding="utf-8") == written
    for part in (out / "runs.parquet").iterdir():
        if part.stem > "run-000002":  # as in a study that is still running
            part.unlink()
    assert svo("report", out).exit_code == 0
    assert "3 runs" in (out / "report.html").read_text(encoding="utf-8")
    for part in (out / "runs.parquet").iterdir():
        part.unlink()
    assert "holds no finished run yet" in one_line(svo("report", out))
    assert "nowhere holds no study (study.json is missing)" in one_line(svo("report", tmp_path / "nowhere"))
    (out / "study.json").write_text("{}", encoding="utf-8")
    assert "study.json is not that of a study" in one_line(svo("report", out))
