"""Nodes of MAT files of version 7.3, which are HDF5: read by h5py."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import optional_import
from svo.store.unpacking import check_unpacked

_KINDS = {"struct": "a struct", "cell": "a cell array", "char": "a text", "function_handle": "a function handle"}
_NUMBERS = {
    "double", "single", "logical", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
}  # fmt: skip
_OWN = "#"  # names of MATLAB's own groups begin with it


@dataclass(frozen=True)
class Hdf5Node:
    """A group or data set, read when it is asked for; ``item`` is of the open ``file``."""

    path: Path
    file: Any
    item: Any

    @property
    def kind(self) -> str:
        name = self._class
        if "MATLAB_sparse" in self.item.attrs:
            return "a sparse matrix"
        if name in _NUMBERS or (not name and hasattr(self.item, "dtype") and self.item.dtype.kind in "iufb"):
            compound = hasattr(self.item, "dtype") and self.item.dtype.names is not None
            return "an array of complex numbers" if compound else "numbers"
        return _KINDS.get(name, "a struct" if not name and hasattr(self.item, "keys") else "an object")

    @property
    def shape(self) -> tuple[int, ...]:
        if hasattr(self.item, "keys"):  # a struct; of an array of structs each field holds references
            fields = [self.item[name] for name in self.item]
            held = [field for field in fields if self._is_references(field)]
            return tuple(held[0].shape[::-1]) if held else (1, 1)
        if "MATLAB_empty" in self.item.attrs:
            return (0, 0)
        return tuple(self.item.shape[::-1])

    def names(self) -> list[str]:
        return list(self.item)

    def inner(self, element: int, name: str | None = None) -> Hdf5Node:
        held = self.item if name is None else self.item[name]
        if name is None or self._is_references(held):
            held = self.file[held[()].T.ravel(order="F")[element]]
        return Hdf5Node(self.path, self.file, held)

    def array(self) -> NDArray[Any]:
        if "MATLAB_empty" in self.item.attrs:
            return np.zeros((0, 0))
        check_unpacked(self.path, int(self.item.size) * 8)
        return np.asarray(self.item[()]).T

    def text(self) -> str:
        if "MATLAB_empty" in self.item.attrs:
            return ""
        return "".join(map(chr, np.asarray(self.item[()]).ravel().tolist()))

    @property
    def _class(self) -> str:
        name = self.item.attrs.get("MATLAB_class", b"")
        return name.decode() if isinstance(name, bytes) else str(name)

    def _is_references(self, item: Any) -> bool:
        own = item.attrs.get("MATLAB_class", b"")
        return hasattr(item, "dtype") and item.dtype.kind == "O" and own != b"cell"


def hdf5_nodes(path: Path) -> dict[str, Hdf5Node]:
    """The variables of a file.

    Raises
    ------
    ValueError
        If the file is damaged.
    ImportError
        If h5py is not installed.
    """
    h5py = optional_import("h5py", "logs", "MAT files of version 7.3")
    try:
        file = h5py.File(path, "r")
        return {name: Hdf5Node(path, file, file[name]) for name in file if not name.startswith(_OWN)}
    except (OSError, RuntimeError, KeyError) as error:
        raise ValueError(f"{path} is not a MAT file of version 7.3, or is damaged or cut off ({error})") from error
