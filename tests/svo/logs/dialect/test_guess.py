"""A proposal reads its file as it is meant, or leaves open what the file does not say; it never hides a row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from svo.logs.dialect.guess import guessed_table
from tests.svo.logs.dialect.carts import cart, reading

FORCE = np.array([0.25, -0.5, 1.0, 0.75, -1.0, 0.5])
POSITION = np.array([0.0, -0.125, 1234.5, 3.0, 2.5, 1.5])
TENTHS = [f"{k / 10:.1f}" for k in range(6)]
WORDS = {
    "day": "1 day, 0:00:00.{}",
    "iso": "PT0.{}S",
    "amount": "0.{} sec",
    "plus": "+0:00:00.{}",
    "colon": "0:00:00:{}00",
}


def rows(stamps: list[str], mark: str = ";", position: str = "{:g}", force: str = "{:g}") -> str:
    cells = zip(stamps, map(force.format, FORCE), map(position.format, POSITION), strict=True)
    return "".join(mark.join(row) + "\n" for row in cells)


def proposal(folder: Path, text: str) -> str:
    (folder / "log.txt").write_text(text, encoding="utf-8")
    plant = cart(folder, "[log]\n")
    return guessed_table(folder / "log.txt", plant.columns, plant.Ts)


def grouped(mark: str, decimal: str = ".") -> str:
    return rows(TENTHS, position="{:,.3f}").replace(",", "T").replace(".", decimal).replace("T", mark)


@pytest.mark.parametrize(
    "text",
    [
        "t;force;position\n" + grouped("'"),
        "t;force;position\n" + grouped("’"),
        "t;force;position\n" + grouped("\u202f", ","),
        "t;force;position\n" + grouped("\u00a0"),
        "t;force;position\n" + grouped(".", ","),
        "t;force;position\n" + rows(TENTHS, position="{:.6E}").replace("E", "D"),
        "t;force;position\n" + rows(TENTHS, position="{:.6E}").replace("E", "D").replace(".", ","),
        "# written today\n# t force position\n" + rows(TENTHS, " "),
        *(f"t;force;position\n{rows([words.format(k) for k in range(6)])}" for words in WORDS.values()),
    ],
)
def test_a_proposal_reads_its_file(text: str, tmp_path: Path) -> None:
    table = proposal(tmp_path, text)
    log = reading(tmp_path / "log.txt", table, tmp_path).log
    np.testing.assert_array_equal(log.u[:, 0], FORCE)
    np.testing.assert_array_equal(log.y[:, 0], POSITION)
    np.testing.assert_allclose(log.time, 0.1 * np.arange(6), atol=1e-12)


def test_of_two_columns_that_rise_the_one_that_fits_is_the_time(tmp_path: Path) -> None:
    numbered = "".join(f"{k};{line}\n" for k, line in enumerate(rows(TENTHS).splitlines(), start=1))
    assert 'time = { column = 2, unit = "s" }' in proposal(tmp_path, numbered)
    only = "".join(f"{37 * k};{line.partition(';')[2]}\n" for k, line in enumerate(rows(TENTHS).splitlines()))
    assert "# time = { column = 1 }  # in what unit?" in proposal(tmp_path, only)


@pytest.mark.parametrize(
    ("stamps", "words"),
    [
        ([f"{17419437000 + k}00" for k in range(6)], "# stamps of 2025-03-14? then epoch = 1970-01-01 in time"),
        ([f"{45730.5 + k / 864000:.10f}" for k in range(6)], "# stamps of 2025-03-14? then epoch = 1899-12-30 in time"),
    ],
)
def test_an_epoch_is_thought_of(stamps: list[str], words: str, tmp_path: Path) -> None:
    assert words in proposal(tmp_path, "t;force;position\n" + rows(stamps))


@pytest.mark.parametrize("broken", ["0.3;0.7", '"0.3;0.75;3'])
def test_a_damaged_row_is_not_proposed_to_be_skipped(broken: str, tmp_path: Path) -> None:
    table = proposal(tmp_path, "t;force;position;v;w\n" + rows(TENTHS).replace("\n", ";1;2\n") + broken + "\n")
    assert "skip = " not in table
    assert "# a row with cells that are lost? " in table


def test_a_time_that_is_no_number_is_not_proposed_to_be_missing(tmp_path: Path) -> None:
    assert "missing" not in proposal(tmp_path, "t;force;position\n" + rows(TENTHS).replace("0.3;", "inf;"))


def test_an_endless_cell_is_none_of_a_log(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no rows of numbers"):
        proposal(tmp_path, "t;force;position\n0;1;" + "9" * 200_000 + "\n")
    (tmp_path / "log.txt").write_bytes(b"PK\3\4" + bytes(100))
    with pytest.raises(ValueError, match="save the sheet as CSV"):
        guessed_table(tmp_path / "log.txt")


def test_the_same_name_counts_and_a_like_one_is_left_open_beside_another(tmp_path: Path) -> None:
    text = "t;force_limit;force;position_raw;position_set\n" + "".join(f"{k / 10:.1f};1;{k};{k};9\n" for k in range(6))
    table = proposal(tmp_path, text)
    assert '\nforce = { column = "force" }\n' in table
    assert '# position = { column = "position_raw" }  # or "position_set"? undecided' in table


@pytest.mark.parametrize("order", ["mixed", "blocks"])
def test_the_time_of_a_long_log_rises_within_a_tag(order: str, tmp_path: Path) -> None:
    force = [f"{t};force;{f:g}\n" for t, f in zip(TENTHS, FORCE, strict=True)]
    position = [f"{t};position;{p:g}\n" for t, p in zip(TENTHS, POSITION, strict=True)]
    lines = (
        [*force, *position] if order == "blocks" else [x for pair in zip(force, position, strict=True) for x in pair]
    )
    table = proposal(tmp_path, "t;name;value\n" + "".join(lines))
    log = reading(tmp_path / "log.txt", table, tmp_path).log
    np.testing.assert_array_equal(log.u[:, 0], FORCE)
    np.testing.assert_array_equal(log.y[:, 0], POSITION)


def test_a_time_that_goes_back_is_left_open(tmp_path: Path) -> None:
    table = proposal(tmp_path, "t;force;position\n" + rows(TENTHS) + rows(TENTHS))
    assert '# time = { column = "t" }  # it goes back: also part = 2, or order = "sort"?' in table


@pytest.mark.parametrize(
    ("position", "decimal", "told"),
    [("{:.1f}", ",", "0.1 in"), ("{:.2f}", ".", "0.01 in"), ("{:.3f}", ",", ""), ("{:.3f}", ".", "0.001 in"),
     ("{:.6f}", ".", "")],
)  # fmt: skip
def test_to_what_readings_are_rounded_is_a_comment(position: str, decimal: str, told: str, tmp_path: Path) -> None:
    """With a comma before three digits it may be the mark of thousands."""
    table = proposal(tmp_path, "t;force;position\n" + rows(TENTHS, position=position).replace(".", decimal))
    (*_, last) = table.splitlines()
    lines = [line for line in [last] if line.startswith("# written to")]
    assert f'{told} "position"' in lines[0] if told else not any('"position"' in line for line in lines), table
