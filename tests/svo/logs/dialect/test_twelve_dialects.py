"""The logs of twelve dialects are read to their numbers by the tables of the page of dialects."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from svo import Log, detect
from tests.svo.logs.dialect.carts import cart, reading

PAGE = (Path(__file__).parents[4] / "docs" / "dialects.md").read_text(encoding="utf-8")
TABLES = dict(re.findall(r"^## .*?`(g\d\d_\w+(?:\.\w+)?)`.*?^```toml\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE))


class Numbers(NamedTuple):
    """What must be read: samples, start, two samples as (time, force, position), and the times without a position."""

    samples: int
    start: str
    at: tuple[tuple[float, float, float], ...]
    missing: tuple[float, ...]


LONG = (1.0, 0.997, 0.1812), (4.0, -0.279, 2.7002)
BERLIN = "2025-03-14 09:15:00 UTC"
NUMBERS = {
    "g01_spreadsheet_de.csv": Numbers(50, BERLIN, LONG, (0.7, 2.3)),
    "g02_labview.lvm": Numbers(50, "2025-03-14 10:15:00 local time", LONG, (1.2, 1.3)),
    "g03_influx_annotated.csv": Numbers(28, BERLIN, (LONG[0], (2.5, -0.572, 1.7835)), (0.5, 0.6, 1.7)),
    "g04_hmi_tags.csv": Numbers(24, BERLIN, (LONG[0], (2.0, 0.141, 1.1211)), (0.6, 1.5)),
    "g05_historian.csv": Numbers(50, "2025-03-14 10:15:00 local time", LONG, (0.4, 1.9, 2.0, 3.3)),
    "g06_topics": Numbers(28, "112.345678 s", ((0.9, 0.976, 0.1686), (2.5, -0.572, 1.7835)), (1.0, 2.0)),
    "g07_station.dat": Numbers(50, "2025-10-26 00:59:57.5 UTC", LONG, (0.9, 3.0)),
    "g08_restarted.csv": Numbers(28, "0 s", ((1.0, -0.996, 2.421), (2.0, 0.017, 2.656)), (0.8, 0.9)),
    "g09_bench_utf16.txt": Numbers(40, "2025-03-04 10:15:00 local time", (LONG[0], (3.0, -0.978, 2.2673)), (1.5, 1.6)),
    "g10_controller_rates.csv": Numbers(30, "0 s", (LONG[0], (2.0, 0.141, 1.1211)), (0.8, 2.1)),
    "g11_scope.mat": Numbers(50, "0 s", LONG, (0.3, 3.7)),
    "g12_timetable_held.csv": Numbers(
        50, "0 s", ((1.0, 0.997, 0.18), (4.0, -0.279, 2.7)), tuple(k / 10 for k in range(50) if k % 2 or k == 18)
    ),
}


def logs() -> Path:
    folder = Path(os.environ.get("SVO_DATA", "")) / "logs"
    if "SVO_DATA" not in os.environ or not folder.is_dir():
        pytest.skip("SVO_DATA names no folder with logs/, the logs of twelve dialects")
    return folder


def changed(name: str, old: str, new: str) -> str:
    """The table of a log with another text in it."""
    assert old in TABLES[name]
    return TABLES[name].replace(old, new)


@pytest.mark.parametrize("name", NUMBERS)
def test_a_log_is_read_to_its_numbers(name: str, tmp_path: Path) -> None:
    found, right = reading(logs() / name, TABLES[name], tmp_path), NUMBERS[name]
    log = found.log
    assert (len(log), found.start) == (right.samples, right.start)
    np.testing.assert_allclose(log.time, np.arange(right.samples) * 0.1, atol=1e-9)
    for time, force, position in right.at:
        k = round(time / 0.1)
        np.testing.assert_allclose([log.u[k, 0], log.y[k, 0]], [force, position], rtol=0, atol=1e-9)
    np.testing.assert_allclose(log.time[np.isnan(log.y[:, 0])], right.missing, atol=1e-9)


@pytest.mark.parametrize("name", NUMBERS)
def test_a_healthy_log_raises_no_alarm(name: str, tmp_path: Path) -> None:
    # The second part of the restarted one begins at 1.39 m, and so does its set of first states.
    start = ("upper = [1.0, 1.0]", "upper = [2.0, 2.0]") if name == "g08_restarted.csv" else ("", "")
    plant = cart(tmp_path, TABLES[name], change=start)
    assert not detect(plant, reading_of(name, tmp_path)).alarms


def reading_of(name: str, folder: Path) -> Log:
    return reading(logs() / name, TABLES[name], folder).log


def test_the_first_part_of_a_restarted_log(tmp_path: Path) -> None:
    log = reading(logs() / "g08_restarted.csv", changed("g08_restarted.csv", "part = 2", "part = 1"), tmp_path).log
    assert len(log) == 22
    assert np.flatnonzero(np.isnan(log.y[:, 0])).tolist() == [10]
    np.testing.assert_allclose([log.u[9, 0], log.y[9, 0]], [0.976, 0.1686], atol=1e-12)
    np.testing.assert_allclose([log.time[21], log.u[21, 0], log.y[21, 0]], [2.1, -0.008, 1.2122], atol=1e-12)


def test_an_input_that_is_held_is_what_it_was(tmp_path: Path) -> None:
    log = reading_of("g05_historian.csv", tmp_path)
    np.testing.assert_allclose(log.u[40:42, 0], -0.279, atol=1e-12)


def test_half_of_the_resolution_is_added_to_the_noise(tmp_path: Path) -> None:
    assert reading_of("g12_timetable_held.csv", tmp_path).widening.tolist() == [0.01]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("name", "old", "new", "alarm"),
    [
        ("g06_topics", ', valid = { column = "xy_valid", good = [1] }', "", 1.0),
        ("g07_station.dat", "sentinels = [-7999]", "", 3.0),
        ("g12_timetable_held.csv", "held = 0.2, resolution = 0.02", "scale = 1", 1.4),
        ("g01_spreadsheet_de.csv", ', unit = "mm"', "", 0.0),
    ],
)
def test_a_fact_that_is_left_out_is_a_false_alarm(name: str, old: str, new: str, alarm: float, tmp_path: Path) -> None:
    plant = cart(tmp_path, changed(name, old, new))
    found = detect(plant, reading(logs() / name, changed(name, old, new), tmp_path).log)
    assert found.detected_s == pytest.approx(alarm)


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("g01_spreadsheet_de.csv", 'encoding = "cp1252"', "", ["line 1", "0xb0", "not utf-8", "cp1252"]),
        ("g01_spreadsheet_de.csv", 'decimal = ","', "", ["line 2", "'0,000'", 'decimal = ","']),
        ("g01_spreadsheet_de.csv", 'format = "%d.%m.%Y %H:%M:%S,%f", zone', "zone", ["line 2", "%d.%m.%Y %H:%M:%S,%f"]),
        ("g02_labview.lvm", "header = 24", "header = 100", ["ends at line 74", "line 100"]),
        ("g02_labview.lvm", '"Cart position (Laser)"', '"Comment"', ["line 37", "LOST COMMUNICATION"]),
        ("g03_influx_annotated.csv", 'tag = "position"', 'tag = "pos"', ["'pos'", "there are force, position"]),
        (
            "g04_hmi_tags.csv",
            'column = "Time_ms", unit = "day", scale = 1e-6, epoch = 1899-12-30',
            'column = "TimeString", format = "%d.%m.%Y %H:%M:%S"',
            ["20 rows", "09:15:00", "resolution", "1 s", "'Time_ms' has more"],
        ),
        ("g04_hmi_tags.csv", 'unit = "day", scale = 1e-6', 'unit = "ms"', ["read as ms", '"day" and scale = 1e-6']),
        ("g05_historian.csv", ', missing = "hold"', "", ["line 48", "No Data", "4.1 s", "force", 'missing = "hold"']),
        ("g05_historian.csv", 'thousands = ","', "", ["line 28", "'1,212.2'", "both marks", 'thousands = ","']),
        ("g05_historian.csv", '"I/O Timeout", ', "", ["line 27", "P1.CART.POS.PV", "'I/O Timeout'", "missing"]),
        ("g06_topics", 'file = "cart_local_position_0.csv", ', "", ["a folder", "file", "cart_local_position_0.csv"]),
        ("g06_topics", ", every = 2", "", ["line 3", "each 0.05 s", "every = 2"]),
        ("g07_station.dat", ', zone = "Europe/Berlin"', "", ["line 30", "back by 3599.9 s", "summer time", "part"]),
        (
            "g08_restarted.csv",
            "part = 2",
            "",
            ["line 28", "2.1 s to 0 s", "line 27", "2 recordings", "22 and 28", "part"],
        ),
        (
            "g09_bench_utf16.txt",
            ', format = "%d/%m/%Y %I:%M:%S.%f %p"',
            "",
            ["line 6", "04 March 2025 or 03 April 2025", "%d/%m/%Y %I:%M:%S.%f %p", "%m/%d/%Y %I:%M:%S.%f %p"],
        ),
        ("g09_bench_utf16.txt", 'missing = ["∞", "-∞"]', "", ["line 21", "'Position'", "'∞'", "missing"]),
        ("g10_controller_rates.csv", "column = 3", 'column = "sensors/position"', ["columns 3 and 6", "number"]),
        ("g11_scope.mat", '"ScopeData.time"', '"tout"', ["tout has 491 samples", "has 50"]),
        (
            "g11_scope.mat",
            "signals(2).values",
            "signals(3).values",
            ["no element 3", "ScopeData.time (50 x 1)", "'force [N]'", "'position [mm]'", "tout (491 x 1)"],
        ),
        ("g12_timetable_held.csv", "held = 0.2", "held = 0.3", ["0.2 s", "0.6 s", "not held for 0.3 s"]),
    ],
)
def test_what_is_not_stated_is_one_clear_error(name: str, old: str, new: str, words: list[str], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=re.escape(name)) as caught:
        reading(logs() / name, changed(name, old, new), tmp_path)
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


def test_a_column_of_tagged_values_is_no_channel(tmp_path: Path) -> None:
    table = '[log]\nskip = ["^#"]\n[log.columns]\nforce = { column = "_value" }\nposition = { column = "_value" }\n'
    with pytest.raises(ValueError, match=r"asked for by force and by position; .* state long"):
        reading(logs() / "g03_influx_annotated.csv", table, tmp_path)


def test_an_input_in_every_second_row_is_too_slow(tmp_path: Path) -> None:
    name = "g10_controller_rates.csv"
    with pytest.raises(ValueError, match=r"line 3, .*force has no reading at 0.05 s \(and at 28 samples more\)"):
        reading(logs() / name, TABLES[name], tmp_path, Ts=0.05)


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("g01_spreadsheet_de.csv", ', zone = "Europe/Berlin"', "", "local ones without a zone"),
        ("g02_labview.lvm", "header = 24", "header = 24", "says Samples 100, but there are 50 rows"),
        (
            "g07_station.dat",
            "sentinels = [-7999]",
            "",
            "line 35, column 'Pos_mm': -7999 is far from all other readings",
        ),
        ("g12_timetable_held.csv", "held = 0.2, ", "", "25 of 48 readings repeat the one before; a sensor slower"),
        ("g01_spreadsheet_de.csv", ', unit = "mm"', "", "'Weg [mm]' is read in m; if it is in 'mm', state unit"),
    ],
)
def test_what_is_no_error_is_a_note(name: str, old: str, new: str, words: str, tmp_path: Path) -> None:
    notes = reading(logs() / name, changed(name, old, new), tmp_path).notes
    assert [note for note in notes if words in note], notes
