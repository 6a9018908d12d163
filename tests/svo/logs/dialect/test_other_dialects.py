"""Ways to write a log that are easily read wrongly: each is read as it is meant, or is one clear error."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pytest

from svo.logs.dialect.units import conversion
from tests.svo.logs.dialect.carts import reading, written

FORCE, POSITION = np.array([0.25, -0.5, 1.0, 0.75, -1.0]), np.array([0.0, -0.125, 1234.5, 3.0, 2.5])
PLAIN = '[log]\ntime = { column = "t" }\n[log.columns]\nforce = { column = "f" }\nposition = { column = "p" }\n'


def rows(stamps: list[str], *, mark: str = ";", position: list[str] | None = None) -> str:
    """A table of the names t, f, p."""
    position = position or [f"{p:g}" for p in POSITION]
    cells = [["t", "f", "p"], *([t, f"{f:g}", p] for t, f, p in zip(stamps, FORCE, position, strict=True))]
    return "".join(mark.join(row) + "\n" for row in cells)


def told(text: str, table: str, folder: Path) -> str:
    """What the error says."""
    with pytest.raises(ValueError, match=r"log\.txt") as caught:
        written(folder, text, table)
    return str(caught.value)


STEPS = [f"{k / 10:.1f}" for k in range(5)]
SEMICOLONS = PLAIN.replace("[log]", '[log]\nseparator = ";"')


def test_between_blanks_a_row_with_too_few_cells_is_an_error(tmp_path: Path) -> None:
    """Nothing shows which cell is empty: padded at its end, the row would put a position in the place of a force."""
    table = PLAIN.replace("[log]", '[log]\nseparator = " "')
    text = rows(STEPS, mark=" ")
    assert written(tmp_path, text, table).log.y[2, 0] == 1234.5
    assert "line 4: 2 cells, but 3 names" in told(text.replace(" 1 1234.5", "   1234.5"), table, tmp_path)
    assert "line 2: 3 cells, but 4 names" in told("# " + text, table, tmp_path)  # "#" is no name of a column


def test_a_row_of_empty_cells_is_a_sample_where_its_place_is_its_time(tmp_path: Path) -> None:
    table = '[log]\nseparator = ";"\ntime = { start = 0, step = 0.1 }\n[log.columns]\nforce = { missing = "hold" }\n'
    log = written(tmp_path, "force;position\n1;2\n;\n3;4\n;\n\n", table).log
    np.testing.assert_array_equal(log.u[:, 0], [1, 1, 3])
    np.testing.assert_array_equal(log.y[:, 0], [2, np.nan, 4])
    assert "line 3" in told("force;position\n1;2\n;\n3;4\n", table.replace('missing = "hold"', ""), tmp_path)


def test_blank_lines_between_rows_that_are_counted_are_noted(tmp_path: Path) -> None:
    table = "[log]\ntime = { step = 0.1 }\n"
    notes = written(tmp_path, "force,position\n1,2\n\n3,4\n\n", table).notes
    assert any("1 blank lines between the rows (line 3 the first) are taken for no samples" in note for note in notes)
    assert not written(tmp_path, "force,position\n\n1,2\n3,4\n\n", table).notes


def test_a_blank_line_is_an_empty_cell_where_there_is_one_column(tmp_path: Path) -> None:
    (tmp_path / "log.txt").mkdir()
    (tmp_path / "log.txt" / "f.csv").write_text("force\n1\n2\n3\n", encoding="utf-8")
    (tmp_path / "log.txt" / "p.csv").write_text("position\n1\n\n3\n\n", encoding="utf-8")
    table = '[log]\ntime = { step = 0.1 }\n[log.columns]\nforce = { file = "f.csv" }\nposition = { file = "p.csv" }\n'
    np.testing.assert_array_equal(reading(tmp_path / "log.txt", table, tmp_path).log.y[:, 0], [1, np.nan, 3])


def test_names_may_be_broken_into_lines(tmp_path: Path) -> None:
    text = 'a preamble; of two\n"t\n[s]";"f\n[N]";p\n' + rows(STEPS).partition("\n")[2]
    for name in (r'"t\n[s]"', '"t [s]"'):
        table = SEMICOLONS.replace("[log]", "[log]\nheader = 2", 1).replace('"t"', name).replace('"f"', '"f [N]"')
        np.testing.assert_array_equal(written(tmp_path, text, table).log.u[:, 0], FORCE)


@pytest.mark.parametrize("good", ["1", "true", '"TRUE"', '"true"', "1.0"])
def test_a_truth_value_is_one_however_it_is_written(good: str, tmp_path: Path) -> None:
    lines = rows(STEPS).split("\n")
    text = "\n".join(
        [lines[0] + ";ok", *(line + (";FALSE" if "1234" in line else ";TRUE") for line in lines[1:-1]), ""]
    )
    table = SEMICOLONS.replace('"p" }', f'"p", valid = {{ column = "ok", good = [{good}] }} }}')
    np.testing.assert_array_equal(
        written(tmp_path, text, table).log.y[:, 0], np.where(POSITION > 1000, np.nan, POSITION)
    )


def test_a_flag_that_never_is_good_is_noted(tmp_path: Path) -> None:
    text = rows(STEPS).replace("\n", ";A\n").replace("p;A", "p;ok")
    table = SEMICOLONS.replace('"p" }', '"p", valid = { column = "ok", good = [1] } }')
    assert "position: column 'ok' never is 1, so no reading counts; it is 'A'" in written(tmp_path, text, table).notes


@pytest.mark.parametrize("listed", ['missing = ["-999"]', "sentinels = [-999]", 'missing = ["-999.0"]'])
def test_a_number_that_means_no_reading_does_so_however_it_is_written(listed: str, tmp_path: Path) -> None:
    text = rows(STEPS, position=["0", "-999.00", "-999", "-9.99e2", "2.5"])
    found = written(tmp_path, text, SEMICOLONS.replace("[log]", f"[log]\n{listed}", 1)).log.y[:, 0]
    np.testing.assert_array_equal(found, [0, np.nan, np.nan, np.nan, 2.5])


@pytest.mark.parametrize("listed", ["sentinels = [0x8000]", "sentinels = [-32768]", 'missing = ["8000"]'])
def test_a_sentinel_of_twos_complement(listed: str, tmp_path: Path) -> None:
    text = rows(STEPS, position=["0x0001", "0xFFFF", "0x8000", "0x0010", "0x7fff"])
    table = SEMICOLONS.replace('"p"', f'"p", number = "hex16", scale = 0.5, {listed}')
    np.testing.assert_array_equal(written(tmp_path, text, table).log.y[:, 0], [0.5, -0.5, np.nan, 8.0, 16383.5])


@pytest.mark.parametrize(("source", "target"), [("1/min", "rad/s"), ("Hz", "rad/s"), ("rad/s", "Hz"), ("deg", "")])
def test_turns_and_radians_are_not_taken_for_one_another(source: str, target: str) -> None:
    """Pint takes 1 Hz as 1 rad/s: 2 pi too little if it counts turns."""
    pytest.importorskip("pint")
    with pytest.raises(ValueError, match="differ by an angle"):
        conversion(source, target)
    assert conversion("rpm", "rad/s")[0] == pytest.approx(2 * np.pi / 60, rel=1e-15)
    assert conversion("1/min", "Hz")[0] == pytest.approx(1 / 60, rel=1e-15)


def test_a_unit_that_does_not_fit_names_the_channel(tmp_path: Path) -> None:
    pytest.importorskip("pint")
    table = SEMICOLONS.replace('"f"', '"f", unit = "mm"')
    assert "unit in [log.columns.force]: 'mm' cannot be converted" in told(rows(STEPS), table, tmp_path)


def test_a_stated_start_is_in_its_zone(tmp_path: Path) -> None:
    for start in ('2025-03-14T10:15:00, zone = "Europe/Berlin"', "2025-03-14T10:15:00+01:00"):
        table = f"[log]\ntime = {{ step = 0.1, start = {start} }}\n"
        assert written(tmp_path, "force,position\n1,2\n", table).start == "2025-03-14 09:15:00 UTC"


def test_numbers_without_an_epoch_have_no_zone(tmp_path: Path) -> None:
    table = SEMICOLONS.replace('"t"', '"t", zone = "Europe/Berlin"')
    assert "line 2, column 't': a number, and zone is for dates; state epoch" in told(rows(STEPS), table, tmp_path)


def test_the_hour_that_comes_twice_needs_rows_in_order(tmp_path: Path) -> None:
    zone = ZoneInfo("Europe/Berlin")
    begin = datetime(2025, 10, 26, 0, 59, 59, 800000, tzinfo=UTC)
    local = [(begin + timedelta(milliseconds=100 * k)).astimezone(zone).replace(tzinfo=None) for k in range(5)]
    table = SEMICOLONS.replace('"t"', '"t", format = "iso", zone = "Europe/Berlin"')
    text = rows([date.isoformat(" ") for date in local])
    assert written(tmp_path, text, table).start == "2025-10-26 00:59:59.8 UTC"
    lines = text.splitlines()
    newest_first = "\n".join([lines[0], *lines[:0:-1], ""])
    error = told(newest_first, table.replace("[log]", '[log]\norder = "sort"', 1), tmp_path)
    assert "line 2" in error
    assert "comes twice in Europe/Berlin" in error


@pytest.mark.parametrize(
    ("zone", "begin", "words"),
    [
        (
            "Australia/Lord_Howe",
            datetime(2025, 4, 5, 14, 59, 59, 800000),
            "goes back by 1799.9 s; the end of summer time",
        ),
        ("Europe/Berlin", datetime(2025, 3, 30, 0, 59, 59, 800000), "clock go forward there? Then state zone"),
    ],
)
def test_a_changed_clock_without_a_zone_is_thought_of(zone: str, begin: datetime, words: str, tmp_path: Path) -> None:
    utc = [(begin + timedelta(milliseconds=100 * k)).replace(tzinfo=UTC) for k in range(5)]
    stamps = [date.astimezone(ZoneInfo(zone)).replace(tzinfo=None).isoformat(" ") for date in utc]
    assert words in told(rows(stamps), SEMICOLONS.replace('"t"', '"t", format = "iso"'), tmp_path)


@pytest.mark.parametrize("form", ["%H:%M:%S.%f", "duration"])
def test_a_clock_without_a_day_counts_from_midnight_and_cannot_pass_it(form: str, tmp_path: Path) -> None:
    table = SEMICOLONS.replace('"t"', f'"t", format = "{form}"')
    assert written(tmp_path, rows([f"10:00:00.{k}" for k in range(5)]), table).start == "36000 s"
    stamps = ["23:59:59.7", "23:59:59.8", "23:59:59.9", "00:00:00.0", "00:00:00.1"]
    error = told(rows(stamps), table, tmp_path)
    assert "line 5" in error
    assert "from 86399.9 s to 0 s; midnight? Then the date is needed too" in error


@pytest.mark.parametrize(
    "stamp", ["1 day, 0:00:00.{}", "+0:00:00.{}", "00:00:00:{}00", "0 days 00:00:00.{}00000", "PT0.{}S", "{}00 ms"]
)
def test_durations_of_many_writers(stamp: str, tmp_path: Path) -> None:
    table = SEMICOLONS.replace('"t"', '"t", format = "duration"')
    log = written(tmp_path, rows([stamp.format(k) for k in range(5)]), table).log
    np.testing.assert_allclose(log.time, 0.1 * np.arange(5), atol=1e-12)


@pytest.mark.parametrize("stamp", ["0:60:00", "0:00:60", "10:15:500", "1:2:3:4", "0:0:0:500"])
def test_what_is_no_duration_is_an_error(stamp: str, tmp_path: Path) -> None:
    table = SEMICOLONS.replace('"t"', '"t", format = "duration"')
    assert "line 2, column 't'" in told(rows([stamp, *STEPS[1:]]), table, tmp_path)


def test_hours_and_minutes_are_not_taken_for_minutes_and_seconds(tmp_path: Path) -> None:
    text = rows([f"10:{k:02d}" for k in range(5)])
    table = SEMICOLONS.replace('"t"', '"t", format = "duration"')
    with pytest.raises(ValueError, match=r"line 2.*minutes and seconds.*format = .%H:%M."):
        written(tmp_path, text, table, Ts=60.0)
    assert written(tmp_path, text, table.replace("duration", "%H:%M"), Ts=60.0).log.time[-1] == 240.0


def test_a_unit_of_time_is_not_in_question_where_every_says_the_rate(tmp_path: Path) -> None:
    text = "t,f,p\n" + "".join(f"{k / 1000},{k // 1000},{k}\n" for k in range(3001))
    every = PLAIN.replace('"f" }', '"f", every = 1000 }').replace('"p" }', '"p", every = 1000 }')
    np.testing.assert_array_equal(written(tmp_path, text, every, Ts=1.0).log.y[:, 0], [0, 1000, 2000, 3000])


@pytest.mark.parametrize("column", ["3", '"p"'])
def test_a_name_in_brackets_of_a_message_is_no_unit(column: str, tmp_path: Path) -> None:
    assert written(tmp_path, rows(STEPS), SEMICOLONS.replace('column = "p"', f"column = {column}")).notes == ()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"PK\3\4\0\0", "save the sheet as CSV"),
        (b"\x1f\x8b\x08\0", "unpack it first"),
        (b"PAR1\0\0", "ends in .parquet"),
        ("t,f\n0,1\n".encode("utf-16-be"), 'encoding = "utf-16-be"'),
        ("t,f\n0,1\n".encode("utf-16-le"), 'encoding = "utf-16-le"'),
        (b"t,f,p\n", "there are no rows"),
    ],
)
def test_what_is_no_text_says_what_it_is(data: bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"log\.txt") as caught:
        written(tmp_path, data, PLAIN)
    assert words in str(caught.value)


def test_a_scale_that_leaves_the_floats_is_an_error(tmp_path: Path) -> None:
    assert "line 4, column 'p': 1234.5 is beyond" in told(
        rows(STEPS), SEMICOLONS.replace('"p"', '"p", scale = 1e307'), tmp_path
    )


def test_a_period_longer_than_the_log_is_no_crash(tmp_path: Path) -> None:
    assert "not held for 1e+300 s" in told(rows(STEPS), SEMICOLONS.replace('"p"', '"p", held = 1e300'), tmp_path)


def test_readings_of_another_clock_are_an_error(tmp_path: Path) -> None:
    """All of them would be beside the grid of the input: a log without readings."""
    (tmp_path / "log.txt").mkdir()
    (tmp_path / "log.txt" / "f.csv").write_text("t,force\n0,1\n0.1,2\n", encoding="utf-8")
    (tmp_path / "log.txt" / "p.csv").write_text("t,position\n1000,1\n1000.1,2\n", encoding="utf-8")
    files = '[log.columns]\nforce = { file = "f.csv" }\nposition = { file = "p.csv" }\n'
    with pytest.raises(ValueError, match=r"p\.csv, line 2.*\(1000 s to 1000.1 s\) is within .* force \(0 s to 0.1 s\)"):
        reading(tmp_path / "log.txt", f'[log]\ntime = {{ column = "t", one_clock = true }}\n{files}', tmp_path)


def test_an_output_without_a_reading_is_noted(tmp_path: Path) -> None:
    assert "position has no reading at all" in written(tmp_path, rows(STEPS, position=[""] * 5), SEMICOLONS).notes


def test_a_flag_that_never_is_good_is_an_error_of_an_input(tmp_path: Path) -> None:
    text = rows(STEPS).replace("\n", ";A\n").replace("p;A", "p;ok")
    table = SEMICOLONS.replace("[log]", '[log]\nvalid = { column = "ok", good = [1] }', 1)
    assert "force: column 'ok' never is 1, so no reading counts; it is 'A'. An input must" in told(
        text, table, tmp_path
    )
