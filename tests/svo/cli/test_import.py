"""``svo import`` writes plain logs that say where they come from; ``--guess`` proposes a table and reads nothing."""

from __future__ import annotations

import hashlib
import json
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest

from svo import Log, detect, find_plant, read_log, verify
from svo.logs.columns import LogNote
from svo.plant.description import DescribedPlant
from svo.plant.imported import told_of
from tests.svo.commands import svo
from tests.svo.logs.dialect.carts import EXAMPLE, cart
from tests.svo.logs.dialect.test_twelve_dialects import NUMBERS, TABLES, logs

TABLE = """[log]
separator = ";"
decimal = ","
missing = ["---"]
time = { column = "Zeit", unit = "ms" }
[log.columns]
force = { column = "Kraft" }
position = { column = "Weg [mm]", unit = "mm", resolution = 0.2 }
"""
CLEAN = Path(__file__).parents[3] / "docs" / "examples" / "cart.csv"


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """The log of the example as a spreadsheet has it, fault and all."""
    plain = read_log(CLEAN, find_plant(EXAMPLE))
    rows = ["Zeit;Kraft;Weg [mm]"]
    for k, (u, y) in enumerate(zip(plain.u[:, 0].tolist(), plain.y[:, 0].tolist(), strict=True)):
        rows.append(f"{100 * k};{u!r};{'---' if k == 7 else f'{1000 * y:.1f}'}".replace(".", ","))
    path = tmp_path / "recording.txt"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    cart(tmp_path, TABLE)
    return path


def quietly(path: Path, plant: object) -> Log:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogNote)
        return read_log(path, plant)  # type: ignore[arg-type]


def test_an_imported_log_is_what_was_read(recording: Path) -> None:
    toml, out = recording.with_name("my_cart.toml"), recording.with_name("log.parquet")
    done = svo("import", recording, "--toml", toml, "--out", out)
    assert done.exit_code == 0, done.output
    assert "80 samples of 0.1 s, 0 to 7.9 s, the first one at 0 s" in done.stdout
    assert "force: -0.999 to 0.999 N, 0 missing" in done.stdout
    assert "1 missing" in done.stdout
    assert "n of position is wider on this log, by 0.0001 m" in done.stdout
    plant = find_plant(toml)
    direct, imported = quietly(recording, plant), quietly(out, plant)
    for name in ("time", "u", "y", "widening"):
        np.testing.assert_array_equal(getattr(direct, name), getattr(imported, name))


def test_an_imported_log_says_where_it_comes_from(recording: Path) -> None:
    toml, out = recording.with_name("my_cart.toml"), recording.with_name("log.parquet")
    done = svo("import", recording, "--toml", toml, "--out", out, "--json")
    said = json.loads(done.stdout)
    digest = hashlib.sha256(recording.read_bytes()).hexdigest()
    told = told_of(out)
    assert told is not None
    assert told.sha256 == said["sha256"] == {"recording.txt": digest}
    assert json.loads(told.log or "")["columns"]["position"]["unit"] == "mm"
    assert (said["samples"], said["channels"][1]["missing"], said["widening"]) == (80, 1, [0.0001])
    with pytest.warns(LogNote, match=rf"was imported from recording\.txt: recording\.txt \(SHA-256 {digest}\)"):
        read_log(out, find_plant(toml))
    other = cart(recording.parent, TABLE.replace("resolution = 0.2", "resolution = 0.1"))
    with pytest.warns(LogNote) as noted:
        read_log(out, other)
    assert "imported by another [log] table" in str(noted[1].message)


def test_alarms_of_an_imported_log_are_those_of_its_source_and_are_proven(recording: Path) -> None:
    toml, out = recording.with_name("my_cart.toml"), recording.with_name("log.parquet")
    svo("import", recording, "--toml", toml, "--out", out)
    for log in (recording, out):
        folder = recording.with_name(f"found_{log.suffix[1:]}")
        done = svo("detect", toml, log, "--out", folder)
        assert "Fault isolated at 5.0 s: sensor." in done.stdout, done.output
        for option in ("--log", "--full") if log is out else ("--log",):
            done = svo("verify", folder / "alarms.jsonl", option, log)
            assert "2 of 2 alarms proven" in done.stdout, done.output
    assert "was imported from recording.txt" in done.stderr


def test_the_widening_is_in_the_models_of_the_alarms(recording: Path) -> None:
    """Without it, or with another one, they are not those of the plant."""
    plant = find_plant(recording.with_name("my_cart.toml"))
    log = quietly(recording, plant)
    found = detect(plant, log)
    assert verify(found).ok
    assert isinstance(plant, DescribedPlant)
    assert log.widening is not None
    stated, wider = plant.bank("stated").observers, plant.widened(log.widening).bank("stated").observers
    for name, observer in wider.items():
        np.testing.assert_allclose(observer.model.n, stated[name].model.n + 0.0001, err_msg=name)
    folder = recording.with_name("found")
    found.save(folder)
    narrow = Log(log.time, log.u, log.y)
    assert not verify(folder / "alarms.jsonl", narrow, plant=plant).ok


