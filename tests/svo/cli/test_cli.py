from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from svo.cli import app
from svo.studies.isolation.store import StudyFolder
from tests.svo.observers.long_chains import long_chains


def svo(*arguments: str | Path) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def one_line(result: Any) -> str:
    """The error of a command that failed as it should."""
    assert result.exit_code == 1
    lines = [line for line in result.stderr.splitlines() if line.startswith("error:")]
    assert len(lines) == 1
    assert "Traceback" not in result.output + result.stderr
    return lines[0]


@pytest.fixture
def log(registered_tank: str, tmp_path: Path) -> Path:
    path = tmp_path / "log.csv"
    result = svo(
        "simulate", "tank", "--fault", "gauge", "--profile", "step", "--noise", "calm", "--seed", "4", "--out", path
    )
    assert result.exit_code == 0, result.output
    return path


def edited(log: Path, line: int, column: str, cell: str) -> Path:
    rows = [row.split(",") for row in log.read_text().splitlines()]
    rows[line - 1][rows[0].index(column)] = cell
    log.write_text("".join(",".join(row) + "\n" for row in rows))
    return log


def test_plants_are_listed_with_what_they_have(registered_tank: str) -> None:
    assert "tank: Water tank <with> two gauges" in svo("plants").stdout
    every = {plant["name"]: plant for plant in json.loads(svo("plants", "--json").stdout)}
    assert every["tank"]["faults"] == {"leak": ["step", "ramp"], "gauge": ["step"]}
    assert [column["name"] for column in every["tank"]["columns"]["outputs"]] == ["gauge_1", "gauge_2"]
    assert every["eclipse"]["Ts"] == 0.01


@pytest.mark.parametrize("command", ["plants", "study", "report", "simulate", "detect", "watch", "verify"])
def test_every_command_has_help_with_an_example(command: str) -> None:
    result = svo(command, "--help")
    assert result.exit_code == 0
    assert f"Example: svo {command}" in " ".join(result.stdout.split())


def test_the_module_is_the_command(registered_tank: str) -> None:
    done = subprocess.run([sys.executable, "-m", "svo", "plants"], capture_output=True, text=True, check=True)
    assert "tank:" in done.stdout


def test_start_up_imports_nothing_heavy() -> None:
    heavy = ("scipy", "matplotlib", "pyarrow", "flint")
    code = f"import sys, svo.cli; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"


def test_listing_the_plants_imports_no_scipy_signal() -> None:
    list_plants = "import sys; from svo.cli import app; app(['plants'], standalone_mode=False)"
    code = f"{list_plants}; print('scipy.signal' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"


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


