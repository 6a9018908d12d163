from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from svo.logs.file import read_log, write_log
from svo.logs.log import Log
from svo.plant import Column, Columns

COLUMNS = Columns(
    inputs=(Column("flow", "l/s"),),
    outputs=(Column("gauge_1", "m"), Column("gauge_2", "m")),
    states=(Column("level", "m"),),
)
HEADER = "time_s,flow,gauge_1,gauge_2,level\n"
GOOD = HEADER + "0.0,1,2,3,4\n0.1,1,2,3,4\n0.2,1,2,3,4\n"
QUOTED = GOOD.replace(",", '","').replace("\n", '"\n"').join(('"', ""))[:-1]
finite = st.floats(allow_nan=False, allow_infinity=False)


def written(tmp_path: Path, text: str | bytes) -> Path:
    path = tmp_path / "log.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and a.tobytes() == b.tobytes()


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_what_is_written_reads_back_bit_for_bit(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    k = data.draw(st.integers(1, 6))
    Ts = data.draw(st.floats(1e-4, 10.0))
    channel = st.lists(finite, min_size=k, max_size=k)
    u, level = (np.array(data.draw(channel))[:, None] for _ in range(2))
    y = np.column_stack([data.draw(st.lists(finite | st.just(math.nan), min_size=k, max_size=k)) for _ in range(2)])
    log = Log(time=np.arange(k) * Ts, u=u, y=y, x=level)
    path = tmp_path_factory.mktemp("log") / "log.csv"
    write_log(path, log, COLUMNS)
    back = read_log(path, COLUMNS, Ts)
    assert back.x is not None
    assert same_bits(back.time, log.time)
    assert same_bits(back.u, u)
    assert same_bits(back.x, level)
    assert np.array_equal(np.isnan(back.y), np.isnan(y))
    assert same_bits(back.y[~np.isnan(y)], y[~np.isnan(y)])


def test_columns_are_found_by_name_and_others_are_ignored(tmp_path: Path) -> None:
    path = written(tmp_path, "gauge_2,remark,time_s,gauge_1,flow\n3,hello,5.0,2,1\n3,,5.1,2,1\n")
    log = read_log(path, COLUMNS, 0.1)
    assert log.x is None
    assert log.y.tolist() == [[2, 3], [2, 3]]
    assert log.time.tolist() == [5.0, 5.1]


def test_spreadsheet_habits_are_understood(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        b"\xef\xbb\xbf"
        + GOOD.replace("gauge_1", '"gauge_1"').replace("\n", "\r\n").replace(",", ", ").encode()
        + b"\r\n",
    )
    assert len(read_log(path, COLUMNS, 0.1)) == 3


@pytest.mark.parametrize("cell", ["", "nan", "NaN", " "])
def test_an_empty_or_nan_sensor_cell_is_a_missing_measurement(tmp_path: Path, cell: str) -> None:
    log = read_log(written(tmp_path, GOOD.replace("0.1,1,2", f"0.1,1,{cell}")), COLUMNS, 0.1)
    assert np.isnan(log.y).tolist() == [[False, False], [True, False], [False, False]]


def test_an_unknown_state_is_no_error(tmp_path: Path) -> None:
    assert read_log(written(tmp_path, GOOD.replace("3,4", "3,")), COLUMNS, 0.1).x is not None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ["is empty"]),
        ("\n\n", ["is empty"]),
        (HEADER, ["no samples"]),
        (GOOD.replace("gauge_1", "gauge1"), ["'gauge1' meant?", "'gauge_1', with numbers in m"]),
        (GOOD.replace("flow", "Flow [m3/s]"), ["no column 'flow'", "Is 'Flow [m3/s]' meant?"]),
        (GOOD.replace("flow", "voltage"), ["no column 'flow'", "found time_s, voltage, gauge_1, gauge_2, level"]),
        (GOOD.replace(",", ";"), ["no column 'time_s'", "time_s;flow", "split by semicolons; expected commas"]),
        (GOOD.replace(",", "\t"), ["no column 'time_s'", "split by tabs; expected commas"]),
        (GOOD.replace("0.1,1,2", '0.1,1,"2,5"'), ["line 3", "'2,5' is not a finite number; write a decimal point"]),
        (GOOD.replace("0.1,1,2", '0.1,1,"2'), ["not a CSV text file"]),
        (GOOD.replace("level", "flow"), ["more than one column 'flow'"]),
        (GOOD.replace("0.1,1,2,3,4", "0.1,1,2,3"), ["line 3", "4 cells", "expected 5"]),
        (GOOD.replace("0.1,1,2", "0.1,1,two"), ["line 3", "'gauge_1'", "'two'", "not a finite number"]),
        (GOOD.replace("0.1,1,2", "0.1,1,1_0"), ["line 3", "'gauge_1'", "'1_0'"]),
        (GOOD.replace("0.1,1,2", "0.1,1,inf"), ["line 3", "'gauge_1'", "'inf'"]),
        (GOOD.replace("0.1,1,2", "0.1,1,1e999"), ["line 3", "'gauge_1'", "'1e999'"]),
        (GOOD.replace("0.1,1,2", "0.1,nan,2"), ["line 3", "'flow'", "NaN"]),
        (GOOD.replace("0.1,1,2", ",1,2"), ["line 3", "'time_s'", "empty"]),
        (GOOD.replace("0.2", "0.1"), ["line 4", "increasing"]),
        (GOOD.replace("0.2", "0.05"), ["line 4", "increasing"]),
        (GOOD.replace("0.2", "0.3"), ["line 4", "step of 0.2 s", "sampling time 0.1 s"]),
        (GOOD.replace("0.1,", "100,"), ["line 3", "The column seems to be in milliseconds; divide it by 1000"]),
        (GOOD.replace("0.1,", "100000,"), ["line 3", "seems to be in microseconds; divide it by 1e+06"]),
        (GOOD.replace("0.1,", "100000000,"), ["in nanoseconds; divide it by 1e+09", 'unit = "ns" in [log.time]']),
        (GOOD.replace("0.1,", "0.00166666667,"), ["in minutes; multiply it by 60", 'unit = "min"']),
        (GOOD.replace("\n0.0,", "\n2025-03-14T10:15:00Z,"), ["line 2", "write seconds", 'format = "iso"']),
        (QUOTED.replace(",", ";"), ["seems to be written with semicolons between the cells", "--guess"]),
        ("sep=;\n" + GOOD.replace(",", ";"), ["with semicolons between the cells", "with the names in line 2"]),
        ("Logger 5\n\n" + GOOD, ["with the names in line 3", "svo import"]),
        (GOOD.replace(",", ";").replace(".", ","), ["semicolons", "with decimal commas"]),
        (GOOD.encode("utf-16"), ["not a CSV text file", "seems to be written in utf-16-le"]),
        (b"\xff\xfe\x00\x01time", ["not a CSV text file"]),
        (b"PK\x03\x04\x00\x9c\xff", ["not a CSV text file"]),
    ],
)
def test_a_bad_file_is_one_clear_error(tmp_path: Path, text: str | bytes, expected: list[str]) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ValueError, match=r"log\.csv") as caught:
        read_log(path, COLUMNS, 0.1)
    for words in expected:
        assert words in str(caught.value)


def test_a_log_with_other_channels_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="y of the log has 1 channels; expected 2"):
        write_log(tmp_path / "log.csv", Log(time=[0.0], u=[[1.0]], y=[[1.0]]), COLUMNS)