def test_calibration_takes_the_widening(recording: Path) -> None:
    done = svo("calibrate", recording.with_name("my_cart.toml"), recording)
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{log}"], "expected --toml my.toml"),
        (["{log}", "--toml", "{toml}"], "--out LOG.parquet"),
        (["{log}", "--toml", "{toml}", "--out", "x.csv"], "expected .parquet"),
        (["{log}", "--toml", "{toml}", "--out", "nowhere/x.parquet"], "no folder"),
        (["{log}", "--guess", "--out", "x.parquet"], "a guess reads no data"),
        (["nothing.txt", "--toml", "{toml}", "--out", "x.parquet"], "No such file"),
    ],
)
def test_wrong_use_is_one_line(
    arguments: list[str], words: str, recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(recording.parent)
    places = {"log": str(recording), "toml": str(recording.with_name("my_cart.toml"))}
    done = svo("import", *(argument.format(**places) for argument in arguments))
    assert done.exit_code == 1
    assert words in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_plain_log_is_imported_too_and_never_over_itself(tmp_path: Path) -> None:
    out = tmp_path / "log.parquet"
    assert svo("import", CLEAN, "--toml", EXAMPLE, "--out", out).exit_code == 0
    plant = find_plant(EXAMPLE)
    np.testing.assert_array_equal(quietly(out, plant).y, read_log(CLEAN, plant).y)
    done = svo("import", out, "--toml", EXAMPLE, "--out", out)
    assert done.exit_code == 1
    assert "is the log itself" in done.stderr


# -- guesses -----------------------------------------------------------------------------------------------------------


def guess(path: Path, toml: Path = EXAMPLE) -> str:
    done = svo("import", path, "--guess", "--toml", toml)
    assert done.exit_code == 0, done.output
    return done.stdout


def test_a_guess_is_a_table_that_reads_the_log(recording: Path) -> None:
    table = guess(recording).replace("# force", "force").replace("# position", "position")
    assert 'separator = ";"' in table
    assert 'decimal = ","' in table
    assert 'missing = ["---"]' in table
    assert 'time = { column = "Zeit", unit = "ms" }' in table
    assert '# NAME = { column = "Weg [mm]", unit = "mm" }' in table
    assert "which one?" in table
    table = table.replace('force = { column = "..." }', 'force = { column = "Kraft" }')
    table = table.replace('position = { column = "..." }', 'position = { column = "Weg [mm]", unit = "mm" }')
    assert len(quietly(recording, cart(recording.parent, table))) == 80


OPEN = {
    "g01_spreadsheet_de.csv": ["# force", "# position", "zone"],
    "g02_labview.lvm": [],
    "g03_influx_annotated.csv": [],
    "g04_hmi_tags.csv": [
        "# force",
        "# position",
        "# valid",
        'or: time = { column = "Time_ms", unit = "day", scale = 1e-6 }',
    ],
    "g05_historian.csv": ["zone"],
    "g06_topics": ["# force", "# position", 'unit = "us"'],
    "g07_station.dat": ["# sentinels = [-7999]", "zone"],
    "g08_restarted.csv": [],
    "g09_bench_utf16.txt": ["undecided", "# time"],
    "g10_controller_rates.csv": ["# or 6?"],
    "g11_scope.mat": ["ScopeData.signals(2).values (50 x 1, 'position [mm]')", "# time"],
    "g12_timetable_held.csv": [],
}
LEFT = {
    "g03_influx_annotated.csv": (),
    "g05_historian.csv": ("force",),
    "g08_restarted.csv": (),
    "g12_timetable_held.csv": (),
}


@pytest.mark.parametrize("name", NUMBERS)
def test_a_guess_of_each_dialect_is_toml_with_what_is_open_as_comments(name: str, tmp_path: Path) -> None:
    table = guess(logs() / name)
    cart(tmp_path, table)  # all its keys are known
    assert not [words for words in OPEN[name] if words not in table], table
    stated, right = tomllib.loads(table)["log"], tomllib.loads(TABLES[name])["log"]
    for key in ("encoding", "separator", "decimal", "thousands", "header", "first_row", "long"):
        assert stated.get(key) == right.get(key), key


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("time\tx\n0\t1\n0.1\t2\n0.2\t3\n", ['separator = "\\t"']),
        ("% made by hand\ntime,x\n0,1\n0.1,2\n0.2,3\n", ['skip = ["^\\\\s*%"]']),
        ("0 1\n0.1 2\n0.2 3\n", ['separator = " "', 'names = ["c1", "c2"]']),
        ("a;b\n1.234,5;1\n2.345,5;2\n", ['decimal = ","', 'thousands = "."']),
        ("when,x\n14/3/2025 10:00:00.1,1\n14/3/2025 10:00:00.2,2\n", ['"%d/%m/%Y %H:%M:%S.%f"']),
        ("when,x\n3/4/2025 10:00:00,1\n3/5/2025 10:00:00,2\n3/15/2025 10:00:00,2\n", ['"%m/%d/%Y %H:%M:%S"']),
        ("t_ms,x\n0,1\n100,2\n200,3\n", ['column = "t_ms", unit = "ms"']),
        ("stamp,x\n1531943810000000000,1\n1531943810100000000,2\n1531943810200000000,3\n", ['unit = "ns"']),
    ],
)
def test_what_a_guess_finds(text: str, lines: list[str], tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text(text, encoding="utf-8")
    table = guess(tmp_path / "log.txt")
    assert not [line for line in lines if line not in table], table
    cart(tmp_path, table)


@pytest.mark.parametrize("content", [b"", b"\n\n", b"hello\nworld\n", bytes(range(256)) * 8, b"a,b\n", b"\xff\xfe"])
def test_a_guess_of_what_is_no_log_is_one_line(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(content)
    done = svo("import", tmp_path / "log.txt", "--guess")
    assert done.exit_code == 1
    assert "log.txt" in done.stderr
    assert done.stderr.count("\n") == 1
