"""Times that cannot be compared are an error, and what is stated against what the log says of itself is told."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from svo import read_log
from svo.logs.columns import LogNote
from tests.svo.logs.dialect.carts import cart, written

DAY = "2025-03-14T09:15:0"
TABLE = """[log]
time = { column = "t", format = "iso" }
[log.columns]
force = { column = "f", time = { start = START, step = 0.1 } }
position = { column = "p [mm]", unit = "UNIT", rate = 0.1 }
"""


def rows(numbers: list[int]) -> str:
    """A log whose stamps are up to 30 ms late, with these rows of it."""
    late = np.random.default_rng(4).uniform(0.0, 0.03, 40)
    cells = [f"{DAY}{0.1 * k + late[k]:.6f}Z,{k % 7},{10 * k}\n" for k in numbers]
    return "t,f,p [mm]\n" + "".join(cells)


def table(start: str = f"{DAY}0Z", unit: str = "mm") -> str:
    return TABLE.replace("START", start).replace("UNIT", unit)


def test_rows_that_are_counted_agree_with_their_stamps_within_half_a_step(tmp_path: Path) -> None:
    log = written(tmp_path, rows(list(range(40))), table()).log
    np.testing.assert_array_equal(log.u[:, 0], np.arange(40) % 7)


@pytest.mark.parametrize(("numbers", "line"), [([*range(7), *range(8, 40)], 9), ([*range(3), 2, *range(3, 40)], 5)])
def test_a_row_that_is_lost_or_stands_twice_is_no_count(numbers: list[int], line: int, tmp_path: Path) -> None:
    """Every input behind it would be of another sample, and a healthy plant falsified."""
    with pytest.raises(ValueError, match=rf"log\.txt, line {line}: the row is at .* by its stamp") as caught:
        written(tmp_path, rows(numbers), table())
    assert "start and step of force" in str(caught.value)


def test_local_dates_and_those_of_a_zone_cannot_be_compared(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"log\.txt: times of force are local dates .* those of position are dates"):
        written(tmp_path, rows(list(range(40))), table(f"{DAY}0"))


def test_dates_and_seconds_cannot_be_compared(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"log\.txt, .* \(0 s to 3\.9 s\)"):
        written(tmp_path, rows(list(range(40))), table("0"))


@pytest.mark.parametrize(("unit", "told"), [("mm", False), ("millimeter", False), ("cm", True), ("m", True)])
def test_a_stated_unit_that_is_not_that_of_the_name_is_told(unit: str, told: bool, tmp_path: Path) -> None:
    notes = written(tmp_path, rows(list(range(40))), table(unit=unit)).notes
    assert any("not in 'mm'" in note for note in notes) == told


@pytest.mark.parametrize(("unit", "told"), [("", True), ("N", True), ("kN", False), ("mN", True)])
def test_an_input_is_told_too(unit: str, told: bool, tmp_path: Path) -> None:
    text = rows(list(range(40))).replace("t,f,", "t,f [kN],")
    stated = table().replace('"f", ', f'"f [kN]", unit = "{unit}", ' if unit else '"f [kN]", ')
    assert any("'kN'" in note for note in written(tmp_path, text, stated).notes) == told


@pytest.mark.parametrize(("Ts", "told"), [(0.1, False), (0.05, True), (0.01, True)])
def test_readings_slower_than_the_sampling_time_are_told(Ts: float, told: bool, tmp_path: Path) -> None:
    text = "t,f,p\n" + "".join(f"{k / 10},{k % 2},{k / 100}\n" for k in range(20))
    plain = '[log]\ntime = { column = "t" }\n[log.columns]\nforce = { column = "f", missing = "hold" }\n'
    notes = written(tmp_path, text, plain + 'position = { column = "p" }\n', Ts=Ts).notes
    assert any("is Ts right?" in note for note in notes) == told


def test_a_note_is_of_the_line_that_had_the_log_read(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    log.write_text(rows(list(range(40))))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_log(log, cart(tmp_path, table()))
    notes = [warning for warning in caught if warning.category is LogNote]
    assert notes
    assert {warning.filename for warning in notes} == {__file__}
