"""Vectors at places inside MAT files of every version, and columns of Parquet files."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_matrix

from svo import find_plant, read_log
from svo.logs.dialect.mat import read_mat_columns
from tests.svo.logs.dialect.carts import EXAMPLE, reading

TIME, FORCE, POSITION = np.arange(5) * 0.1, np.ones(5), np.array([2.0, np.nan, 4.0, 5.0, 6.0])


def content() -> dict[str, Any]:
    """As Simulink, a script and a careless colleague leave it."""
    signals = np.empty((1, 2), dtype=[("values", object), ("label", object)])
    signals[0, 0] = (FORCE[:, None], "force [N]")
    signals[0, 1] = (POSITION[:, None], "position [mm]")
    cells = np.empty((1, 2), dtype=object)
    cells[0, 0], cells[0, 1] = "a text", POSITION[None, :]
    return {
        "Scope": {"time": TIME[:, None], "signals": signals, "empty": np.zeros((0, 0))},
        "table": np.column_stack([TIME, FORCE, POSITION]),
        "rows": np.vstack([TIME, FORCE, POSITION]),
        "cells": cells,
        "stamps": 1531943810861316819 + 10**8 * np.arange(5, dtype=np.int64),
        "sparse": csc_matrix(np.eye(3)),
        "z": np.array([1 + 2j]),
        "deep": {"a": {"b": {"y": POSITION}}},
    }


def places(time: str, force: str, position: str, unit: str = "") -> str:
    return (
        f'[log]\ntime = {{ column = "{time}"{unit} }}\n[log.columns]\n'
        f'force = {{ column = "{force}" }}\nposition = {{ column = "{position}" }}\n'
    )


@pytest.fixture(params=["5", "7", "7.3"])
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "log.mat"
    if request.param == "7.3":
        write_hdf5(path)
    else:
        savemat(path, content(), do_compression=request.param == "7")
    return path


def write_hdf5(path: Path) -> None:
    """What MATLAB writes with -v7.3: arrays turned over, arrays of structs and cells as references."""
    h5py = pytest.importorskip("h5py")

    def put(group: Any, name: str, value: Any) -> Any:
        if isinstance(value, dict):
            made = group.create_group(name)
            made.attrs["MATLAB_class"] = np.bytes_("struct")
            for field, inner in value.items():
                put(made, field, inner)
            return made
        if isinstance(value, str):
            made = group.create_dataset(name, data=np.array([[ord(c)] for c in value], dtype="u2"))
            made.attrs["MATLAB_class"] = np.bytes_("char")
            return made
        if isinstance(value, csc_matrix):
            made = group.create_group(name)
            made.attrs["MATLAB_class"], made.attrs["MATLAB_sparse"] = np.bytes_("double"), 3
            return made
        value = np.atleast_2d(value)
        if value.dtype.names is not None:
            made = group.create_group(name)
            made.attrs["MATLAB_class"] = np.bytes_("struct")
            for field in value.dtype.names:
                referred(made, field, value[field])
            return made
        if value.dtype == object:
            referred(group, name, value).attrs["MATLAB_class"] = np.bytes_("cell")
            return group[name]
        if value.dtype.kind == "c":
            pairs = np.zeros(value.T.shape, dtype=[("real", "f8"), ("imag", "f8")])
            made = group.create_dataset(name, data=pairs)
        else:
            made = group.create_dataset(name, data=value.T)
        made.attrs["MATLAB_class"] = np.bytes_("int64" if value.dtype == np.int64 else "double")
        return made

    def referred(group: Any, name: str, values: Any) -> Any:
        held = group.file.require_group("#refs#")
        made = group.create_dataset(name, values.T.shape, dtype=h5py.ref_dtype)
        for index in np.ndindex(values.shape):
            made[index[::-1]] = put(held, f"r{len(held)}", values[index]).ref
        return made

    with h5py.File(path, "w", userblock_size=512) as opened:
        for name, value in content().items():
            put(opened, name, value)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as raw:
        raw.write(head)


@pytest.mark.parametrize(
    "table",
    [
        places("Scope.time", "Scope.signals(1).values", "Scope.signals(2).values"),
        places("table(:,1)", "table(:,2)", "table(:,3)"),
        places("rows(1,:)", "rows(2,:)", "cells{2}"),
        places("stamps", "table(:,2)", "deep.a.b.y", ', unit = "ns"'),
    ],
)
def test_a_place_is_written_as_in_matlab(file: Path, table: str, tmp_path: Path) -> None:
    log = reading(file, table, tmp_path).log
    np.testing.assert_array_equal(np.column_stack([log.u, log.y]), np.column_stack([FORCE, POSITION]))
    np.testing.assert_allclose(log.time, TIME, atol=1e-12)


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("Scop.time", "there is no such variable"),
        ("Scope", "a struct (1 x 1), not numbers"),
        ("Scope.tim", "there is no field 'tim'; expected one of"),
        ("Scope.signals.values", "'values' is a field of 1 x 2 structs; expected the number of one, (1).values"),
        ("Scope.signals(3).values", "there is no element 3"),
        ("Scope.signals(1).label", "a text"),
        ("Scope.time.x", "there is no field 'x' in numbers"),
        ("table", "it is 5 x 3, no vector; expected one of its columns, table(:,1)"),
        ("table(:,4)", "(:,4) is no part of numbers (5 x 3)"),
        ("cells", "a cell array (1 x 2), not numbers"),
        ("cells{3}", "there is no element 3"),
        ("cells[2]", "'[2]' is no place"),
        ("sparse", "a sparse matrix"),
        ("z", "an array of complex numbers"),
        ("Scope.empty", "it is empty"),
    ],
)
def test_a_wrong_place_says_what_is_there_and_what_there_is(file: Path, place: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"log\.mat") as caught:
        reading(file, places("Scope.time", place, "Scope.signals(2).values"), tmp_path)
    said = str(caught.value)
    assert words in said
    assert "Scope.time (5 x 1)" in said
    assert "Scope.signals(2).values (5 x 1, 'position [mm]')" in said


def test_a_plain_mat_log_says_where_numbers_are(tmp_path: Path) -> None:
    savemat(tmp_path / "log.mat", content())
    with pytest.raises(ValueError, match=r"has no variable 'time_s', 'force', 'position'\. Numbers are at Scope\.time"):
        read_log(tmp_path / "log.mat", find_plant(str(EXAMPLE)))


def test_an_object_says_how_its_numbers_are_saved(tmp_path: Path) -> None:
    # Class 17, as datetime and timetable have it: no dimensions, then names.
    def element(kind: int, data: bytes) -> bytes:
        return np.array([kind, len(data)], "<u4").tobytes() + data + b"\0" * (-len(data) % 8)

    body = element(6, np.array([17, 0], "<u4").tobytes()) + element(1, b"T") + element(1, b"MCOS")
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    (tmp_path / "log.mat").write_bytes(head + element(14, body))
    with pytest.raises(ValueError, match=r"T is an object .* save\('log\.mat', '-struct', 'S', '-v7'\)"):
        reading(tmp_path / "log.mat", places("T", "T", "T.y"), tmp_path)


@pytest.mark.parametrize("compressed", [False, True])
def test_a_damaged_file_is_one_error_or_still_a_log(compressed: bool, tmp_path: Path) -> None:
    path, rng, errors = tmp_path / "log.mat", random.Random(0), list[str]()
    savemat(path, content(), do_compression=compressed)
    whole = path.read_bytes()
    wanted = ["Scope.time", "Scope.signals(2).values", "cells{2}", "deep.a.b.y", "nothing"]
    for case in range(400):
        changed = bytearray(whole)
        at = rng.randrange(128, len(changed))
        if case % 4 == 0:
            del changed[at:]
        else:
            changed[at] = rng.choice([changed[at] ^ 1 << rng.randrange(8), 0, 127, 255])
        path.write_bytes(bytes(changed))
        for place in wanted:
            try:
                read_mat_columns(path).column(place)
            except ValueError as error:
                errors.append(str(error))
    assert len(errors) > 400
    assert all(error.startswith(str(path)) for error in errors)


def test_columns_of_parquet_are_numbers_texts_and_dates(tmp_path: Path) -> None:
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    start = np.datetime64("2025-03-14T10:15:00")
    stamps = arrow.array(start + (TIME * 1000).round().astype("m8[ms]"), type=arrow.timestamp("us", tz="UTC"))
    texts = ["2,5", "---", "4", "5", None]
    table = arrow.table({"at": stamps, "f": arrow.array([1, 1, 1, 1, 1]), "p": arrow.array(texts)})
    parquet.write_table(table, tmp_path / "log.parquet")
    stated = places("at", "f", "p", ', format = "iso"').replace("[log]", '[log]\nseparator = ";"\ndecimal = ","')
    found = reading(tmp_path / "log.parquet", stated.replace("[log]", '[log]\nmissing = ["---"]'), tmp_path)
    assert found.start == "2025-03-14 10:15:00 UTC"
    np.testing.assert_array_equal(found.log.y[:, 0], [2.5, np.nan, 4, 5, np.nan])
    with pytest.raises(ValueError, match=r"sample 1, column 'p': '---' is no number"):
        reading(tmp_path / "log.parquet", stated, tmp_path)
    with pytest.raises(ValueError, match=r"no column 'q'; found \['at', 'f', 'p'\]"):
        reading(tmp_path / "log.parquet", stated.replace('"p"', '"q"'), tmp_path)
