"""The compiled core: one shared library (`core/`, C99), called without Python's headers and with the GIL released.

A function is declared once, with the kinds of its arguments. An array, of the type that the function expects, is handed
over as it is (`Given`: to read; `Entries`: to write), or by an address, and then whoever calls keeps it alive.
"""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_SUFFIX = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
PATH = Path(__file__).with_name(f"_core.{_SUFFIX}")

Address = ctypes.c_void_p
Integer = ctypes.c_int64
Real = ctypes.c_double

_bytes = (ctypes.c_char * 0).from_buffer  # a quarter of the time of the array's own interface
InCore = tuple[int, int, bytes, bytes]
"""Rows as functions of the core take them: coordinates n, how many m, and the numbers of A (m, n) and b (m,)."""
_COPIED = 500  # entries of an array below which a copy takes less time than its address


class Entries:
    """The kind of an argument that is a C-contiguous array which the core may write."""

    from_param = _bytes


class Given:
    """The kind of an argument that is an array of any layout which the core only reads."""

    @staticmethod
    def from_param(array: NDArray) -> Any:
        flags = array.flags
        if array.size < _COPIED or not flags.c_contiguous:
            return array.tobytes()
        return _bytes(array) if flags.writeable else Address(address(array))  # type: ignore[arg-type]


def _load() -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(PATH))
    except OSError as error:
        raise ImportError(
            f"the compiled core {PATH} cannot be loaded ({error}); expected it beside this file: install the package "
            "(pip install .), which builds it"
        ) from None


_library = _load()


def function(name: str, *arguments: Any, returns: Any = None) -> Callable[..., Any]:
    """A function of the core by its name, and its result; kinds: `Given`, `Entries`, `Address`, `Integer`, `Real`."""
    found = _library[name]  # one of its own: by attribute, all who ask share one and its kinds
    found.argtypes, found.restype = arguments, returns
    return found


def address(array: NDArray) -> int:
    """Where the first entry of an array lies."""
    return int(array.__array_interface__["data"][0])


def arrays(rows: InCore) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A (m, n) and b (m,) of rows, made of bytes that nobody can write."""
    n, m, A, b = rows
    return np.ndarray((m, n), np.float64, A), np.ndarray(m, np.float64, b)


handle: Callable[[NDArray], Any] = _bytes  # type: ignore[assignment]
"""An array as an `Address` that keeps it alive: for one that goes to the core again and again."""


class _Scratch(threading.local):
    """One block a thread, kept: a call of the core leaves nothing in it that a later one needs."""

    size = 0

    def room(self, doubles: int) -> int:
        if doubles > self.size:
            self.size = doubles + doubles // 2
            self.block = np.empty(self.size)
            self.start = address(self.block)
        return self.start


scratch = _Scratch().room
"""Where a block of so many doubles lies that a call of the core may overwrite."""


def floats(values: ArrayLike) -> NDArray[np.float64]:
    """The values as C-contiguous and aligned doubles, as the core reads them; a copy only where they are not."""
    array = np.asarray(values, np.float64, order="C")
    return array if array.flags.aligned else array.copy()


def integers(values: ArrayLike) -> NDArray[np.int64]:
    """The values as C-contiguous and aligned int64."""
    array = np.asarray(values, np.int64, order="C")
    return array if array.flags.aligned else array.copy()
