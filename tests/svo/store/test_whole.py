"""Files that appear whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from svo.store import file_name, write_text, write_whole
from svo.store.whole import remove_unfinished


def test_a_link_is_replaced_and_what_it_points_at_is_left_alone(tmp_path: Path) -> None:
    precious = tmp_path / "thesis.txt"
    precious.write_text("years of work")
    (tmp_path / "report.html").symlink_to(precious)
    write_text(tmp_path / "report.html", "new")
    assert precious.read_text() == "years of work"
    assert (tmp_path / "report.html").read_text() == "new"
    assert not (tmp_path / "report.html").is_symlink()


def test_what_was_there_stays_if_writing_fails(tmp_path: Path) -> None:
    write_text(tmp_path / "table.csv", "old")

    def fail(path: Path) -> None:
        path.write_text("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_whole(tmp_path / "table.csv", fail)
    assert [path.name for path in tmp_path.iterdir()] == ["table.csv"]
    assert (tmp_path / "table.csv").read_text() == "old"


def test_only_what_was_left_unfinished_is_removed(tmp_path: Path) -> None:
    for name in (".unfinished-123-run-000001.parquet", ".DS_Store", ".unfinished-notes"):
        (tmp_path / name).write_text("")
    remove_unfinished(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".DS_Store", ".unfinished-notes"]


@pytest.mark.parametrize("name", ["../../x", "a/b", "..", "", "a\\b", "a\0b", "x" * 300, "\x1b[31m", ".hidden", "é"])
def test_a_name_cannot_leave_the_folder(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"delays_{file_name(name)}.png"
    path.write_text("")
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert path.name.isascii()
    assert path.name.isprintable()


def test_plain_names_stay_and_others_stay_apart() -> None:
    assert file_name("quiet") == "quiet"
    assert file_name("rate 0.5") != file_name("rate_0.5") == "rate_0.5"
    assert len({file_name(name) for name in ("a/b", "a_b", "a\\b", "a b")}) == 4
