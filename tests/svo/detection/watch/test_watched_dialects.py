"""``svo watch`` reads wide text of a dialect line by line, to the alarms that ``svo detect`` finds."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from time import process_time

import numpy as np
import pytest
from typer.testing import CliRunner

from svo import detect, find_plant, read_log, verify
from svo.cli import app
from svo.detection.watch.session import Session
from svo.isolation import Alarm, write_alarms
from svo.logs.columns import LogNote
from svo.plant.description import DescribedPlant
from tests.svo.logs.dialect.carts import EXAMPLE, cart
from tests.svo.logs.dialect.test_twelve_dialects import TABLES, logs

TABLE = """[log]
separator = ";"
decimal = ","
header = 3
first_row = 5
skip = ["^#"]
missing = ["---"]
valid = { column = "ok", good = [1] }
time = { column = "Zeit", format = "%d.%m.%Y %H:%M:%S,%f" }
[log.columns]
force = { column = "Kraft", missing = "hold" }
position = { column = "Weg", unit = "mm", resolution = 0.2 }
"""


def lines() -> list[str]:
    """The log of the example as a spreadsheet has it, with all that may stand in one."""
    plain = read_log(EXAMPLE.with_suffix(".csv"), find_plant(EXAMPLE))
    text = ["Versuch 7", "", "Zeit;Kraft;Weg;ok;", ";N;mm;;"]
    for k, (u, y) in enumerate(zip(plain.u[:, 0].tolist(), plain.y[:, 0].tolist(), strict=True)):
        force = "" if k == 30 else f"{u!r}"
        position = "---" if k == 7 else f"{1000 * y:.1f}"
        cells = f"{force};{position};{int(k != 9)};".replace(".", ",")
        text.append(f"14.03.2025 10:15:{k // 10:02d},{k % 10};{cells}")
        if k % 20 == 0:
            text += ["# a remark", ";;;;", "Zeit;Kraft;Weg;ok;"]
    return text


def watched(plant: DescribedPlant, text: list[str]) -> tuple[list[Alarm], Session]:
    session = Session(plant, "stated", "log.txt")
    alarms = [alarm for line in text for alarm in session.feed(line)]
    alarms += [alarm for event in session.finish() for some in session.take(event) for alarm in some]
    return alarms, session


def test_lines_lead_to_the_alarms_of_the_whole_log(tmp_path: Path) -> None:
    plant = cart(tmp_path, TABLE)
    (tmp_path / "log.txt").write_text("\n".join(lines()) + "\n", encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogNote)
        log = read_log(tmp_path / "log.txt", plant)
    right = detect(plant, log).alarms
    found, session = watched(plant, lines())
    assert {(a.observer, a.sample, a.model) for a in found} == {(a.observer, a.sample, a.model) for a in right}
    assert len(found) == 2
    np.testing.assert_allclose([a.time for a in found], [a.time for a in right], atol=1e-9)
    assert (session.samples, session.counts.bad, session.counts.held) == (
        80,
        0,
        2,
    )  # an empty cell, and a row that is not valid
    write_alarms(tmp_path / "alarms.jsonl", found)
    assert verify(tmp_path / "alarms.jsonl", log, plant=plant).ok


def test_a_line_that_cannot_be_read_is_a_bad_one_and_its_reading_is_missing(tmp_path: Path) -> None:
    text = lines()
    text[12] = text[12].rpartition(";1;")[0].rpartition(";")[0] + ";Bad Input;1;"
    _, session = watched(cart(tmp_path, TABLE), text)
    assert session.counts.bad == 1
    assert "column 'Weg': 'Bad Input' is no number" in session.take_notes()[0]
    assert session.samples == 80


@pytest.mark.parametrize("name", ["g10_controller_rates.csv", "g05_historian.csv"])
def test_a_dialect_of_wide_text_is_watched(name: str, tmp_path: Path) -> None:
    text = (logs() / name).read_text(encoding="utf-8").split("\n")[:-1]
    alarms, session = watched(cart(tmp_path, TABLES[name]), [line.rstrip("\r") for line in text])
    assert not alarms
    assert (session.samples, session.counts.bad) == ({"g10_controller_rates.csv": 30, "g05_historian.csv": 50}[name], 0)


def test_a_saved_state_goes_on_with_the_same_times(tmp_path: Path) -> None:
    plant, text = cart(tmp_path, TABLE), lines()
    whole, _ = watched(plant, text)
    first = Session(plant, "stated", "log.txt")
    found = [alarm for line in text[:50] for alarm in first.feed(line)]
    arrays, rest = first.state()
    again = Session(plant, "stated", "log.txt")
    again.resume(arrays, json.loads(json.dumps(rest)))
    found += [alarm for line in text[50:] for alarm in again.feed(line)]
    assert [(a.observer, a.time) for a in found] == [(a.observer, a.time) for a in whole]


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("[log]", '[log]\norder = "sort"', 'order = "sort"'),
        ("[log]", "[log]\npart = 1", "part"),
        ("[log]", '[log]\nencoding = "utf-16-le"', "encoding = 'utf-16-le'"),
        ('%S,%f" }', '%S,%f", zone = "Europe/Berlin" }', "time.zone"),
        ('"mm", resolution = 0.2', '"mm", held = 0.2', "columns.position.held"),
        ('"mm", resolution = 0.2', '"mm", rate = 2.0', "columns.position.rate"),
        ('"mm", resolution = 0.2', '"mm", every = 2', "columns.position.every"),
    ],
)
def test_what_cannot_be_watched_is_named_at_once(old: str, new: str, key: str, tmp_path: Path) -> None:
    assert old in TABLE
    cart(tmp_path, TABLE.replace(old, new))
    done = CliRunner().invoke(
        app, ["watch", str(tmp_path / "my_cart.toml"), str(tmp_path / "my_cart.toml"), "--until-end"]
    )
    assert done.exit_code == 1
    assert key in done.stderr
    assert "svo detect for the whole log" in done.stderr


def test_a_row_takes_less_than_two_milliseconds(tmp_path: Path) -> None:
    session = Session(cart(tmp_path, TABLE), "stated", "log.txt")
    text = lines()
    for line in text[:5]:
        list(session.events(line))
    rows = [line for line in text[5:] if line[:2] == "14"]
    begun = process_time()
    for line in rows:
        list(session.events(line))
    assert (process_time() - begun) / len(rows) < 2e-3
