"""Arrays from .npz files, whose sizes are checked before anything is unpacked."""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from svo.store.unpacking import check_unpacked

_ERRORS = (ValueError, OSError, EOFError, KeyError, NotImplementedError, RuntimeError, MemoryError, zlib.error)
_READ_HEADER = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of numbers and texts in a file that `numpy.savez_compressed` wrote, by name.

    Raises
    ------
    ValueError
        If it is no such file, is damaged or cut off, or unpacks to more than `svo.store.unpacking` allows.
    OSError
        If the file cannot be opened.
    """
    with path.open("rb") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                entries = archive.infolist()
        except (*_ERRORS, zipfile.BadZipFile) as error:
            raise _damaged(path, error) from error
        check_unpacked(path, sum(entry.file_size for entry in entries))
        try:
            with zipfile.ZipFile(file) as archive:
                return {entry.filename.removesuffix(".npy"): _array(archive.read(entry)) for entry in entries}
        except (*_ERRORS, zipfile.BadZipFile) as error:
            raise _damaged(path, error) from error


def _array(content: bytes) -> NDArray[Any]:
    """The array of one .npy file; never an object, which could be anything."""
    file = io.BytesIO(content)
    version = npy.read_magic(file)
    if version not in _READ_HEADER:
        raise ValueError(f"an array has the version {version} of the .npy format")
    shape, fortran, dtype = _READ_HEADER[version](file)
    if dtype.hasobject or len(content) - file.tell() != math.prod(shape) * dtype.itemsize:
        raise ValueError(f"an array has not the bytes of its shape {shape} and type {dtype}")
    data = np.frombuffer(content, dtype, offset=file.tell())
    return data.reshape(shape, order="F" if fortran else "C")


def _damaged(path: Path, error: BaseException) -> ValueError:
    return ValueError(f"{path} is not a file of arrays (.npz), or is damaged or cut off ({error})")
