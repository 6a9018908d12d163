"""Which file has the name, and whether it is the one that was read: content at both ends, and the order of looking."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from svo.detection.watch.follow import FileLines
from svo.detection.watch.lines import Line, Notice

ROWS = [f"{k},{k % 7}" for k in range(400)]


def text_of(rows: list[str]) -> str:
    return "".join(row + "\n" for row in ["a,b", *rows])


def everything(lines: FileLines) -> list[str]:
    """Lines read until nothing comes, "*" where another file begins."""
    found: list[str] = []
    while new := lines.read(0.0):
        shown = [item for item in new if isinstance(item, Line) or item.new_file]
        found += [item.text if isinstance(item, Line) else "*" for item in shown]
    return found


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.csv"
    path.write_text(text_of(ROWS[:200]))
    return path


@pytest.mark.parametrize("same", [20, 150, 199])
@pytest.mark.parametrize("rows", [150, 200, 400])
def test_a_log_that_begins_as_the_one_before_is_another_one(log: Path, same: int, rows: int) -> None:
    """Cut in its place and written anew, to less, as much or more, other from some row on."""
    lines = FileLines(log, until_end=False)
    assert everything(lines) == ["a,b", *ROWS[:200]]
    other = [*ROWS[:same], *(f"{row}1" for row in ROWS[same:rows])]
    log.write_text(text_of(other))
    assert everything(lines) == ["*", "a,b", *other]
    lines.close()


def test_a_log_that_was_cut_back_is_read_from_its_beginning(log: Path) -> None:
    lines = FileLines(log, until_end=False)
    everything(lines)
    log.write_text(text_of(ROWS[:150]))
    assert everything(lines) == ["*", "a,b", *ROWS[:150]]
    lines.close()


@pytest.mark.parametrize("replaced", [False, True])
def test_a_log_with_the_same_content_and_more_goes_on(log: Path, replaced: bool) -> None:
    lines = FileLines(log, until_end=False)
    everything(lines)
    new = log.with_name("new")
    new.write_text(text_of(ROWS))
    if replaced:
        os.replace(new, log)
    else:
        log.write_text(text_of(ROWS))
    assert everything(lines) == ROWS[200:]
    lines.close()


def test_what_is_written_while_the_name_is_looked_up_is_read_first(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The old file gets its last row, and the name a new file, between the end of reading and the look at the name."""
    lines = FileLines(log, until_end=False)
    everything(lines)
    stat, done = os.stat, []

    def rotate_and_stat(path: Any, **options: Any) -> os.stat_result:
        if not done and path == log:
            done.append(True)
            with log.open("a") as file:
                file.write(f"{ROWS[200]}\n")
            os.rename(log, log.with_name("log.csv.1"))
            log.write_text(text_of(ROWS[201:210]))
        return stat(path, **options)

    monkeypatch.setattr(os, "stat", rotate_and_stat)
    assert everything(lines) == [ROWS[200], "*", "a,b", *ROWS[201:210]]
    lines.close()


def test_an_empty_new_file_is_not_gone_over_to(log: Path) -> None:
    lines = FileLines(log, until_end=False)
    everything(lines)
    old = log.with_name("log.csv.1")
    os.rename(log, old)
    log.touch()
    with old.open("a") as file:
        file.write(f"{ROWS[200]}\n")
    assert everything(lines) == [ROWS[200]]
    log.write_text(text_of(ROWS[201:203]))
    assert everything(lines) == ["*", "a,b", *ROWS[201:203]]
    lines.close()


def test_a_link_that_is_set_to_another_file_is_followed(log: Path) -> None:
    link = log.with_name("current")
    link.symlink_to(log)
    lines = FileLines(link, until_end=False)
    everything(lines)
    other = log.with_name("other.csv")
    other.write_text(text_of(ROWS[200:210]))
    new = log.with_name("new")
    new.symlink_to(other)
    os.replace(new, link)
    assert everything(lines) == ["*", "a,b", *ROWS[200:210]]
    lines.close()


def test_a_file_beside_the_log_that_is_another_one_is_not_read(log: Path) -> None:
    log.with_name("log.csv.1").write_text(text_of([f"{row}9" for row in ROWS]))
    lines = FileLines(log, until_end=False)
    everything(lines)
    log.write_text(text_of(["x,y"]))
    found = lines.read(0.0) or []
    assert [item.text for item in found if isinstance(item, Notice)] == [
        f"{log} was truncated or written anew; it is read from its beginning"
    ]
    assert everything(lines) == ["a,b", "x,y"]
    lines.close()
