"""Parquet and MAT files, data frames and data sets: the same rules as for CSV, which test_log_file.py checks."""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from svo.logs.file import read_log, write_log
from svo.logs.log import Log
from svo.plant import Column, Columns

COLUMNS = Columns(
    inputs=(Column("flow", "l/s"),),
    outputs=(Column("gauge_1", "m"), Column("gauge_2", "m")),
    states=(Column("level", "m"),),
)
GOOD = {"time_s": [0.0, 0.1, 0.2], "flow": [1.0, 1, 1], "gauge_1": [2.0, 2, 2], "gauge_2": [3.0, 3, 3]}
WITH_STATE = {**GOOD, "level": [4.0, 4, 4]}
finite = st.floats(allow_nan=False, allow_infinity=False)

Reader = Callable[[dict[str, Any], Path], Log]


def from_parquet(cells: dict[str, Any], folder: Path) -> Log:
    pd.DataFrame(cells).to_parquet(folder / "log.parquet")
    return read_log(folder / "log.parquet", COLUMNS, 0.1)


def from_mat(cells: dict[str, Any], folder: Path) -> Log:
    savemat(folder / "log.mat", cells)
    return read_log(folder / "log.mat", COLUMNS, 0.1)


def from_frame(cells: dict[str, Any], folder: Path) -> Log:
    return Log.from_dataframe(pd.DataFrame(cells), COLUMNS, 0.1)


def from_data_set(cells: dict[str, Any], folder: Path) -> Log:
    return Log.from_xarray(xr.Dataset({name: ("time_s", values) for name, values in cells.items()}), COLUMNS, 0.1)


EVERY = pytest.mark.parametrize("reader", [from_parquet, from_mat, from_frame, from_data_set])


def equal_bits(a: Any, b: Any) -> bool:
    return bool(np.array_equal(a, b, equal_nan=True) and np.array_equal(np.signbit(a), np.signbit(b)))


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_every_form_gives_the_log_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    k, Ts = data.draw(st.integers(1, 6)), data.draw(st.floats(1e-4, 10.0))
    columns = [
        data.draw(st.lists(cell, min_size=k, max_size=k)) for cell in (finite, finite | st.just(math.nan), finite)
    ]
    u, y1, x = (np.array(column)[:, None] for column in columns)
    log = Log(time=np.arange(k) * Ts, u=u, y=np.hstack([y1, u]), x=x)
    folder = tmp_path_factory.mktemp("logs")
    found = [
        Log.from_dataframe(log.to_dataframe(COLUMNS), COLUMNS, Ts),
        Log.from_xarray(log.to_xarray(COLUMNS), COLUMNS, Ts),
    ]
    for suffix in (".csv", ".parquet", ".mat"):
        write_log(folder / f"log{suffix}", log, COLUMNS)
        found.append(read_log(folder / f"log{suffix}", COLUMNS, Ts))
    for back in found:
        for name in ("time", "u", "x"):
            assert equal_bits(getattr(back, name), getattr(log, name))
        assert np.array_equal(back.y, log.y, equal_nan=True)


@EVERY
def test_columns_are_found_by_name_and_others_are_ignored(reader: Reader, tmp_path: Path) -> None:
    log = reader({"remark": [7.0, 7, 7], **dict(reversed(GOOD.items()))}, tmp_path)
    assert log.x is None
    assert log.y.tolist() == [[2, 3]] * 3
    assert reader(WITH_STATE, tmp_path).x is not None


@EVERY
def test_nan_in_a_sensor_is_a_missing_measurement(reader: Reader, tmp_path: Path) -> None:
    log = reader({**GOOD, "gauge_1": [2.0, math.nan, 2.0]}, tmp_path)
    assert np.isnan(log.y).tolist() == [[False, False], [True, False], [False, False]]


