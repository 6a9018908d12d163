"""Tables of text in dialects of the tests' own: rows, columns, time and the grid."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from svo import detect
from svo.logs.dialect.read import Reading
from tests.svo.logs.dialect.carts import cart, reading, written

MILLI = """[log]
separator = ";"
time = { column = "t" }
[log.columns]
force = { column = "f", unit = "mN" }
position = { column = "p", unit = "mm" }
"""
PAIRS = """[log]
separator = "\\t"
[log.columns]
force = { column = "f", time = { column = "t1" } }
position = { column = "p", time = { column = 3 } }
"""
NIGHT = """[log]
separator = " "
exponent = "D"
time = { column = ["d", "n"], format = "%Y%m%d %H%M%S.%f" }
[log.columns]
force = { column = "f" }
position = { column = "p" }
"""
PLAIN = '[log]\ntime = { column = "t" }\n[log.columns]\nforce = { column = "f" }\nposition = { column = "p" }\n'


def stated(*lines: str, columns: str = "", force: str = "", position: str = "", time: str = 'column = "t"') -> str:
    """A table with more lines in it, and with more of its channels and time."""
    more = "\n".join(lines)
    own = f'force = {{ column = "f"{force} }}\nposition = {{ column = "p"{position} }}\n{columns}'
    return f"[log]\n{more}\ntime = {{ {time} }}\n[log.columns]\n{own}"


def rows(*positions: object, force: object = 0.5, step: float = 0.1) -> str:
    return "t,f,p\n" + "".join(f"{k * step:.9g},{force},{p}\n" for k, p in enumerate(positions))


def positions(found: Reading) -> list[float]:
    return found.log.y[:, 0].tolist()


# -- rows and columns --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "table"),
    [
        ("t;f;p\n0;1;2\n0,1;1;3\n", stated('separator = ";"', 'decimal = ","')),
        ("t\tf\tp\n0\t1\t2\n0.1\t1\t3\n", stated('separator = "\\t"')),
        ("t   f  p\n  0 1\t 2 \n 0.1  1 3\n", stated('separator = " "')),
        ("sep=;\nt;f;p\n0;1;2\n0.1;1;3\n", stated('separator = ";"')),
        ("t|f|p\n0|1|2\n0.1|1|3\n", stated('separator = "|"')),
        ('"t","f","p"\n"0","1","2"\n"0.1","1","3"\n', PLAIN),
        ("t, f, p\r\n0, 1, 2\r\n\r\n0.1, 1, 3\r\n,,\r\n", PLAIN),
        ("t,f,p\r0,1,2\r0.1,1,3\r", PLAIN),
        ('t,f,p\n"0","1,0","2,0"\n"0,1","1","3"\n', stated('decimal = ","')),
        ("t;f;p\n0;1000 mN;2000mm\n0.1;1000mN;3000 mm\n", MILLI),
        ("t1\tf\tt2\tp\n0\t1\t0\t2\n0.1\t1\t0.1\t3\n\t\t0.15\t\n", PAIRS),
        ("d n f p\n20250314 235959.95 1.0D0 2\n20250315 000000.05 1 3\n", NIGHT),
        ("# made by hand\nt,f,p\n0,1,2\n% a remark\n0.1,1,3\n", stated('skip = ["^[#%]"]')),
        ("x\nA, B\n\nt,f,p\ns,N,m\n0,1,2\n0.1,1,3\n", stated("header = 4", "first_row = 6")),
        ("t,f,p\ns,N,m\n0,1,2\n0.1,1,3\n", stated("first_row = 3")),
        ("0,1,2\n0.1,1,3\n", stated('names = ["t", "f", "p"]')),
        ("a\n0,1,2\n0.1,1,3\n", stated('names = ["t", "f", "p"]', "first_row = 2")),
        ("t,f,p\n0,1,2\nt,f,p\n0.1,1,3\n", PLAIN),
        ("t,f,p,note\n0,1,2\n0.1,1,3,late\n", PLAIN),
        ("t,f,p,\n0,1,2,\n0.1,1,3,\n", PLAIN),
        ('t,f,p,note\n0,1,2,"a\nb"\n0.1,1,3,\n', PLAIN),
        ("p,p,f,t\n9,2,1,0\n9,3,1,0.1\n", PLAIN.replace('"p"', "2")),
        ("t,f,p\n0,1,200\n0.1,1,300\n", stated(position=", scale = 0.01")),
        ("t,f,p\n0,1,1\n0.1,1,2\n", stated(position=", offset = 1")),
        ("t,f,p\n0,1,FF80\n0.1,1,FF81\n", stated(position=', number = "hex16", offset = 130')),
    ],
)
def test_a_table_is_read_as_it_is_stated(text: str, table: str, tmp_path: Path) -> None:
    log = written(tmp_path, text, table).log
    assert (log.time.tolist(), log.u.tolist(), log.y.tolist()) == ([0.0, 0.1], [[1.0], [1.0]], [[2.0], [3.0]])


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-8", "utf-32-le"])
def test_a_byte_order_mark_wins(encoding: str, tmp_path: Path) -> None:
    data = ("\ufeff" + rows(2, 3)).encode(encoding)
    assert positions(written(tmp_path, data, stated('encoding = "cp1252"'))) == [2, 3]


def test_two_bytes_a_letter_without_a_mark_have_to_be_stated(tmp_path: Path) -> None:
    data = rows(2, 3).encode("utf-16-le")
    with pytest.raises(ValueError, match=r"line 1: a NUL character.*utf-16-le"):
        written(tmp_path, data, PLAIN)
    assert positions(written(tmp_path, data, stated('encoding = "utf-16-le"'))) == [2, 3]


def test_a_last_line_without_an_end_is_left_out_and_noted(tmp_path: Path) -> None:
    found = written(tmp_path, rows(2, 3, 4).rstrip("\n"), PLAIN)
    assert positions(found) == [2, 3]
    assert "the last line (4) has no end" in found.notes[0]


@pytest.mark.parametrize(
    ("text", "table", "words"),
    [
        ("", PLAIN, ["is empty", "names of the columns"]),
        ("t,f,p\n", PLAIN, ["no row has a reading of force"]),
        ("t,f\n0,1\n", PLAIN, ["no column 'p'", "found 't', 'f'"]),
        ("t,f,P\n0,1,2\n", PLAIN, ["no column 'p'"]),
        ("t,f,p,p\n0,1,2,3\n", PLAIN, ["'p' is the name of columns 3 and 4", "number"]),
        ("t,f,p\n0,1,2,3\n", PLAIN, ["line 2", "4 cells", "'3'", "3 names"]),
        ("t,f,p\n0,1,2\n0.1,1,up\n", PLAIN, ["line 3", "column 'p'", "'up'"]),
        ("t,f,p\n0,1,2\nlate,1,2\n", PLAIN, ["line 3", "column 't'", "'late'"]),
        ("t,f,p\n0,1,2\n,1,2\n", PLAIN, ["line 3", "column 't'", "the empty cell"]),
        ('t,f,p\n0,1,"2\n', PLAIN, ["line 2", "told apart", "quote"]),
        ("t,f,p\n0,1,2\n0.1,,3\n0.2,1,4\n", PLAIN, ["line 3", "input force has no reading at 0.1 s", "hold"]),
        ("t,f,p\n0,1,2\n0.1,,3\n", PLAIN, ["line 3", "input force has no reading at 0.1 s"]),
        ("t,f,p\n0,,2\n0.1,1,3\n", PLAIN, ["line 2", "input force has no reading at -0.1 s"]),
        ("t,f,p\n0,1,2\n0.1,1,3\n0.3,1,5\n", PLAIN, ["force has no reading at 0.2 s", "no row is there"]),
        (
            "t,f,p\n0,1,2\n0.1,1,3\n0.1,1,4\n0.2,1,5\n",
            PLAIN,
            ["line 4", "2 readings of position share 0.1 s", "3 and 4"],
        ),
        ("t,f,p\n0,1,2\n100,1,3\n200,1,4\n", PLAIN, ["median step is 100", "read as s", 'unit = "ms"']),
        ("t,f,p\n1,1,2\n2,1,3\n3,1,4\n", PLAIN.replace('"t"', '"t", unit = "100ns"'), ["line 3", "comes each 1e-07 s"]),
        ("t,f,p\n0,1,2\n0.1,1,3\n0.05,1,3\n", PLAIN, ["line 4", "goes back by 0.05 s", "part", "sort"]),
        ("t,f,p\n" + "".join(f"{k % 2},1,1\n" for k in range(30)), PLAIN, ["places more", 'order = "sort"']),
    ],
)
def test_a_bad_table_is_one_clear_error(text: str, table: str, words: list[str], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"log\.txt") as caught:
        written(tmp_path, text, table)
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


# -- repeats, order, parts ---------------------------------------------------------------------------------------------

DOUBLE = "t,f,p\n0,1,2\n0.1,1,3\n0.1,1,4\n0.2,1,5\n"


@pytest.mark.parametrize(("which", "value"), [("first", 3.0), ("last", 4.0), ("mean", 3.5)])
def test_readings_of_one_time_count_as_stated(which: str, value: float, tmp_path: Path) -> None:
    found = written(tmp_path, DOUBLE, stated(f'duplicates = "{which}"'))
    assert positions(found) == [2, value, 5]
    assert any("readings of position share their times" in note for note in found.notes)


def test_equal_repeats_are_dropped_and_noted(tmp_path: Path) -> None:
    found = written(tmp_path, DOUBLE.replace("1,4", "1,3"), PLAIN)
    assert positions(found) == [2, 3, 5]
    assert "1 readings of position repeat and are dropped" in found.notes


def test_rows_in_no_order_are_sorted_if_stated(tmp_path: Path) -> None:
    text = "t,f,p\n0.2,1,4\n0,1,2\n0.1,1,3\n"
    assert positions(written(tmp_path, text, stated('order = "sort"'))) == [2, 3, 4]


def test_a_part_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="has 1 part, and"):
        written(tmp_path, rows(2, 3), stated("part = 2"))


# -- the grid ----------------------------------------------------------------------------------------------------------


def test_a_lost_row_is_a_missing_reading_where_the_input_is_held(tmp_path: Path) -> None:
    text = "t,f,p\n0,1,2\n0.1,2,3\n0.4,1,6\n"
    log = written(tmp_path, text, stated(force=', missing = "hold"')).log
    np.testing.assert_array_equal(log.u[:, 0], [1, 2, 2, 2, 1])
    np.testing.assert_array_equal(log.y[:, 0], [2, 3, np.nan, np.nan, 6])


def test_an_input_that_is_written_on_change_goes_on_to_the_last_reading(tmp_path: Path) -> None:
    text = "t,f,p\n0,1,2\n0.1,,3\n0.2,2,4\n0.3,,5\n"
    log = written(tmp_path, text, stated(force=', missing = "hold"')).log
    assert (log.u[:, 0].tolist(), log.y[:, 0].tolist()) == ([1, 1, 2, 2], [2, 3, 4, 5])


def test_a_clock_that_drifts_within_a_percent_keeps_its_own_times(tmp_path: Path) -> None:
    text = "t,f,p\n" + "".join(f"{k * 0.1005},1,{k}\n" for k in range(200))
    log = written(tmp_path, text, PLAIN).log
    np.testing.assert_allclose(log.time, np.arange(200) * 0.1005, rtol=1e-12)
    assert log.y[:, 0].tolist() == list(range(200))


def test_a_clock_that_jitters_within_a_percent_is_on_the_grid(tmp_path: Path) -> None:
    text = "t,f,p\n" + "".join(f"{k * 0.1 + 0.0009 * (-1) ** k},1,{k}\n" for k in range(1, 50))
    log = written(tmp_path, text, PLAIN).log
    np.testing.assert_allclose(log.time, np.arange(49) * 0.1, atol=1e-12)


@pytest.mark.parametrize(("every", "step"), [(2, 0.05), (10, 0.01)])
def test_a_faster_sensor_says_so(every: int, step: float, tmp_path: Path) -> None:
    cells = "".join(f"{k * step:.9g},{k if k % every == 0 else ''},{k}\n" for k in range(2 * every + 1))
    with pytest.raises(ValueError, match=rf"line 3, column 'p': the reading of {step:g} s .*every = {every} in"):
        written(tmp_path, "t,f,p\n" + cells, PLAIN)
    found = written(tmp_path, "t,f,p\n" + cells, stated(position=f", every = {every}"))
    assert positions(found) == [0, every, 2 * every]
    assert f"position: {2 * every - 2} readings between the samples are left out" in found.notes
    with pytest.raises(ValueError, match=f"expected every = {every}"):
        written(tmp_path, "t,f,p\n" + cells, stated(position=f", every = {every * 3}"))


def test_an_input_is_never_moved(tmp_path: Path) -> None:
    text = "t,f,p\n0,1,2\n0.12,2,3\n0.2,2,4\n"
    with pytest.raises(ValueError, match=r"line 3, column 'f': input force changes at 0.12 s, 0.02 s off the samples"):
        written(tmp_path, text, PLAIN)
    constant = written(tmp_path, text.replace("0.12,2", "0.12,1"), PLAIN)
    assert constant.log.u[:, 0].tolist() == [1, 1, 2] if not np.isnan(constant.log.u).any() else False


def jittered(seed: int, *, share: float) -> tuple[str, np.ndarray]:
    """A cart that is pushed by a sine, its readings stamped and taken off the samples by a share of them."""
    rng = np.random.default_rng(seed)
    Ts, count = 0.1, 80
    force = np.sin(0.5 * np.arange(count) * Ts)
    x, v, lines = 0.0, 0.0, ["t,f,p"]
    off = np.append(0.0, rng.uniform(-share, share, count - 1)) * Ts
    for k in range(count):
        # The input is held from sample to sample; a reading between samples is of the moving cart.
        held = force[k] if off[k] >= 0 else force[max(k - 1, 0)]
        at = x + v * off[k] + 0.5 * held * off[k] ** 2
        lines.append(f"{k * Ts + off[k]:.9f},{force[k]:.9f},{at + rng.uniform(-0.05, 0.05):.9f}")
        x, v = x + v * Ts + 0.5 * force[k] * Ts**2, v + force[k] * Ts
    return "\n".join(lines) + "\n", off


OWN_TIME = ", time = { start = 0.0, step = 0.1 }"


@pytest.mark.parametrize("seed", range(4))
def test_a_healthy_sine_with_jitter_raises_no_alarm(seed: int, tmp_path: Path) -> None:
    """Stated bound of the rate: the reading is moved at its price; none stated: it is missing."""
    text, off = jittered(seed, share=0.2)
    table = stated(force=OWN_TIME, position=", rate = 4.0")
    found = written(tmp_path, text, table)
    assert not np.isnan(found.log.y).any()
    assert found.log.widening is not None
    np.testing.assert_allclose(found.log.widening, 4.0 * np.abs(off).max(), rtol=1e-6)
    assert any("n grows by" in note for note in found.notes)
    assert not detect(cart(tmp_path, table), found.log).alarms
    table = stated(force=OWN_TIME)
    found = written(tmp_path, text, table)
    assert np.isnan(found.log.y[:, 0]).tolist() == (np.abs(off) > 1e-3).tolist()
    assert found.log.widening is None
    assert any("readings are off the grid by more than 1 %" in note for note in found.notes)
    assert not detect(cart(tmp_path, table), found.log).alarms


@pytest.mark.parametrize("seed", range(12))
def test_a_moved_reading_is_as_far_off_as_its_price_says(seed: int, tmp_path: Path) -> None:
    """Readings at any times, also several a sample, of a known signal: each is right at its sample within the price."""
    rng = np.random.default_rng(seed)
    phase, speed = rng.uniform(0, 6), rng.uniform(0.5, 3)
    (tmp_path / "run").mkdir()
    drive = "t,f\n" + "".join(f"{k / 10},1\n" for k in range(40))
    (tmp_path / "run" / "drive.csv").write_text(drive, encoding="utf-8")
    times = np.sort(rng.uniform(0, 3.9, rng.integers(15, 120)))
    lines = [f"{time},{float(np.sin(speed * time + phase))}\n" for time in times.tolist()]
    (tmp_path / "run" / "laser.csv").write_text("t,p\n" + "".join(lines), encoding="utf-8")
    table = (
        '[log]\ntime = { column = "t", one_clock = true }\n[log.columns]\n'
        'force = { file = "drive.csv", column = "f" }\n'
        f'position = {{ file = "laser.csv", column = "p", rate = {speed} }}\n'
    )
    log = reading(tmp_path / "run", table, tmp_path).log
    known = ~np.isnan(log.y[:, 0])
    off = np.abs(log.y[known, 0] - np.sin(speed * log.time[known] + phase))
    assert log.widening is not None
    assert known.sum() > 5
    assert (off <= log.widening[0] + speed * 0.001 + 1e-12).all()  # 1 % of Ts costs nothing
    nearest = np.abs(times[:, None] - log.time).min(axis=0)
    assert log.widening[0] <= speed * nearest[known].max() + 1e-9


def test_inputs_of_jittered_rows_are_an_error_that_says_what_to_state(tmp_path: Path) -> None:
    text, _ = jittered(0, share=0.2)
    with pytest.raises(ValueError, match=re.escape("[log.columns.force] time = { start = 0, step = 0.1 }")):
        written(tmp_path, text, stated(position=", rate = 4.0"))


# -- sensors that are slower than their log ----------------------------------------------------------------------------


def test_a_held_sensor_keeps_a_true_reading_that_repeats(tmp_path: Path) -> None:
    text = rows(1, 1, 1, 2, 2, 2, 2, 2, 2, 3, 3, 3)
    found = written(tmp_path, text, stated(position=", held = 0.3"))
    assert [k for k, value in enumerate(positions(found)) if not np.isnan(value)] == [0, 3, 6, 9]


def test_the_phase_of_a_held_sensor_is_found(tmp_path: Path) -> None:
    found = written(tmp_path, rows(1, 2, 2, 3, 3, 4, 4), stated(position=", held = 0.2"))
    assert [k for k, value in enumerate(positions(found)) if not np.isnan(value)] == [1, 3, 5]


def test_a_period_that_is_no_multiple_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"held = 0.25, but there is a row each 0.1 s"):
        written(tmp_path, rows(1, 1, 2, 2), stated(position=", held = 0.25"))


def test_a_column_without_a_time_has_a_start_and_a_step(tmp_path: Path) -> None:
    found = written(tmp_path, "f,p\n1,2\n1,3\n", stated(time="start = 2025-03-14T10:15:00Z, step = 0.1"))
    assert (found.start, positions(found)) == ("2025-03-14 10:15:00 UTC", [2, 3])
