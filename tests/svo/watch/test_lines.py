from __future__ import annotations

import os
from pathlib import Path
from time import monotonic

import pytest

from svo.watch.lines import FileLines, StreamLines, lines_of


def appended(path: Path, text: str | bytes) -> None:
    with path.open("ab") as file:
        file.write(text if isinstance(text, bytes) else text.encode())


def test_a_half_written_line_waits_for_its_end(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    appended(path, "\ufeffa,b\r\n1,")
    lines = FileLines(path, until_end=False)
    assert lines.read(0.0) == ["a,b"]
    assert lines.read(0.0) == []
    appended(path, "2")
    assert lines.read(0.0) == []
    appended(path, "\n3,4\n5")
    assert lines.read(0.0) == ["1,2", "3,4"]
    lines.close()


def test_a_line_is_complete_whatever_its_bytes_come_in(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    text = "é,b\nü,2\n\n".encode()
    path.touch()
    lines, found = FileLines(path, until_end=False), []
    for i in range(len(text)):
        appended(path, text[i : i + 1])
        found += lines.read(0.0) or []
    assert found == ["é,b", "ü,2", ""]
    lines.close()


def test_silence_lasts_no_longer_than_asked(tmp_path: Path) -> None:
    (tmp_path / "log.csv").touch()
    lines, begun = FileLines(tmp_path / "log.csv", until_end=False), monotonic()
    assert lines.read(0.05) == []
    assert 0.04 < monotonic() - begun < 1.0
    lines.close()


def test_until_the_end_the_last_line_needs_no_end(tmp_path: Path) -> None:
    appended(tmp_path / "log.csv", "a\n1\n2")
    lines = FileLines(tmp_path / "log.csv", until_end=True)
    assert [lines.read(0.0) for _ in range(4)] == [["a", "1"], ["2"], None, None]
    lines.close()


def test_a_stream_ends_where_its_writer_ends() -> None:
    reading, writing = os.pipe()
    lines = StreamLines(reading)
    os.write(writing, b"a\n1")
    assert lines.read(5.0) == ["a"]
    assert lines.read(0.01) == []
    os.close(writing)
    assert lines.read(5.0) == ["1"]
    assert lines.read(5.0) is None
    os.close(reading)


def test_a_file_that_became_shorter_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    appended(path, "a,b\n1,2\n")
    lines = FileLines(path, until_end=False)
    lines.read(0.0)
    path.write_text("a")
    with pytest.raises(ValueError, match=r"log\.csv became shorter"):
        lines.read(0.0)
    lines.close()


def test_bytes_that_are_no_text_are_an_error(tmp_path: Path) -> None:
    appended(tmp_path / "log.csv", b"a\n\xff\xfe\n")
    lines = FileLines(tmp_path / "log.csv", until_end=False)
    with pytest.raises(ValueError, match=r"log\.csv, line 2: not a CSV text file"):
        lines.read(0.0)
    lines.close()


def test_only_text_can_be_followed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"log\.mat cannot be followed while it is written; expected a CSV file"):
        lines_of(str(tmp_path / "log.mat"), until_end=True)
    with pytest.raises(FileNotFoundError):
        lines_of(str(tmp_path / "missing.csv"), until_end=True)