@EVERY
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"gauge_1": [2.0, math.inf, 2.0]}, "sample 1, column 'gauge_1': inf is not a finite number"),
        ({"flow": [1.0, 1.0, math.nan]}, "sample 2, column 'flow': the cell is empty or NaN"),
        ({"time_s": [0.0, 0.2, 0.1]}, "a step of 0.2 s; expected the model's sampling time 0.1 s"),
        ({"time_s": [0.1, 0.0, 0.1]}, "sample 1, column 'time_s': .*expected increasing times"),
        ({name: [] for name in GOOD}, "no samples"),
    ],
)
def test_bad_values_are_one_clear_error(
    reader: Reader, tmp_path: Path, change: dict[str, list[float]], expected: str
) -> None:
    with pytest.raises(ValueError, match=expected):
        reader({**GOOD, **change}, tmp_path)


@EVERY
def test_a_missing_column_is_named(reader: Reader, tmp_path: Path) -> None:
    cells = {name: values for name, values in GOOD.items() if name != "gauge_2"}
    with pytest.raises(
        ValueError, match="has no column 'gauge_2'; expected the columns time_s, flow, gauge_1, gauge_2"
    ):
        reader(cells, tmp_path)


@pytest.mark.parametrize("reader", [from_parquet, from_frame, from_data_set])
def test_text_is_no_number(reader: Reader, tmp_path: Path) -> None:
    with pytest.raises((ValueError, TypeError), match=r"'gauge_1' has (the type|dtype) .*; expected (real )?numbers"):
        reader({**GOOD, "gauge_1": ["a", "b", "c"]}, tmp_path)


def test_a_null_is_a_missing_measurement(tmp_path: Path) -> None:
    cells = {**GOOD, "gauge_1": pd.array([2, None, 2], dtype="Int64")}
    for reader in (from_parquet, from_frame):
        assert np.isnan(reader(cells, tmp_path).y[1, 0])


def test_time_may_be_the_index_of_a_frame() -> None:
    assert len(Log.from_dataframe(pd.DataFrame(GOOD).set_index("time_s"), COLUMNS, 0.1)) == 3


def test_units_go_with_the_data() -> None:
    log = Log(time=[0.0], u=[[1.0]], y=[[2.0, 3.0]])
    assert log.to_dataframe(COLUMNS).attrs["units"]["flow"] == "l/s"
    data = log.to_xarray(COLUMNS)
    assert (data["gauge_1"].attrs["units"], data["time_s"].attrs["units"]) == ("m", "s")


def test_a_variable_over_two_dimensions_is_refused() -> None:
    data = xr.Dataset({name: ("time_s", values) for name, values in GOOD.items()})
    data["gauge_1"] = (("time_s", "side"), np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"variable 'gauge_1' has shape \(3, 2\); expected one dimension"):
        Log.from_xarray(data, COLUMNS, 0.1)


def test_vectors_of_a_mat_file_are_rows_or_columns_of_one_length(tmp_path: Path) -> None:
    column = {name: np.array(values)[:, None] for name, values in GOOD.items()}
    assert from_mat({**column, "gain": 3.0}, tmp_path).y.tolist() == [[2, 3]] * 3
    with pytest.raises(ValueError, match=r"variable 'flow' has shape \(1, 2\); expected a vector of 3 samples"):
        from_mat({**GOOD, "flow": [1.0, 1.0]}, tmp_path)
    with pytest.raises(ValueError, match="has no column 'flow'"):  # a text, not numbers
        from_mat({**GOOD, "flow": "on"}, tmp_path)


def test_a_name_that_a_mat_file_cannot_hold_is_refused(tmp_path: Path) -> None:
    columns = Columns(inputs=(), outputs=(Column("field.measured", "deg"),))
    with pytest.raises(ValueError, match=r"'field\.measured' cannot be a variable of a MAT file"):
        write_log(tmp_path / "log.mat", Log(time=[0.0], u=np.zeros((1, 0)), y=[[1.0]]), columns)


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04" * 50, bytes(range(256)) * 4])
@pytest.mark.parametrize("suffix", [".mat", ".parquet"])
def test_bytes_that_are_something_else_are_one_clear_error(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"log{suffix}"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=rf"log{suffix} is not a (MAT|Parquet) file"):
        read_log(path, COLUMNS, 0.1)


def test_mat_files_of_version_7_3_are_refused_with_the_way_out(tmp_path: Path) -> None:
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    (tmp_path / "log.mat").write_bytes(header + b"\x89HDF\r\n\x1a\n" + bytes(512))
    with pytest.raises(ValueError, match=r"version 7.3 \(HDF5\), which is not supported.*'-v7'"):
        read_log(tmp_path / "log.mat", COLUMNS, 0.1)