def test_a_healthy_log_has_no_fault(registered_tank: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    assert svo("simulate", "tank", "--out", path).exit_code == 0
    result = svo("detect", "tank", path)
    assert result.exit_code == 0
    assert "No fault: the nominal model explains all 40 samples" in result.stdout
    assert json.loads(svo("detect", "tank", path, "--json").stdout)["alive"] == ["nominal", "leak", "gauge"]


def test_a_missing_measurement_is_no_alarm_and_no_error(registered_tank: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    svo("simulate", "tank", "--out", path)
    for line, column in ((2, "gauge_1"), (7, "gauge_1"), (7, "gauge_2")):
        edited(path, line, column, "")
    assert "No fault" in svo("detect", "tank", path).stdout


def test_a_log_that_measures_nothing_is_no_healthy_one(log: Path) -> None:
    rows = [row.split(",") for row in log.read_text().splitlines()]
    for name in ("gauge_1", "gauge_2"):
        for row in rows[1:]:
            row[rows[0].index(name)] = ""
        log.write_text("".join(",".join(row) + "\n" for row in rows))
        if name == "gauge_1":
            assert "note:" in svo("detect", "tank", log).stderr
            assert "no measurement of 'gauge_1'" in svo("calibrate", "tank", log).stderr
    for command in ("detect", "calibrate"):
        assert "has no measurement: 'gauge_1', 'gauge_2' empty in every row" in one_line(svo(command, "tank", log))


@pytest.mark.parametrize(
    ("line", "column", "cell", "expected"),
    [
        (1, "gauge_1", "gauge one", "no column 'gauge_1'"),
        (5, "gauge_1", "inf", "line 5, column 'gauge_1': 'inf' is not a finite number"),
        (5, "inflow", "", "line 5, column 'inflow': the cell is empty or NaN"),
        (5, "time_s", "0.2", "line 5, column 'time_s'"),
        (5, "time_s", "0.35", "expected the model's sampling time 0.1 s"),
        (5, "gauge_1", "3,4", "line 5: 6 cells; expected 5"),
    ],
)
def test_a_bad_log_is_one_line(log: Path, line: int, column: str, cell: str, expected: str) -> None:
    assert expected in one_line(svo("detect", "tank", edited(log, line, column, cell)))


def test_what_does_not_exist_is_one_line(log: Path, tmp_path: Path) -> None:
    assert "no plant is registered as 'tunk'" in one_line(svo("detect", "tunk", log))
    assert "has no noise set 'loud'; it has calm, rough" in one_line(svo("detect", "tank", log, "--noise", "loud"))
    assert "missing.csv: No such file" in one_line(svo("detect", "tank", tmp_path / "missing.csv"))
    assert "missing.jsonl: No such file" in one_line(svo("verify", tmp_path / "missing.jsonl"))
    (tmp_path / "folder.csv").mkdir()
    assert "folder.csv is a folder; expected a log file" in one_line(svo("detect", "tank", tmp_path / "folder.csv"))
    assert "is a folder; expected a log file" in one_line(svo("detect", "tank", tmp_path))
    assert "is a file, and no plant is registered by that name" in one_line(svo("detect", log, log))
    assert "has the suffix '.xls'; expected one of .csv, .parquet, .mat" in one_line(svo("detect", "tank", "log.xls"))
    simulate = ("simulate", "tank", "--out", tmp_path / "x.csv")
    assert "has no fault 'rust'" in one_line(svo(*simulate, "--fault", "rust"))
    assert "has no profile 'soft'; it has step" in one_line(svo(*simulate, "--fault", "gauge", "--profile", "soft"))
    assert "given without a fault" in one_line(svo(*simulate, "--profile", "step"))
    assert not (tmp_path / "x.csv").exists()


TO_A_FOLDER = [
    ("detect", "tank", "log.csv"), ("watch", "tank", "log.csv", "--until-end"), ("study", "tank"), ("compare", "tank"),
]  # fmt: skip


def no_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Any plant that a command asks for is work begun."""
    for name in ("registered_plants", "load_plant"):
        monkeypatch.setattr(f"svo.plant.{name}", lambda *_: pytest.fail("the destination was not checked first"))


@pytest.mark.parametrize("command", TO_A_FOLDER)
def test_a_folder_that_cannot_be_written_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]
) -> None:
    no_work(monkeypatch)
    file = tmp_path / "results"
    file.touch()
    assert "results is a file; expected a folder for the results" in one_line(svo(*command, "--out", file))
    assert f"cannot be made, since {file} is a file" in one_line(svo(*command, "--out", file / "more"))
    monkeypatch.setattr("os.access", lambda path, mode: not mode & os.W_OK)
    for folder in (tmp_path, tmp_path / "new" / "newer"):
        message = one_line(svo(*command, "--out", folder))
        assert f"{folder} cannot be written: no permission to write to {tmp_path};" in message
    assert "cannot be written: no permission" in one_line(svo("report", tmp_path))
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("command", [("simulate", "tank"), ("design-input", "tank", "--fault=leak", "--horizon=3")])
def test_a_file_that_cannot_be_written_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]
) -> None:
    no_work(monkeypatch)
    (tmp_path / "folder.csv").mkdir()
    assert "folder.csv is a folder; expected the name of a file" in one_line(
        svo(*command, "--out", tmp_path / "folder.csv")
    )
    assert f"there is no folder {tmp_path / 'no'}; make it" in one_line(
        svo(*command, "--out", tmp_path / "no" / "x.csv")
    )
    assert "has the suffix '.txt'; expected" in one_line(svo(*command, "--out", tmp_path / "x.txt"))
    (tmp_path / "x.csv").touch()
    monkeypatch.setattr("os.access", lambda path, mode: not mode & os.W_OK)
    assert "no permission to write to" in one_line(svo(*command, "--out", tmp_path / "x.csv"))


@pytest.mark.parametrize(
    "command",
    [
        ("simulate", "cart.toml", "--out", "x.csv"), ("study", "cart.toml", "--out", "x"), ("distinguish", "cart.toml"),
        ("compare", "cart.toml", "--out", "x"), ("design-input", "cart.toml", "--fault=leak", "--horizon=3"),
    ],
)  # fmt: skip
def test_a_description_where_a_plant_must_be_simulated_is_one_line(
    registered_tank: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert one_line(svo(*command)) == "error: cart.toml: No such file or directory"
    shutil.copy(Path(__file__).parents[3] / "docs" / "examples" / "cart.toml", tmp_path / "cart.toml")
    message = one_line(svo(*command))
    assert message.startswith("error: cart.toml: describes a linear model for logs")
    assert "equations ([model.dynamics]) and [simulation], or a plant registered in Python" in message
    assert [path.name for path in tmp_path.iterdir()] == ["cart.toml"]


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_a_number_that_is_not_finite_is_refused(value: str) -> None:
    for command in (["distinguish", "no"], ["design-input", "no", "--fault", "f", "--horizon", "3"]):
        result = svo(*command, "--size", value)
        assert result.exit_code == 2
        assert f"Invalid value for '--size': {value} is not a finite number." in result.stderr
    result = svo("compare", "no", "--out", "x", "--rate", value)
    assert result.exit_code == 2
    assert "Invalid value for '--rate'" in result.stderr


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
    from svo.studies.isolation.store import StudyFolder

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


def test_the_whole_chain_is_proven(log: Path, tmp_path: Path) -> None:
    assert svo("detect", "tank", log, "--out", tmp_path).exit_code == 0
    result = svo("verify", tmp_path / "alarms.jsonl", "--full", log, "--json")
    assert result.exit_code == 0, result.output
    assert all("proven from the readings since" in check["reason"] for check in json.loads(result.stdout))
    assert "leave --log out" in one_line(svo("verify", tmp_path / "alarms.jsonl", "--full", log, "--log", log))


def test_a_plant_with_one_bank_has_no_architectures(log: Path, tmp_path: Path) -> None:
    for command in (["detect", "tank", log], ["study", "tank", "--out", tmp_path / "study"]):
        message = one_line(svo(*command, "--architecture", "II"))
        assert "plant 'tank' has one architecture only" in message
        assert "plant 'tank' has one kind of models only" in one_line(svo(*command, "--models", "lpv"))
    unknown = svo("study", "eclipse", "--architecture", "III", "--out", tmp_path / "study")
    assert "plant 'eclipse' has no architecture 'III'; it has I, II" in one_line(unknown)
    unknown = svo("detect", "eclipse", log, "--models", "cubic")
    assert "plant 'eclipse' has no kind of models 'cubic'; it has nonlinear, lpv" in one_line(unknown)


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
