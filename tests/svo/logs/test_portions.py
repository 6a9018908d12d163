"""A log is the same in portions of any size, whoever reads its blocks."""

from __future__ import annotations

import csv
import io
import math
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from svo.logs import csv as csv_logs
from svo.logs.columns import LogNote
from svo.logs.csv import read_csv
from svo.logs.file import read_log, read_portions, write_log
from svo.logs.log import Log
from svo.logs.parquet import read_parquet
from svo.logs.portions import joined, portions_of
from svo.plant import Column, Columns

COLUMNS = Columns(inputs=(Column("u", "N"),), outputs=(Column("y", "m"), Column("z", "m")))
HEADER = ["remark", "y", "time_s", "u", "z"]
Ts = 0.1


def told(read: Callable[[], Log]) -> tuple[Any, list[str]]:
    """What reading gives, to the bit, or its error; and its notes."""
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        try:
            log = read()
            found: Any = [array.tobytes() for array in (log.time, log.u, log.y)]
        except ValueError as error:
            found = str(error)
    return found, [str(note.message) for note in notes if issubclass(note.category, LogNote)]


def at_once(path: Path) -> Log:
    """The rules, written down once more as simply as they can be: all rows of the whole text, one after the other."""
    data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    end = max(data.rfind(b"\n"), data.rfind(b"\r")) + 1 or len(data)
    if data[end:].strip():
        number = len(data[:end].replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n"))
        warnings.warn(
            f"{path}: the last line ({number}) has no end and was left out, since it may be cut; if it is whole, put a "
            "line break behind it",
            LogNote,
            stacklevel=1,
        )
    reader = csv.reader(io.StringIO(data[:end].decode(), newline=""), strict=True, skipinitialspace=True)
    rows, is_cut = [], False
    try:
        for row in reader:
            if row:
                rows.append((reader.line_num, [cell.strip() for cell in row]))
    except csv.Error:
        is_cut = True
    names, before = rows[0][1], None
    time, u, y = [], [], []
    for line, cells in rows[1:]:
        if len(cells) != len(names):
            raise ValueError(f"line {line}: {len(cells)} cells; expected {len(names)}")
        numbers = dict(zip(names, cells, strict=True))
        values = [as_number(numbers[name], line, name) for name in ("time_s", "u", "y", "z")]
        if before is not None and abs(values[0] - before - Ts) > 0.01 * Ts:
            raise ValueError(f"line {line}, column 'time_s': time goes")
        before = values[0]
        time.append(before)
        u.append(values[1:2])
        y.append(values[2:])
    if is_cut:
        raise ValueError("not a CSV text file")
    if not time:
        raise ValueError("has a header but no samples")
    return Log(np.array(time), np.array(u), np.array(y))


def as_number(cell: str, line: int, name: str) -> float:
    try:
        value = float(cell) if cell and "_" not in cell else math.inf if cell else math.nan
    except ValueError:
        value = math.inf
    if math.isinf(value):
        raise ValueError(f"line {line}, column {name!r}: {cell!r} is not a finite number")
    if math.isnan(value) and name in ("time_s", "u"):
        raise ValueError(f"line {line}, column {name!r}: the cell is empty or NaN")
    return value


good = st.floats(-1e6, 1e6).map(repr) | st.integers(-(10**20), 10**20).map(str)
odd = st.sampled_from(
    [
        "1e-400",
        "+2.5",
        ".5",
        "5.",
        "1E5",
        "-0.0",
        "4.9e-324",
        "2.2250738585072011e-308",
        "1.7976931348623157e308",
        "007",
    ]
)
none = st.sampled_from(["", "nan", "NaN", "NAN", " ", "-nan"])
bad = st.sampled_from(["x", "1_0", "inf", "1e999", "0x1p3", "nan(1)", "1,5", "1 2", "--", "\x00", "１", "1e"])


@st.composite
def texts(draw: st.DrawFn) -> bytes:
    """A file of a few rows, most of them ordinary."""
    end, rows = draw(st.sampled_from(["\n", "\r\n", "\r"])), draw(st.integers(0, 25))
    strange = draw(st.sampled_from([0, 0, 0, 1, 1, 2]))
    where = draw(st.lists(st.integers(0, max(rows - 1, 0)), min_size=strange, max_size=strange))
    lines = [draw(styled(HEADER))]
    for k in range(rows):
        cells = [draw(good) for _ in range(3)]
        row = [draw(st.sampled_from(["", "ok", "9"])), cells[0], repr(5 + k * Ts), cells[1], cells[2]]
        if k in where:
            row = draw(st.sampled_from(ODD_ROWS))(draw, row)
        lines.append(draw(styled(row)) if k in where else ",".join(row))
    text = end.join(lines) + draw(st.sampled_from([end, end, end, "", end + "1,2", end + end]))
    mark = draw(st.sampled_from([b"", b"", b"\xef\xbb\xbf"]))
    return mark + text.encode()


def other_cell(kind: st.SearchStrategy[str], draw: st.DrawFn, row: list[str]) -> list[str]:
    at = draw(st.integers(1, len(row) - 1))
    return [*row[:at], draw(kind), *row[at + 1 :]]


ODD_ROWS: Sequence[Callable[[st.DrawFn, list[str]], list[str]]] = (
    *(partial(other_cell, kind) for kind in (odd, none, bad)),
    lambda draw, row: ["Füße 体 \u2028", *row[1:]],
    lambda draw, row: ["over\ntwo\r\nlines", *row[1:]],
    lambda draw, row: row[:-1],
    lambda draw, row: [*row, ""],
    lambda draw, row: [],
    lambda draw, row: [*row[:2], "5.0", *row[3:]],
)


@st.composite
def styled(draw: st.DrawFn, cells: Sequence[str]) -> str:
    quoted = draw(st.booleans())
    text = ['"' + cell.replace('"', '""') + '"' if quoted or set(cell) & set(',"\r\n') else cell for cell in cells]
    return draw(st.sampled_from([",", ",", ", "])).join(text)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(texts(), st.integers(1, 400))
@example(b'remark,y,time_s,u,z\n,1,0.0,1,1\n,1,0.1,1,1\n"a\n\nb",1,0.2,1,1\n\n\n,1,0.3,1,x\n', 20)
@example(b"remark,y,time_s,u,z\r,1,0.0,1,1\r\n,1,0.1,1,1\n\r,1,0.2,1,\r,1,0.3,,\r", 19)
def test_a_text_is_the_same_in_blocks_of_any_size(tmp_path: Path, text: bytes, block: int) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(text)
    expected, notes = told(lambda: at_once(path))
    for quick_from in (0, 10**9):
        rows = read_csv(path, COLUMNS, block=block, quick_from=quick_from)
        found, said = told(lambda rows=rows: joined(list(portions_of(str(path), rows, COLUMNS, Ts))))
        assert expected in found if isinstance(expected, str) and isinstance(found, str) else found == expected
        assert said == notes or isinstance(expected, str)


def test_ordinary_blocks_are_read_quickly_and_others_with_care(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pyarrow", reason="needs pyarrow, which reads long CSV files quickly")
    rows = [f"ok,{k % 7},{k * Ts!r},{k},{'' if k % 5 else k}\n" for k in range(2000)]
    rows[1000] = "Füße" + rows[1000]
    (path := tmp_path / "log.csv").write_text("remark,y,time_s,u,z\n" + "".join(rows), encoding="utf-8")
    monkeypatch.setattr(csv_logs, "_rows", lambda *_: pytest.fail("a block was read row by row"))
    quick = list(read_csv(path, COLUMNS, block=4096, quick_from=0))
    assert len(quick) > 8
    monkeypatch.undo()
    rows[1500] = rows[1500].replace("ok", '"ok"')
    path.write_text("remark,y,time_s,u,z\n" + "".join(rows), encoding="utf-8")
    careful: list[int] = []
    own = csv_logs._rows
    monkeypatch.setattr(csv_logs, "_rows", lambda lines, *rest: careful.append(lines.number) or own(lines, *rest))
    log = joined(list(portions_of("log", read_csv(path, COLUMNS, block=4096, quick_from=0), COLUMNS, Ts)))
    assert len(careful) == 1
    assert np.array_equal(log.y, at_once(path).y, equal_nan=True)


@pytest.mark.parametrize("where", [1, 70_000, 99_999])
def test_a_bad_cell_far_down_is_named_by_its_line(tmp_path: Path, where: int) -> None:
    rows = [f",{k},{k * Ts!r},1,2\n" for k in range(100_000)]
    rows[where] = rows[where].replace(",1,2", ",1,two")
    (path := tmp_path / "log.csv").write_text("remark,y,time_s,u,z\n" + "".join(rows))
    with pytest.raises(ValueError, match=rf"log\.csv, line {where + 2}, column 'z': 'two' is not a finite number"):
        read_log(path, COLUMNS, Ts)


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mat"])
def test_portions_of_a_file_make_its_log(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("pyarrow", reason="needs pyarrow, which reads Parquet")
    rng = np.random.default_rng(0)
    y = rng.normal(size=(70_000, 2))
    y[rng.random(y.shape) < 0.1] = np.nan
    log = Log(np.arange(len(y)) * Ts, rng.normal(size=(len(y), 1)), y)
    write_log(path := tmp_path / f"log{suffix}", log, COLUMNS)
    portions = list(read_portions(path, COLUMNS, Ts))
    assert len(portions) > 1 or suffix == ".mat"
    assert max(map(len, portions)) < 40_000 or suffix == ".mat"
    again = joined(portions)
    assert all(getattr(again, name).tobytes() == getattr(log, name).tobytes() for name in ("time", "u", "y"))


@pytest.mark.parametrize("rows", [1, 7, 1000])
def test_errors_of_parquet_count_samples_from_the_first(tmp_path: Path, rows: int) -> None:
    pytest.importorskip("pyarrow", reason="needs pyarrow, which reads Parquet")
    time = np.arange(100) * Ts
    time[60:] += 0.02
    write_log(path := tmp_path / "log.parquet", Log(time, np.ones((100, 1)), np.ones((100, 2))), COLUMNS)
    with pytest.raises(ValueError, match=r"log\.parquet, sample 60, column 'time_s': time goes from 5\.9 s to 6\.02 s"):
        list(portions_of(str(path), read_parquet(path, COLUMNS, rows=rows), COLUMNS, Ts))