@pytest.mark.parametrize("suffix", [".txt", ""])
def test_an_unknown_suffix_is_refused(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(ValueError, match=rf"has the suffix '{suffix}'; expected one of .csv, .parquet, .mat"):
        write_log(tmp_path / f"log{suffix}", Log(time=[0.0], u=[[1.0]], y=[[2.0, 3.0]]), COLUMNS)


@pytest.mark.parametrize(("package", "extra"), [("pyarrow", "study"), ("pandas", "study"), ("xarray", "xarray")])
def test_a_package_that_is_not_installed_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str, extra: str
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == package]:
        monkeypatch.setitem(sys.modules, name, None)
    log = Log(time=[0.0], u=[[1.0]], y=[[2.0, 3.0]])
    use: dict[str, Callable[[], Any]] = {
        "pyarrow": lambda: write_log(tmp_path / "log.parquet", log, COLUMNS),
        "pandas": lambda: log.to_dataframe(COLUMNS),
        "xarray": lambda: log.to_xarray(COLUMNS),
    }
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=rf"need {package}, which is not installed.*svo-fdi\[{extra}\]"):
        use[package]()


def test_a_table_that_unpacks_to_too_much_is_refused_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = 100_000
    cells = {**{name: np.zeros(rows) for name in GOOD}, "time_s": np.arange(rows) * 0.1}
    pd.DataFrame(cells).drop(columns="time_s").assign(time_s=0).to_parquet(tmp_path / "log.parquet")
    assert (tmp_path / "log.parquet").stat().st_size < 100_000
    monkeypatch.setenv("SVO_UNPACK_LIMIT_MB", "3")
    with pytest.raises(ValueError, match=r"would unpack to 3 MB; the limit is 3 MB.*SVO_UNPACK_LIMIT_MB to 4"):
        read_log(tmp_path / "log.parquet", COLUMNS, 0.1)


def test_a_damaged_table_is_one_clear_error_or_still_a_log(tmp_path: Path) -> None:
    path, rng, errors = tmp_path / "log.parquet", random.Random(0), []
    pd.DataFrame(GOOD).to_parquet(path)
    content = path.read_bytes()
    for case in range(300):
        changed = bytearray(content)
        at = rng.randrange(len(changed))
        if case % 4 == 0:
            del changed[at:]
        else:
            changed[at] = rng.choice([changed[at] ^ 1 << rng.randrange(8), 0, 127, 255])
        path.write_bytes(bytes(changed))
        try:
            assert len(read_log(path, COLUMNS, 0.1)) == 3
        except ValueError as error:
            errors.append(str(error))
    assert len(errors) > 100
    assert all(error.startswith(str(path)) for error in errors)


def test_a_changed_number_in_a_table_that_was_written_here_is_found(tmp_path: Path) -> None:
    log = Log(time=[0.0, 0.1], u=[[1.0], [1.0]], y=[[2.0, 3.0], [2.0, 3.5]])
    write_log(tmp_path / "log.parquet", log, COLUMNS)
    content = (tmp_path / "log.parquet").read_bytes()
    at = content.index(np.array([3.0, 3.5]).tobytes())
    (tmp_path / "log.parquet").write_bytes(content[:at] + b"\1" + content[at + 1 :])
    with pytest.raises(ValueError, match="is damaged or cut off"):
        read_log(tmp_path / "log.parquet", COLUMNS, 0.1)


@pytest.mark.parametrize("time", [[0.0, 1.7e308, 0.0], [0.0, 0.1, 1.7e308], [-1.7e308, 1.7e308, 0.0]])
def test_a_clock_at_the_end_of_the_range_of_floats_is_one_clear_error(tmp_path: Path, time: list[float]) -> None:
    for path, write in ((tmp_path / "log.parquet", "to_parquet"), (tmp_path / "log.csv", "to_csv")):
        getattr(pd.DataFrame({**GOOD, "time_s": time}), write)(path, index=False)
        with pytest.raises(ValueError, match="time goes from"):
            read_log(path, COLUMNS, 0.1)
