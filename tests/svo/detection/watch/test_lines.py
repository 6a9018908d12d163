from __future__ import annotations

import os
import tracemalloc
from pathlib import Path
from time import monotonic, process_time

import pytest

from svo.detection.watch.follow import FileLines, lines_of
from svo.detection.watch.lines import LONGEST_LINE, Line, Notice, Splitter
from svo.detection.watch.stream import StreamLines


def appended(path: Path, text: str | bytes) -> None:
    with path.open("ab") as file:
        file.write(text if isinstance(text, bytes) else text.encode())


def texts(found: list[Line | Notice] | None) -> list[str]:
    return [item.text for item in found or []]


def test_a_half_written_line_waits_for_its_end(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    appended(path, "\ufeffa,b\r\n1,")
    lines = FileLines(path, until_end=False)
    assert texts(lines.read(0.0)) == ["a,b"]
    assert lines.read(0.0) == []
    appended(path, "2")
    assert lines.read(0.0) == []
    appended(path, "\n3,4\n5")
    assert texts(lines.read(0.0)) == ["1,2", "3,4"]
    lines.close()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_line_is_complete_whatever_its_bytes_come_in(tmp_path: Path, end: str) -> None:
    path = tmp_path / "log.csv"
    text = "é,b\nü,2\n\n体\n".replace("\n", end).encode()
    path.touch()
    for size in (1, 2, 3, 5):
        lines, found = FileLines(path, until_end=False), []
        for i in range(0, len(text), size):
            appended(path, text[i : i + size])
            found += texts(lines.read(0.0))
        assert found == ["é,b", "ü,2", "", "体"]
        lines.close()
        path.write_bytes(b"")


def test_silence_lasts_no_longer_than_asked(tmp_path: Path) -> None:
    (tmp_path / "log.csv").touch()
    lines, begun = FileLines(tmp_path / "log.csv", until_end=False), monotonic()
    assert lines.read(0.05) == []
    assert 0.04 < monotonic() - begun < 1.0
    lines.close()


def test_at_the_end_a_line_without_its_end_is_left_out_and_named(tmp_path: Path) -> None:
    appended(tmp_path / "log.csv", "a\n1\n2")
    lines = FileLines(tmp_path / "log.csv", until_end=True)
    assert texts(lines.read(0.0)) == ["a", "1"]
    (notice,) = lines.read(0.0) or []
    assert isinstance(notice, Notice)
    assert "log.csv: the last line (3) has no end and was left out" in notice.text
    assert lines.read(0.0) is None
    lines.close()


def test_a_stream_ends_where_its_writer_ends() -> None:
    reading, writing = os.pipe()
    lines = StreamLines(reading)
    os.write(writing, b"a\n1")
    assert texts(lines.read(5.0)) == ["a"]
    assert lines.read(0.01) == []
    os.close(writing)
    (text,) = texts(lines.read(5.0))
    assert "standard input: the last line (2) has no end and was left out" in text
    assert lines.read(5.0) is None
    os.close(reading)


def test_a_pipe_with_a_name_is_a_stream(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "log.csv")
    writing = os.open(tmp_path / "log.csv", os.O_RDWR)
    lines = lines_of(str(tmp_path / "log.csv"), until_end=False)
    os.write(writing, b"a,b\n")
    assert texts(list(lines.read(5.0) or [])) == ["a,b"]
    os.close(writing)
    assert not lines.read(5.0)
    assert lines.read(5.0) is None


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        (b"\xff\xfe", "it is not UTF-8 text"),
        (b"1,\xc3", "it is not UTF-8 text"),
        (b"1,2\x00", "it has NUL bytes in it"),
        (b"\x00" * 5000 + b"1,2", "it has NUL bytes in it"),
        (b"9" * (LONGEST_LINE + 1), f"it is longer than {LONGEST_LINE} bytes"),
    ],
)
def test_a_line_that_is_no_text_is_named_and_the_next_one_is_read(tmp_path: Path, line: bytes, fault: str) -> None:
    appended(tmp_path / "log.csv", b"a,b\n" + line + b"\n3,4\n")
    lines, found = FileLines(tmp_path / "log.csv", until_end=False), []
    while new := lines.read(0.0):
        found += new
    assert [(item.number, item.text) for item in found if isinstance(item, Line)] == [(1, "a,b"), (2, ""), (3, "3,4")]
    bad = found[1]
    assert isinstance(bad, Line)
    assert fault in str(bad.fault)


@pytest.mark.parametrize("size", [16, 1 << 16])
def test_a_line_without_end_takes_linear_time_and_little_memory(size: int) -> None:
    """100 MB in chunks as they are read; more than one of the longest lines, in small ones."""
    splitter, chunk = Splitter(), b"7" * size
    count = 100_000_000 // size if size > 16 else LONGEST_LINE // size + 2
    tracemalloc.start()
    begun = process_time()
    for _ in range(count):
        assert splitter.add(chunk) == []
    used = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert process_time() - begun < 10.0  # quadratic: minutes
    assert used < 8 * LONGEST_LINE
    (line,) = splitter.add(b"\n")
    assert line.fault is not None


def test_a_saved_splitter_goes_on_in_the_middle_of_a_line() -> None:
    text = "a,b\r\n1,ü\r\n3,4\n".encode()
    whole = [line.text for line in Splitter().add(text)]
    for cut in range(len(text) + 1):
        first, second = Splitter(), Splitter()
        found = first.add(text[:cut])
        second.resume(first.state())
        assert [line.text for line in [*found, *second.add(text[cut:])]] == whole


def test_only_text_can_be_followed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"log\.mat cannot be followed while it is written; expected a CSV file"):
        lines_of(str(tmp_path / "log.mat"), until_end=True)
    with pytest.raises(ValueError, match="is a folder; expected a CSV file"):
        lines_of(str(tmp_path), until_end=True)
    with pytest.raises(FileNotFoundError):
        lines_of(str(tmp_path / "missing.csv"), until_end=True)
