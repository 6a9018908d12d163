"""The command line: what it lists, what it finds in a log, and one line for whatever is wrong."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.svo.commands import edited, one_line, svo


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


def test_a_plant_with_one_bank_has_no_architectures(log: Path, tmp_path: Path) -> None:
    for command in (["detect", "tank", log], ["study", "tank", "--out", tmp_path / "study"]):
        message = one_line(svo(*command, "--architecture", "II"))
        assert "plant 'tank' has one architecture only" in message
        assert "plant 'tank' has one kind of models only" in one_line(svo(*command, "--models", "lpv"))
    unknown = svo("study", "eclipse", "--architecture", "III", "--out", tmp_path / "study")
    assert "plant 'eclipse' has no architecture 'III'; it has I, II" in one_line(unknown)
    unknown = svo("detect", "eclipse", log, "--models", "cubic")
    assert "plant 'eclipse' has no kind of models 'cubic'; it has nonlinear, lpv" in one_line(unknown)
