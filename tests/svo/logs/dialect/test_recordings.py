"""Recordings of others are read by a description alone: a water loop, a servo, and a flight in a folder of topics."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

from svo import Log, find_plant, read_log
from svo.logs.columns import LogNote

MODEL = """
[model]
A = [[1.0]]
{B}C = {C}
n = {n}
[initial]
lower = [-1e9]
upper = [1e9]
"""

WATER = """
Ts = 1.0
[columns]
inputs = [{ name = "voltage", unit = "V" }]
outputs = [{ name = "flow", unit = "m^3/s" }, { name = "temperature", unit = "K" }]
[log]
separator = ";"
time = { column = "datetime", format = "iso" }
[log.columns]
voltage = { column = "Voltage", missing = "hold" }
flow = { column = "Volume Flow RateRMS", unit = "l/min" }
temperature = { column = "Temperature", unit = "degC" }
"""

SERVO = """
Ts = 0.001
[columns]
inputs = [{ name = "command", unit = "V" }]
outputs = [{ name = "position", unit = "m" }]
[log]
time = { column = "t" }
[log.columns]
command = { column = "vir" }
position = { column = "qm" }
"""

FLIGHT = """
Ts = 0.05
[columns]
outputs = [{ name = "pitch", unit = "rad" }, { name = "roll", unit = "rad" }, { name = "airspeed", unit = "m/s" }]
[log]
time = { column = "%time", unit = "ns", epoch = 1970-01-01, one_clock = true }
[log.columns]
pitch = { file = "mavros-nav_info-pitch.csv", column = "field.measured", unit = "deg", rate = 2.0 }
roll = { file = "mavros-nav_info-roll.csv", column = 6, unit = "deg", rate = 4.0 }
airspeed = { file = "mavros-nav_info-airspeed.csv", column = "field.measured" }
"""


def data() -> Path:
    folder = Path(os.environ.get("SVO_DATA", "")) / "skab"
    if "SVO_DATA" not in os.environ or not folder.is_dir():
        pytest.skip("SVO_DATA names no folder with recorded data (skab, emps, alfa)")
    pytest.importorskip("pint")
    return folder.parent


def read(path: Path, description: str, outputs: int, folder: Path) -> tuple[Log, list[str]]:
    model = MODEL.format(B="B = [[0.0]]\n" * ("inputs" in description), C=[[1.0]] * outputs, n=[1.0] * outputs)
    (folder / "plant.toml").write_text(description + model, encoding="utf-8")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LogNote)
        log = read_log(path, find_plant(folder / "plant.toml"))
    return log, [str(warning.message) for warning in caught]


@pytest.mark.parametrize("name", ["anomaly-free.csv", "valve1_0.csv"])
def test_the_water_loop_with_its_gaps(name: str, tmp_path: Path) -> None:
    path = data() / "skab" / name
    log, notes = read(path, WATER, 2, tmp_path)
    frame = pd.read_csv(path, sep=";", parse_dates=["datetime"])
    seconds = (frame["datetime"] - frame["datetime"][0]).dt.total_seconds().to_numpy()
    k = np.searchsorted(log.time, seconds)
    np.testing.assert_allclose(log.time[k], seconds, atol=1e-9)
    np.testing.assert_allclose(log.y[k, 0], frame["Volume Flow RateRMS"] / 60000, rtol=1e-12)
    np.testing.assert_allclose(log.y[k, 1], frame["Temperature"] + 273.15, rtol=1e-12)
    assert np.isnan(log.y[:, 0]).sum() == len(log) - len(frame)
    assert any("local ones without a zone" in note for note in notes)


def test_the_servo_from_its_mat_file(tmp_path: Path) -> None:
    path = data() / "emps" / "DATA_EMPS.mat"
    log, _ = read(path, SERVO, 1, tmp_path)
    right = loadmat(path)
    np.testing.assert_allclose(log.time, right["t"][:, 0] - right["t"][0, 0], atol=1e-7)
    np.testing.assert_array_equal(log.u, right["vir"])
    np.testing.assert_array_equal(log.y, right["qm"])


def test_the_flight_from_a_folder_of_topics(tmp_path: Path) -> None:
    """Stamps that jitter: an angle is moved at the price of its rate, the airspeed is missing where it is off."""
    path = data() / "alfa"
    log, notes = read(path, FLIGHT, 3, tmp_path)
    frame = pd.read_csv(path / "mavros-nav_info-pitch.csv")
    stamps = frame["%time"].to_numpy()
    at = (stamps - stamps[0]) / 1e9
    for k in range(0, len(log), 50):
        if np.isnan(log.y[k, 0]):
            continue
        nearest = int(np.argmin(np.abs(at - log.time[k])))
        assert abs(at[nearest] - log.time[k]) <= 0.025 + 1e-9
        assert log.y[k, 0] == pytest.approx(np.radians(frame["field.measured"][nearest]))
    assert log.widening is not None
    assert 0 < log.widening[0] <= 2.0 * 0.025 + 1e-12
    assert log.widening[2] == 0
    assert any("pitch: readings are moved by up to 0.02" in note for note in notes)
    assert any("airspeed" in note and "off the grid by more than 1 %" in note for note in notes)
