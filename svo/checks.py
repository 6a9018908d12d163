"""The ground: checks of what a user hands over, on the one door for numbers (`polytopes.checks`); optional packages."""

from __future__ import annotations

from importlib import import_module
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from polytopes.checks import Shape, listed, real_array, real_number, whole_number

__all__ = [
    "Array",
    "check_disturbance_box",
    "check_noise",
    "finite_array",
    "floats",
    "is_count",
    "is_finite_number",
    "listed",
    "optional_import",
    "positive_number",
    "readings",
    "real_array",
    "real_number",
    "whole_number",
]

Array = NDArray[np.float64]


def finite_array(name: str, value: Any, *shapes: Shape, meaning: str = "") -> Array:
    """Finite numbers as a read-only copy; errors as of `polytopes.checks.real_array`."""
    array = real_array(name, value, *shapes, meaning=meaning)
    array.setflags(write=False)
    return array


def readings(name: str, value: Any, *shapes: Shape, meaning: str = "") -> Array:
    """Numbers of which some may be missing (NaN, masked, None): NaN there, and no infinity."""
    return real_array(name, value, *shapes, meaning=meaning, missing=True)


def floats(name: str, value: Any, *, missing: bool = False) -> Array:
    """What comes at every sample, for a caller that checks shape and NaN: an array of floats goes through as it is."""
    if type(value) is np.ndarray and value.dtype == np.float64 and value.flags.c_contiguous:
        return value
    if type(value) is list and all(type(v) is float for v in value):
        return np.array(value)
    return real_array(name, value, finite=False, missing=missing)


def positive_number(name: str, value: Any, what: str) -> float:
    """One finite number above zero; ``what`` says which, for the error."""
    if not (is_finite_number(value) and value > 0):
        raise ValueError(f"{name} is {value!r}; expected a positive {what}")
    return float(value)


def is_count(value: Any, least: int) -> bool:
    """Whether a value is a whole number of at least so much; truth values are none."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and int(value) >= least


def is_finite_number(value: Any) -> TypeGuard[float]:
    """Whether a value is one real number, neither NaN nor infinite."""
    try:
        real_number("", value)
    except (TypeError, ValueError):
        return False
    return True


def check_disturbance_box(lower: Array, upper: Array, nw: int) -> None:
    """Bounds (nw,), finite and in order."""
    if lower.shape != (nw,) or upper.shape != (nw,):
        raise ValueError(
            f"w has bounds of shapes {lower.shape} and {upper.shape}; expected ({nw},) each, the number of columns of E"
        )
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise ValueError(f"w is between {lower} and {upper}; expected finite bounds for every disturbance")
    if (lower > upper).any():
        bad = int(np.argmax(lower > upper))
        raise ValueError(
            f"w[{bad}] has lower bound {lower[bad]} above its upper bound {upper[bad]}; expected lower <= upper"
        )


def check_noise(noise: Array, ny: int) -> None:
    """Half-widths (ny,), finite and not negative."""
    if noise.shape != (ny,):
        raise ValueError(f"n has shape {noise.shape}; expected ({ny},), one half-width a sensor")
    if not np.isfinite(noise).all() or (noise < 0).any():
        raise ValueError(f"n is {noise}; expected finite half-widths >= 0")


def optional_import(module: str, extra: str, what: str) -> Any:
    """Import a module of a package that an extra of the distribution installs.

    Raises
    ------
    ImportError
        If it is not installed; the message says what needs it and how to get it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ImportError(
            f"{what} need {package}, which is not installed; install the extra: pip install 'svo-fdi[{extra}]'"
        ) from error
