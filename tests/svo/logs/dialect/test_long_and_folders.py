"""One row a reading, and one file a signal, in dialects of the tests' own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.svo.logs.dialect.carts import reading, written

LONG = """[log]
time = { column = "at", unit = "ms" }
long = { tag = "what", value = "value" }
[log.columns]
position = { tag = "pos", unit = "mm" }
"""
ROWS = (
    "at,what,value,ok\n0,force,1,1\n0,pos,2000,1\n5,heater,on,1\n100,pos,3000,1\n100,force,1,1\n200,force,2,1\n"
    "200,pos,0,0\n"
)


def test_tags_pick_their_rows_and_all_else_is_ignored(tmp_path: Path) -> None:
    log = written(tmp_path, ROWS.replace("0,0\n", "4000,0\n"), LONG).log
    assert (log.u[:, 0].tolist(), log.y[:, 0].tolist()) == ([1, 1, 2], [2, 3, 4])


def test_a_number_beside_a_flag_is_not_read(tmp_path: Path) -> None:
    table = LONG.replace("[log]", '[log]\nvalid = { column = "ok", good = [1, "good"] }')
    log = written(tmp_path, ROWS.replace("200,pos,0,0", "200,pos,broken,0"), table).log
    np.testing.assert_array_equal(log.y[:, 0], [2, 3, np.nan])


def test_tags_in_blocks_one_after_the_other(tmp_path: Path) -> None:
    """Time starts again with each block, and that is no restart: each tag has stamps of its own."""
    text = (
        "at,what,value\n0,force,1\n100,force,2\n200,force,3\n\nat,what,value\n0,pos,1000\n100,pos,2000\n200,pos,3000\n"
    )
    log = written(tmp_path, text, LONG).log
    assert (log.u[:, 0].tolist(), log.y[:, 0].tolist()) == ([1, 2, 3], [1, 2, 3])


def test_a_tag_whose_rows_are_lost_is_missing_there(tmp_path: Path) -> None:
    log = written(tmp_path, ROWS.replace("100,pos,3000,1\n", "").replace("0,0\n", "4000,1\n"), LONG).log
    np.testing.assert_array_equal(log.y[:, 0], [2, np.nan, 4])


def test_an_input_that_is_written_on_change_is_held(tmp_path: Path) -> None:
    table = LONG + 'force = { missing = "hold" }\n'
    text = "at,what,value\n0,force,1\n" + "".join(f"{100 * k},pos,{k}\n" for k in range(5)) + "300,force,2\n"
    assert written(tmp_path, text, table).log.u[:, 0].tolist() == [1, 1, 1, 2, 2]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('tag = "pos"', 'tag = "position"', ["no row has the tag 'position'", "force, heater, pos"]),
        ('value = "value"', 'value = "number"', ["no column 'number'", "'value'"]),
        ('tag = "what"', 'tag = "kind"', ["no column 'kind'", "'what'"]),
    ],
)
def test_what_is_not_in_a_long_log_is_said(old: str, new: str, words: list[str], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"log\.txt") as caught:
        written(tmp_path, ROWS, LONG.replace(old, new))
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


# -- folders -----------------------------------------------------------------------------------------------------------

FOLDER = """[log]
time = { column = "t"ONE }
[log.columns]
force = { file = "drive.csv", column = "u" }
position = { file = "sub/laser.txt", column = "y"MORE }
"""


def folder(tmp_path: Path, drive: str, laser: str) -> Path:
    path = tmp_path / "run"
    (path / "sub").mkdir(parents=True)
    (path / "drive.csv").write_text("t,u\n" + drive, encoding="utf-8")
    (path / "sub" / "laser.txt").write_text("t,y\n" + laser, encoding="utf-8")
    return path


def table(more: str = "", one: str = "") -> str:
    return FOLDER.replace("MORE", more).replace("ONE", one)


def test_files_of_a_folder_are_set_on_the_grid_of_the_input(tmp_path: Path) -> None:
    path = folder(tmp_path, "5,1\n5.1,2\n5.2,3\n", "4.9505,9\n5.0005,1\n5.0505,9\n5.1005,2\n5.2005,3\n5.3005,9\n")
    found = reading(path, table(", every = 2"), tmp_path)
    assert (found.log.u[:, 0].tolist(), found.log.y[:, 0].tolist(), found.start) == ([1, 2, 3], [1, 2, 3], "5 s")
    assert any("1 readings of position after the last of force are left out" in note for note in found.notes)


def test_an_output_that_ends_early_is_missing_then(tmp_path: Path) -> None:
    path = folder(tmp_path, "0,1\n0.1,2\n0.2,3\n", "0,1\n0.1,2\n")
    np.testing.assert_array_equal(reading(path, table(), tmp_path).log.y[:, 0], [1, 2, np.nan])


def test_files_of_two_clocks_are_an_error_unless_stated_to_be_one(tmp_path: Path) -> None:
    path = folder(tmp_path, "0,1\n0.1,2\n0.2,3\n0.3,3\n", "0.2,1\n0.3,2\n")
    with pytest.raises(ValueError, match=r"force begins at 0 s and position at 0.2 s, 0.2 s apart.*one_clock"):
        reading(path, table(), tmp_path)
    log = reading(path, table(one=", one_clock = true"), tmp_path).log
    np.testing.assert_array_equal(log.y[:, 0], [np.nan, np.nan, 1, 2])
    log = reading(path, table(", time = { start = 0, step = 0.1 }"), tmp_path).log
    np.testing.assert_array_equal(log.y[:, 0], [1, 2, np.nan, np.nan])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('file = "drive.csv", ', "", "is a folder; state which file holds force"),
        ("drive.csv", "motor.csv", "motor.csv"),
        ('column = "u"', 'column = "v"', "drive.csv has no column 'v'"),
    ],
)
def test_what_is_not_in_a_folder_is_said(old: str, new: str, words: str, tmp_path: Path) -> None:
    path = folder(tmp_path, "0,1\n0.1,2\n", "0,1\n0.1,2\n")
    with pytest.raises((ValueError, OSError), match=words):
        reading(path, table().replace(old, new), tmp_path)


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"is no folder, and \[log\] states file = 'drive.csv' of it"):
        written(tmp_path, "t,u\n0,1\n", table())
