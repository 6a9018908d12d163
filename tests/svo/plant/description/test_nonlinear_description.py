"""Nonlinear plants in TOML: equations as text, parameters, faults of parameters, from a log to a proven alarm."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from polytopes import HPolytope
from svo import WindowObserver, detect, read_log
from svo.cli import app
from svo.models import ModelSample, model_digest
from svo.plant.description import read_description

EXAMPLES = Path(__file__).parents[4] / "docs" / "examples"
TANKS = (EXAMPLES / "two_tanks.toml").read_text(encoding="utf-8")


def described(tmp_path: Path, old: str = "", new: str = ""):
    """The plant of the example with one change."""
    assert old in TANKS
    path = tmp_path / "two_tanks.toml"
    path.write_text(TANKS.replace(old, new, 1), encoding="utf-8")
    return read_description(path)


def test_a_description_is_the_plant_that_it_says(tmp_path: Path) -> None:
    plant = described(tmp_path)
    model = plant.model
    assert model.names == {
        "states": ("h1", "h2"), "inputs": ("pump",), "outputs": ("level_1", "level_2"), "disturbances": ("d1", "d2"),
    }  # fmt: skip
    z = np.array([30.0, 12.0, 0.001, -0.001, *([0.0] * len(model.parameters)), 60.0])
    flow = 0.25 * np.sqrt(1962.0 * 18.0)
    expected = [(60.0 - flow) / 154.0 + 0.001, (flow - 0.3 * np.sqrt(1962.0 * 12.0)) / 154.0 - 0.001]
    assert model.flow.tape.values(z) == pytest.approx(expected, rel=1e-12)
    assert plant.faults["leak"].contains_nominal
    assert plant.faults["leak"].model.parameters["hole"] == (0.0, 0.2)
    assert plant.faults["leak"].model.parameters["pipe"] == 0.25


def test_the_commands_print_what_the_page_shows_and_say_what_is_not_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("two_tanks.toml", "two_tanks.csv"):
        shutil.copy(EXAMPLES / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    page = (EXAMPLES.parent / "nonlinear.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```console\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    commands = re.findall(r"^\$ svo (.*?)\n((?:[^$].*\n)*)", "".join(blocks), re.MULTILINE)
    assert len(commands) == 2
    for arguments, shown in commands:
        done = CliRunner().invoke(app, arguments.split())
        assert done.exit_code == 0, done.output
        assert re.sub(r"in \d+\.\d\d s", "", done.stdout) == re.sub(r"in \d+\.\d\d s", "", shown)
    chain = CliRunner().invoke(app, ["verify", "found/alarms.jsonl", "--full", "two_tanks.csv"])
    assert chain.exit_code == 0
    assert "2 of 2 alarms proven in exact arithmetic" in chain.output
    for line in (tmp_path / "found" / "alarms.jsonl").read_text(encoding="utf-8").splitlines():
        assert json.loads(line)["source"]["model"] == "nonlinear"


def test_what_is_undecided_is_shown_with_sample_and_coordinate(tmp_path: Path) -> None:
    physical = "physical = [[0.0, 0.0], [60.0, 60.0]]"
    plant = described(tmp_path, physical, f"{physical}\nvalid = [[0.0, 0.0], [38.0, 60.0]]")
    files = tmp_path / "two_tanks.toml", EXAMPLES / "two_tanks.csv", "--out", tmp_path / "out"
    done = CliRunner().invoke(app, ["detect", *map(str, files)])
    assert done.exit_code == 0, done.output
    said = re.search(r"undecided answers: \d+, the first of (\w+, outside: at sample (\d+), h1 .*)", done.stdout)
    assert said is not None
    written = json.loads((tmp_path / "out" / "verdict.json").read_text(encoding="utf-8"))
    assert written["undecided_because"] == said[1]
    found = detect(plant, read_log(EXAMPLES / "two_tanks.csv", plant))
    assert found.record.reason == found.reason == said[1]
    assert found.record.undecided[int(said[2])].any()


def test_a_watch_goes_on_where_it_was(tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "two_tanks.toml", tmp_path)
    lines = (EXAMPLES / "two_tanks.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    found = []
    for folder, cuts in (("whole", (len(lines),)), ("pieces", (3, 40, 62, len(lines)))):
        command = ["watch", str(tmp_path / "two_tanks.toml"), str(tmp_path / "log.csv"), "--until-end"]
        command += ["--out", str(tmp_path / folder), "--state", str(tmp_path / f"{folder}.state")]
        for cut in cuts:
            (tmp_path / "log.csv").write_text("".join(lines[:cut]), encoding="utf-8")
            done = CliRunner().invoke(app, command)
            assert done.exit_code == 0, done.output
        found.append((tmp_path / folder / "alarms.jsonl").read_bytes())
    assert found[0] == found[1]
    assert found[0].count(b"\n") == 2


def test_a_sensor_fault_is_any_error_of_its_size(tmp_path: Path) -> None:
    fault = '[faults.gauge]\ntype = "sensor"\noutput = "level_2"\nkind = "bias"\nmagnitude = -0.5\n\n[faults.leak]'
    plant = described(tmp_path, "[faults.leak]", fault)
    assert plant.faults["gauge"].contains_nominal
    assert plant.faults["gauge"].model.noise.tolist() == [0.1, 0.6]
    frozen = described(tmp_path, "[faults.leak]", fault.replace("bias", "hard")).faults["gauge"]
    assert frozen.model.parameters["hard of level_2"] == (0.0, 1.0)
    for old, new, why in (
        ('"level_2"\nkind', '"level_3"\nkind', "expected one or more of the columns level_1, level_2"),
        ('"bias"', '"frozen"', "expected one of bias, drift, scaling, hard"),
        ("magnitude = -0.5\n", "", "key 'magnitude': is missing"),
    ):
        with pytest.raises(ValueError, match=why):
            described(tmp_path, "[faults.leak]", fault.replace(old, new))


def test_faults_of_actuators_of_the_plant_and_of_equations(tmp_path: Path) -> None:
    tables = {
        "pump": 'type = "actuator"\ninput = "pump"\nkind = "loss"\nmagnitude = 0.5',
        "rain": 'type = "plant"\na = [0.01, 0.0]\nmagnitude = 1.0',
        "siphon": 'type = "parameter"\nparameters = { siphon = [0.0, 0.1] }\ncontains_nominal = true\n'
        'dynamics = { h2 = "(pipe * sroot(g2 * (h1 - h2)) - (outlet + siphon) * sqrt(g2 * h2)) / area + d2" }',
    }
    text = "".join(f"[faults.{name}]\n{table}\n\n" for name, table in tables.items())
    plant = described(tmp_path, "[faults.leak]", text + "[faults.leak]")
    assert all(fault.contains_nominal for fault in plant.faults.values())
    extra = {name: list(fault.model.parameters)[5:] for name, fault in plant.faults.items()}
    assert extra["pump"] == ["share of loss of pump"]
    assert extra["rain"] == ["plant fault"]
    assert extra["siphon"] == ["siphon"]
    assert len(plant.bank("stated").observers) == 6
    for old, new, why in (
        ("magnitude = 0.5", "magnitude = 1.5", r"\[faults.pump\]: magnitude is 1.5; expected the lost fraction"),
        ("a = [0.01, 0.0]", "a = [0.01]", r"\[faults.rain\]: a of the direction has shape \(1,\); expected \(2,\)"),
        ("(outlet + siphon)", "(outlet + sifon)", r"\[faults.siphon\]: f, row h2: unknown symbol 'sifon'.*'siphon'"),
        ('{ h2 = "(pipe', '{ h3 = "(pipe', r"\[faults.siphon\]: f has a row for 'h3'"),
        ("contains_nominal = true", "contains_nominal = false", "its observer needs a set to start from"),
    ):
        with pytest.raises(ValueError, match=why):
            described(tmp_path, "[faults.leak]", text.replace(old, new) + "[faults.leak]")


def test_an_alarm_of_other_equations_is_not_the_plants(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    plant, other = described(tmp_path), described(tmp_path, "area = 154.0", "area = 154.5")
    sample = ModelSample.of(plant.model.carrier, plant.model.carrier.schedule)
    digests = {model_digest(p.model, {"horizon": 10}, [sample]) for p in (plant, other)}
    assert len(digests) == 2
    observer = WindowObserver(plant.model, HPolytope.box([28, 10], [32, 14]))
    assert model_digest(plant.model, {"horizon": 10}, [sample]) in digests
    assert observer.options["horizon"] == 10


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("hole * sqrt", "leak * sqrt", r"\[model\]: f, row h1: unknown symbol 'leak'.*column"),
        ("g2 * h2)) / area + d2", "g2 * h2)) / area + d3", "row h2: unknown symbol 'd3'; expected one of h1, h2"),
        ("(pump - pipe", "(__import__('os') - pipe", "unknown function '__import__'"),
        ('level_1 = "h1"\n', "", r"\[model\], key 'outputs': are level_2; expected one each of level_1, level_2"),
        ("n = [0.1, 0.1] ", "n = [0.1] ", "n has shape"),
        ("n = [0.1, 0.1] ", "", r"\[model\], key 'n': is missing"),
        ("hole = 0.0", 'hole = "none"', r"\[parameters\], key 'hole': is 'none'; expected a number"),
        ("hole = 0.0", "hole = [0.2, 0.0]", "hole is between 0.2 and 0.0; expected lower <= upper"),
        ("d2 = 0.002 }", "d2 = inf }", r"\[model.disturbances\], key 'd2': is inf; expected finite numbers"),
        ("hole = 0.0", "hole = [0.0, inf]", r"\[parameters\], key 'hole': is \[0.0, inf\]; expected finite numbers"),
        ("hole = 0.0", "hole = [0.2]", r"\[parameters\], key 'hole': has shape \(1,\); expected a number, or"),
        ("physical = [[0.0, 0.0], [60.0, 60.0]]", "", "largest is missing"),
        ("d2 = 0.002 }", "d2 = -0.002 }", "key 'd2': is -0.002; expected a half-width that is not neg"),
        ('{ hole = [0.0, 0.2] }', "{ hol = [0.0, 0.2] }", "faults.leak.parameters.*did you mean 'hole'"),
        ('{ hole = [0.0, 0.2] }', "{}", r"\[faults.leak\], key 'parameters': is missing"),
        ('type = "parameter"\nparameters = { h', 'type = "model"\nparameters = { h', "one of parameter, sensor"),
        ('"parameter"\nparameters = { hole = [0.0, 0.2] }', '"plant"\nmagnitude = 1.0', "leak.: changes nothing"),
        ("lower = [28.0, 10.0]", "lower = [28.0]", r"\[initial\]"),
        (re.findall(r"h1 = .*\nh2 = .*\n", TANKS)[0], "", r"key 'dynamics': is empty; expected at least one row"),
        ('h1 = "(pump', 'h3 = "(pump', r"unknown symbol 'h1'"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_file_table_and_key(tmp_path: Path, old: str, new: str, why: str) -> None:
    with pytest.raises(ValueError, match=why) as caught:
        described(tmp_path, old, new)
    assert str(caught.value).startswith(str(tmp_path))
