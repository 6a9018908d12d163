"""Numeric variables of MATLAB's MAT files, up to version 7.2."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from svo.checks import Array
from svo.logs.mat_elements import Damaged, Element, elements
from svo.store.unpacking import check_unpacked

_HEADER = 128
_HDF5 = b"\x89HDF\r\n\x1a\n"
_V4_NUMBERS = ("f8", "f4", "i4", "i2", "u2", "u1")
_V4_KINDS = ("numbers", "a text", "a sparse matrix")


class _Variable(NamedTuple):
    kind: str
    unpacked: int
    read: Callable[[], Array]
    matrix: Callable[[], tuple[memoryview, str]] | None = None


@dataclass(frozen=True)
class MatFile:
    """What is in a MAT file; arrays are read when they are asked for.

    Attributes
    ----------
    path : path
    kinds : mapping of str to str
        What each variable is: "numbers" (real ones), or other things in words, such as "a struct".
    """

    path: str | Path
    _variables: Mapping[str, _Variable]

    @classmethod
    def open(cls, path: str | Path) -> MatFile:
        """Find the variables of a file.

        Raises
        ------
        ValueError
            If it is no MAT file, is damaged or cut off, or is one of version 7.3 (which is HDF5).
        OSError
            If the file cannot be opened.
        """
        content = Path(path).read_bytes()
        if is_hdf5(content):
            raise ValueError(
                f"{path} is a MAT file of version 7.3 (HDF5), which is not supported; "
                "expected version 7.2 or older: in MATLAB, save('log.mat', '-v7', ...)"
            )
        variables: dict[str, _Variable] = {}
        try:
            for name, variable in _variables(memoryview(content)):
                if name in variables:
                    raise Damaged(f"it has two variables {name!r:.80}")
                variables[name] = variable
        except Damaged as error:
            raise _damaged(path, str(error)) from error
        return cls(path, variables)

    @property
    def kinds(self) -> dict[str, str]:
        return {name: variable.kind for name, variable in self._variables.items()}

    def matrix(self, name: str) -> tuple[memoryview, str] | None:
        """A variable as it stands in a file of version 5 to 7.2, unpacked, and the order of its bytes.

        Raises
        ------
        ValueError
            If it is damaged, or unpacks to more than `svo.store.unpacking` allows.
        """
        variable = self._variables[name]
        if variable.matrix is None:
            return None
        check_unpacked(self.path, variable.unpacked)
        try:
            return variable.matrix()
        except Damaged as error:
            raise _damaged(self.path, f"variable {name!r:.80}: {error}") from error

    @property
    def numeric(self) -> list[str]:
        """Names of the variables that are real numbers."""
        return [name for name, kind in self.kinds.items() if kind == "numbers"]

    def read(self, names: Iterable[str]) -> dict[str, Array]:
        """Arrays of numbers by name, two-dimensional or more.

        Raises
        ------
        ValueError
            If one is damaged, or they unpack to more than `svo.store.unpacking` allows.
        """
        chosen = {name: self._variables[name] for name in names}
        check_unpacked(self.path, sum(variable.unpacked for variable in chosen.values()))
        arrays = {}
        for name, variable in chosen.items():
            try:
                arrays[name] = variable.read()
            except Damaged as error:
                raise _damaged(self.path, f"variable {name!r:.80}: {error}") from error
        return arrays


def read_mat(path: str | Path) -> dict[str, Array]:
    """The real numeric variables of a MAT file, as arrays of two or more dimensions; others are left out.

    Raises
    ------
    ValueError
        If it is no MAT file, is damaged or cut off, unpacks to more than `svo.store.unpacking` allows, or is one of
        version 7.3 (which is HDF5).
    OSError
        If the file cannot be opened.
    """
    file = MatFile.open(path)
    return file.read(file.numeric)


def is_hdf5(content: bytes) -> bool:
    """Whether a file begins as one of version 7.3 does."""
    return content[:10] == b"MATLAB 7.3" or content[:8] == _HDF5 or content[124:128] in (b"\0\2IM", b"\2\0MI")


def _damaged(path: str | Path, what: str) -> ValueError:
    return ValueError(
        f"{path} is not a MAT file, or is damaged or cut off: {what}; expected a whole one of version 4 to 7.2"
    )


def _variables(content: memoryview) -> Iterator[tuple[str, _Variable]]:
    """Names and variables, whatever the version."""
    if not content:
        raise Damaged("it is empty")
    if 0 in content[:4]:  # the header of version 5 is text there
        yield from _version_4(content)
        return
    orders = {b"IM": "<", b"MI": ">"}
    order = orders.get(bytes(content[126:128]))
    if order is None or bytes(content[124:126]) != (b"\0\1" if order == "<" else b"\1\0"):
        raise Damaged("its header is not that of one")
    for element in elements(content[_HEADER:], order):
        yield element.name, _Variable(element.kind, element.unpacked, element.read, _matrix(element))


def _matrix(element: Element) -> Callable[[], tuple[memoryview, str]]:
    return lambda: (element.body(), element.order)


def _version_4(content: memoryview) -> Iterator[tuple[str, _Variable]]:
    at = 0
    while at < len(content):
        if len(content) < at + 20:
            raise Damaged("it ends in the middle of a variable")
        order = "<" if int(np.frombuffer(content, "<i4", 1, at)[0]) in range(10_000) else ">"
        code, rows, columns, is_complex, length = (int(v) for v in np.frombuffer(content, order + "i4", 5, at))
        machine, precision, what = code // 1000, code // 10 % 10, code % 10
        right = machine == (order == ">") and code // 100 % 10 == 0 and precision < 6 and what < 3
        if not (right and rows >= 0 and columns >= 0 and is_complex in (0, 1) and length > 0):
            raise Damaged("the header of a variable of version 4 is not that of one")
        dtype = np.dtype(order + _V4_NUMBERS[precision])
        begin = at + 20 + length
        size = rows * columns * dtype.itemsize
        name = bytes(content[at + 20 : begin]).rstrip(b"\0").decode("latin-1")
        at = begin + (1 + is_complex) * size
        if at > len(content):
            raise Damaged("it ends in the middle of a variable")
        kind = "an array of complex numbers" if is_complex and what == 0 else _V4_KINDS[what]
        yield name, _Variable(kind, 8 * rows * columns, _reader(content[begin : begin + size], dtype, (rows, columns)))


def _reader(data: memoryview, dtype: np.dtype, shape: tuple[int, int]) -> Callable[[], Array]:
    return lambda: np.frombuffer(data, dtype).astype(float).reshape(shape, order="F")
