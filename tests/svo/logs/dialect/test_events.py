"""Logs that keep their own times: channels of several rates and files are merged into events, nothing is resampled."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from svo import UncertainModel, WindowObserver, detect, find_plant, read_log, verify
from svo.analysis.calibration import calibrate
from svo.cli import app
from svo.detection.chains import PlantModels
from svo.detection.log_calibration import calibrate_log
from svo.detection.streamed import detect_streamed
from svo.isolation.alarms import alarm_line, check_alarm
from svo.logs.log import Log
from svo.models.intervals import has_own_intervals
from svo.plant.description import DescribedPlant, read_description
from svo.plant.imported import import_log
from svo.plant.long_log import survey_log

Array = NDArray[np.float64]
pytestmark = pytest.mark.filterwarnings("ignore::svo.logs.columns.LogNote")
PLANT = """
title = "a cart whose position and speed are read by clocks of their own"
Ts = 0.1
[columns]
inputs = [{ name = "force", unit = "N" }]
outputs = [{ name = "position", unit = "m" }, { name = "speed", unit = "m/s" }]
[log]
times = "events"
%s
[model]
continuous = true
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [1.0]]
E = [[0.0], [1.0]]
C = [[1.0, 0.0], [0.0, 1.0]]
n = [0.01, 0.05]
w = [0.1]
[initial]
lower = [-1.0, -1.0]
upper = [1.0, 1.0]
[faults.motor]
type = "actuator"
input = "force"
kind = "loss"
magnitude = 1.0
"""
FILES = """
time = { column = "t", unit = "ms", one_clock = true }
[log.columns]
force = { file = "commands.csv", missing = "hold" }
position = { file = "encoder.csv", resolution = 0.001 }
speed = { file = "tacho.csv" }
"""


def plant(folder: Path, table: str = "", text: str = PLANT) -> DescribedPlant:
    (folder / "cart.toml").write_text(text % table, encoding="utf-8")
    return read_description(folder / "cart.toml")


def wide(folder: Path, rows: str) -> Path:
    (folder / "log.csv").write_text("time_s,force,position,speed\n" + rows, encoding="utf-8")
    return folder / "log.csv"


def folder_of(place: Path, broken_from: float = np.inf, seed: int = 3) -> Path:
    """Three files of one run of six seconds, whose input changes at times of its own and is lost at some time [ms]."""
    rng = np.random.default_rng(seed)
    clocks = [np.round(np.cumsum(mean * rng.uniform(0.1, 1.9, 400))).astype(int) for mean in (130.0, 70.0, 210.0)]
    clocks = [np.unique(clock[clock < 6000]) for clock in clocks]
    changes = dict(zip(clocks[2].tolist(), np.round(rng.normal(size=clocks[2].size), 3).tolist(), strict=True))
    changes = {0: 0.5, **changes}
    x, u, now, states = np.array([0.2, 0.0]), 0.0, 0, {}
    for t in sorted({*changes, *clocks[0].tolist(), *clocks[1].tolist()}):
        dt, force = (t - now) / 1e3, (u if now < broken_from else 0.0) + rng.uniform(-0.1, 0.1)
        x = np.array([x[0] + dt * x[1] + 0.5 * dt**2 * force, x[1] + dt * force])
        states[t], now, u = x, t, changes.get(t, u)
    place.mkdir()
    for name, sensor, clock, width in (("encoder", 0, clocks[0], 0.01), ("tacho", 1, clocks[1], 0.05)):
        rows = [f"{t},{states[t][sensor] + rng.uniform(-width, width):.17g}" for t in clock.tolist()]
        text = f"t,{('position', 'speed')[sensor]}\n" + "\n".join(rows) + "\n"
        (place / f"{name}.csv").write_text(text, encoding="utf-8")
    commands = "t,force\n" + "".join(f"{t},{force}\n" for t, force in changes.items())
    (place / "commands.csv").write_text(commands, encoding="utf-8")
    return place


# -- how events are made ---------------------------------------------------------------------------------------


def test_a_table_keeps_its_times_and_an_input_that_does_not_change_is_no_event(tmp_path: Path) -> None:
    path = wide(tmp_path, "5.0,1,0.1,\n5.03,1,,0.2\n5.0301,1,,\n5.2,2,,\n5.25,2,0.3,0.4\n")
    log = read_log(path, plant(tmp_path))
    np.testing.assert_allclose(log.time, [0.0, 0.03, 0.2, 0.25], atol=1e-12)
    np.testing.assert_array_equal(log.u[:, 0], [1, 1, 2, 2])
    np.testing.assert_array_equal(log.y, [[0.1, np.nan], [np.nan, 0.2], [np.nan, np.nan], [0.3, 0.4]])
    assert log.events


def test_files_with_rates_of_their_own_are_merged_by_time(tmp_path: Path) -> None:
    log = read_log(folder_of(tmp_path / "run"), the_plant := plant(tmp_path, FILES))
    stamps = {
        name: np.loadtxt(tmp_path / "run" / name, delimiter=",", skiprows=1) for name in ("encoder.csv", "tacho.csv")
    }
    origin = 0.0
    for j, rows in enumerate(stamps.values()):
        read = ~np.isnan(log.y[:, j])
        np.testing.assert_allclose(log.time[read], rows[:, 0] / 1e3 - origin, atol=1e-9)
        np.testing.assert_array_equal(log.y[read, j], rows[:, 1])
    assert log.widening is not None
    assert log.widening.tolist() == [0.0005, 0.0]
    assert detect(the_plant, log).alarms == ()


def test_what_is_read_before_all_inputs_are_known_or_after_them_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    for name, rows in {
        "commands": "t,force\n10,1\n50,2\n",
        "encoder": "t,position\n0,0\n20,1\n60,2\n",
        "tacho": "t,speed\n30,5\n",
    }.items():
        (tmp_path / "run" / f"{name}.csv").write_text(rows, encoding="utf-8")
    table = FILES.replace(', missing = "hold"', "")
    with pytest.warns(UserWarning, match="2 readings of position, where an input is not known, are left out"):
        log = read_log(tmp_path / "run", plant(tmp_path, table))
    np.testing.assert_allclose(log.time, [0.0, 0.01, 0.02, 0.04])
    np.testing.assert_array_equal(log.u[:, 0], [1, 1, 1, 2])


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("0,1,0,0\n1,,0,0\n2,1,0,0\n", r"line 3, column 'force'.*: input force has no reading.*missing = \"hold\""),
        ("0,1,,\n1,2,,\n", "no sensor is read while force are known"),
        ("0,1,0,0\n0,1,1,0\n", "2 readings of position share 0 s"),
        ("1,1,0,0\n0,1,1,0\n", "time goes back"),
    ],
)
def test_a_log_that_is_none_of_events(tmp_path: Path, rows: str, message: str) -> None:
    path, the_plant = wide(tmp_path, rows), plant(tmp_path)
    with pytest.raises(ValueError, match=message):
        read_log(path, the_plant)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("continuous = true\n", "", r"\[log\].*times.*discrete time"),
        ("%s", "[log.columns]\nspeed = { every = 2 }", "every.*grid"),
        ("%s", "[log.columns]\nspeed = { rate = 2.0 }", "rate.*grid"),
        ('"events"', '"own"', "times.*events"),
    ],
)
def test_a_description_that_says_what_is_about_a_grid(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = PLANT.replace(old, new)
    (tmp_path / "cart.toml").write_text(text % "" if "%s" in text else text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_description(tmp_path / "cart.toml")


# -- what is done with them ------------------------------------------------------------------------------------


def test_a_fault_is_isolated_and_proven_from_the_log(tmp_path: Path) -> None:
    run = folder_of(tmp_path / "run", broken_from=3000.0)
    the_plant = plant(tmp_path, FILES)
    found = detect(the_plant, read_log(run, the_plant))
    assert found.fault == "motor"
    assert found.detected_s is not None
    assert found.detected_s > 2.5
    whole = verify(found, full=True)
    assert whole.ok, str(whole)
    assert "proven from the readings since sample" in whole.checks[0].reason
    streamed = detect_streamed(the_plant, survey_log(run, the_plant))
    assert [alarm_line(alarm) for alarm in streamed.alarms] == [alarm_line(alarm) for alarm in found.alarms]
    assert streamed.detected_s == found.detected_s


def test_a_proof_is_about_the_intervals_of_its_log(tmp_path: Path) -> None:
    """With another time of one sample the matrices are not those of the plant any more."""
    run = folder_of(tmp_path / "run", broken_from=3000.0)
    the_plant = plant(tmp_path, FILES)
    found = detect(the_plant, read_log(run, the_plant))
    found.save(tmp_path / "found")
    alarms = tmp_path / "found" / "alarms.jsonl"
    assert verify(alarms, run, plant=the_plant).ok
    last = found.alarms[0].sample
    time = found.log.time.copy()
    time[last - 1] += 1e-3
    moved = Log(time, found.log.u, found.log.y, source=found.log.source, events=True, widening=found.log.widening)
    checks = verify(alarms, moved, plant=the_plant)
    assert not checks.ok
    assert "the times between its samples are not those of the log" in str(checks)
    silent = replace(found.alarms[0], dt=None)  # as a record without times would be
    check = check_alarm(silent, moved, PlantModels(the_plant, moved).difference)
    assert not check.ok
    assert "the matrices of sample" in check.reason


def test_the_commands_read_events(tmp_path: Path) -> None:
    run = folder_of(tmp_path / "run", broken_from=3000.0)
    plant(tmp_path, FILES)
    toml, out = str(tmp_path / "cart.toml"), str(tmp_path / "found")
    run_it = CliRunner().invoke
    answer = run_it(app, ["detect", toml, str(run), "--out", out, "--json"])
    assert json.loads(answer.stdout)["fault"] == "motor"
    assert run_it(app, ["verify", f"{out}/alarms.jsonl", "--full", str(run)]).exit_code == 0
    refused = run_it(app, ["watch", toml, str(run / "encoder.csv"), "--until-end"])
    assert refused.exit_code != 0
    assert "columns.position.file" in refused.output


def test_an_imported_log_of_events_is_one(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    run, the_plant = folder_of(tmp_path / "run"), plant(tmp_path, FILES)
    imported = import_log(run, the_plant, tmp_path / "plain.parquet")
    assert "samples at times of their own" in str(imported)
    with pytest.warns(UserWarning, match="imported from run"):
        log = read_log(tmp_path / "plain.parquet", the_plant)
    assert log.events
    for name in ("time", "u", "y", "widening"):
        np.testing.assert_array_equal(getattr(log, name), getattr(imported.log, name))
    with pytest.warns(UserWarning, match="imported from run"):
        survey = survey_log(tmp_path / "plain.parquet", the_plant)
    assert survey.samples == len(log)


@pytest.mark.parametrize(
    ("bounds", "varying"),
    [(("noise position", "noise speed"), ""), (("noise", "disturbances"), 'varying = "w"')],
)
def test_bounds_that_are_too_narrow_are_calibrated_on_events(
    bounds: tuple[str, ...], varying: str, tmp_path: Path
) -> None:
    narrow = PLANT.replace("w = [0.1]", f"w = [0.02]\n{varying}").replace("n = [0.01, 0.05]", "n = [0.004, 0.02]")
    the_plant = plant(tmp_path, FILES, narrow)
    whole = read_log(folder_of(tmp_path / "run"), the_plant)
    log = Log(whole.time[:25], whole.u[:25], whole.y[:25], events=True)
    assert WindowObserver(the_plant.model, the_plant.initial).run(log).falsified_at is not None
    found = calibrate(the_plant.model, log, the_plant.initial, bounds=bounds)
    assert found.widenings
    assert not found.smallest
    assert {w.bound for w in found.widenings} <= set(found.chosen)
    assert "falsified" not in WindowObserver(found.model, the_plant.initial).run(log).verdicts
    assert has_own_intervals(found.model)
    if not varying:
        assert "A sufficient widening" in calibrate_log(the_plant, log, "stated").to_text()


def test_what_takes_a_grid_only_says_so(tmp_path: Path) -> None:
    the_plant = plant(tmp_path, FILES)
    log = read_log(folder_of(tmp_path / "run"), the_plant)
    A, B, C = (the_plant.model.block(name) for name in "ABC")
    with pytest.raises(ValueError, match=r"keeps its own times.*in discrete time"):
        calibrate(UncertainModel(A, B, C, n=[0.01, 0.05], Ts=0.1), log, the_plant.initial)
    with pytest.raises(ValueError, match="a Delta or a polytope"):
        calibrate(the_plant.faults["motor"].model, log, the_plant.initial)
    with pytest.raises(ValueError, match='times = "events"'):
        detect(the_plant, Log(log.time, log.u, log.y))
    cart = find_plant(Path(__file__).parents[4] / "docs" / "examples" / "cart.toml")
    with pytest.raises(ValueError, match="sampling time"):
        detect(cart, Log([0.0, 0.3], [[0.0], [0.0]], [[0.0], [0.0]], events=True))
