"""The compiled core: one shared library (`core/`, C99), called without Python's headers and with the GIL released.

A function is declared once, with the kinds of its arguments; what it is given is an address, and whoever calls keeps the
array alive for the time of the call.
"""

from __future__ import annotations

import ctypes
import sys
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
    """A function of the core by its name, the kinds of its arguments (`Address`, `Integer`, `Real`) and its result."""
    found = getattr(_library, name)
    found.argtypes, found.restype = arguments, returns
    return found  # type: ignore[no-any-return]


def address(array: NDArray) -> int:
    """Where the first entry of an array lies."""
    return int(array.__array_interface__["data"][0])


def floats(values: ArrayLike) -> NDArray[np.float64]:
    """The values in the layout that the core reads: C-contiguous and aligned doubles; a copy only where they are not."""
    return np.require(values, np.float64, ("C", "A"))


def integers(values: ArrayLike) -> NDArray[np.int64]:
    """The values as C-contiguous and aligned int64."""
    return np.require(values, np.int64, ("C", "A"))
