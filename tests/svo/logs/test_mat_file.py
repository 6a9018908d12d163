"""MAT files by our own reader: what scipy reads of intact ones, and one clear error for every other."""

from __future__ import annotations

import io
import random
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.io import loadmat, savemat

from svo.logs.file import read_log
from svo.logs.mat_file import MatFile, read_mat
from svo.plant import Column, Columns

SHAPES = hnp.array_shapes(min_dims=1, max_dims=4, min_side=0, max_side=4)
KINDS = st.sampled_from(["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?", ">f8", ">i4"])
COLUMNS = Columns(inputs=(Column("flow", "l/s"),), outputs=(Column("gauge", "m"),))


def written(variables: dict[str, Any], **options: Any) -> bytes:
    file = io.BytesIO()
    savemat(file, variables, **options)
    return file.getvalue()


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_arrays_are_those_that_scipy_reads(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    arrays = data.draw(st.lists(KINDS.flatmap(lambda kind: hnp.arrays(kind, SHAPES)), min_size=1, max_size=3))
    options: dict[str, Any] = {"do_compression": data.draw(st.booleans())}
    if all(a.ndim <= 2 and a.size and a.dtype.kind != "b" and a.dtype.itemsize < 8 for a in arrays):
        options = {"format": data.draw(st.sampled_from(["4", "5"]))}
    path = tmp_path_factory.mktemp("mat") / "a.mat"
    path.write_bytes(written({f"v{i}": a for i, a in enumerate(arrays)}, **options))
    expected = {k: v for k, v in loadmat(path).items() if not k.startswith("__")}
    found = read_mat(path)
    assert list(found) == list(expected)
    for name, value in expected.items():
        assert found[name].dtype == float
        np.testing.assert_array_equal(found[name], value.astype(float), strict=True)


def test_a_file_of_the_other_byte_order(tmp_path: Path) -> None:
    values = np.array([[1.5, -2.0, 3.0]])
    flags = struct.pack(">IIII", 6, 8, 6, 0) + struct.pack(">IIii", 5, 8, 1, 3) + struct.pack(">I4s", 1 << 16 | 1, b"y")
    numbers = struct.pack(">II", 9, 24) + values.astype(">f8").tobytes()
    matrix = struct.pack(">II", 14, len(flags + numbers)) + flags + numbers
    (tmp_path / "big.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\1\0MI" + matrix)
    np.testing.assert_array_equal(read_mat(tmp_path / "big.mat")["y"], values)
    assert loadmat(tmp_path / "big.mat")["y"].tolist() == values.tolist()


def test_other_things_are_named_as_what_they_are(tmp_path: Path) -> None:
    others = {"a": {"b": 1.0}, "t": "text", "z": np.array([1 + 2j]), "s": scipy.sparse.eye(3, format="csc")}
    others["c"] = np.array([1, "x"], dtype=object)
    for compressed in (False, True):
        (tmp_path / "m.mat").write_bytes(written({**others, "y": [1.0]}, do_compression=compressed))
        kinds = MatFile.open(tmp_path / "m.mat").kinds
        assert kinds == {
            "a": "a struct",
            "t": "a text",
            "z": "an array of complex numbers",
            "s": "a sparse matrix",
            "c": "a cell array",
            "y": "numbers",
        }
    (tmp_path / "log.mat").write_bytes(written({"time_s": [0.0], "flow": [1.0], "gauge": {"value": 1.0}}))
    with pytest.raises(ValueError, match="has no column 'gauge' of numbers; the variable of that name is a struct"):
        read_log(tmp_path / "log.mat", COLUMNS, 0.1)


GOOD = {"time_s": np.arange(30) * 0.1, "flow": np.ones(30), "gauge": np.linspace(0, 1, 30), "extra": {"a": [1, "b"]}}


def damaged(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    at = rng.randrange(len(changed))
    match rng.randrange(4):
        case 0:
            changed[at] ^= 1 << rng.randrange(8)
        case 1:
            changed[at] = rng.randrange(256)
        case 2:
            del changed[at:]
        case _:
            changed[at : at + 4] = rng.choice([b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\0"])
    return bytes(changed)


@pytest.mark.parametrize("options", [{}, {"do_compression": True}, {"format": "4"}], ids=["5", "7", "4"])
def test_a_damaged_file_is_one_clear_error_or_still_a_log(tmp_path: Path, options: dict[str, Any]) -> None:
    good = {k: v for k, v in GOOD.items() if k != "extra" or options != {"format": "4"}}
    content, rng, path = written(good, **options), random.Random(1), tmp_path / "log.mat"
    errors: list[str] = []
    for _ in range(300):
        path.write_bytes(damaged(content, rng))
        try:
            assert len(read_log(path, COLUMNS, 0.1)) == 30
        except ValueError as error:
            errors.append(str(error))
    assert len(errors) > 50
    assert all(error.startswith(str(path)) for error in errors)


def test_every_class_byte_and_every_size_is_an_error_or_numbers(tmp_path: Path) -> None:
    """The byte that says what a matrix is made the process end before."""
    content, path, errors = written({"y": np.arange(5.0)}), tmp_path / "m.mat", set()
    for at in range(128, len(content) - 40):
        for value in (0, 1, 5, 14, 15, 17, 127, 255):
            path.write_bytes(content[:at] + bytes([value]) + content[at + 1 :])
            try:
                assert all(array.size <= 5 for array in read_mat(path).values())
            except ValueError as error:
                errors.add(str(error).partition(":")[0])
    assert errors == {f"{path} is not a MAT file, or is damaged or cut off"}


def test_a_compressed_variable_is_checked_to_its_end(tmp_path: Path) -> None:
    content = written({"y": np.random.default_rng(0).normal(size=2000)}, do_compression=True)
    for at in range(len(content) - 4, len(content)):
        (tmp_path / "m.mat").write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        with pytest.raises(ValueError, match="variable 'y': a compressed variable is damaged"):
            read_mat(tmp_path / "m.mat")


def test_what_unpacks_to_too_much_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = 50_000_000
    head = struct.pack("<IIII", 6, 8, 6, 0) + struct.pack("<IIii", 5, 8, rows, 1)
    head += struct.pack("<I4sII", 1 << 16 | 1, b"y\0\0\0", 2, rows)
    body = zlib.compress(struct.pack("<II", 14, len(head) + rows) + head + bytes(rows), 9)
    assert len(body) < 100_000
    path = tmp_path / "bomb.mat"
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + struct.pack("<II", 15, len(body)) + body)
    with pytest.raises(ValueError, match=r"would unpack to .* MB; the limit is 256 MB\. .*SVO_UNPACK_LIMIT_MB to \d+"):
        read_mat(path)
    path.write_bytes(written({"y": np.zeros(400_000)}, do_compression=True))
    monkeypatch.setenv("SVO_UNPACK_LIMIT_MB", "1")
    with pytest.raises(ValueError, match="the limit is 1 MB"):
        read_mat(path)
    monkeypatch.setenv("SVO_UNPACK_LIMIT_MB", "7")
    assert read_mat(path)["y"].size == 400_000
    monkeypatch.setenv("SVO_UNPACK_LIMIT_MB", "much")
    with pytest.raises(ValueError, match="SVO_UNPACK_LIMIT_MB is 'much'; expected a whole number of megabytes"):
        read_mat(path)
