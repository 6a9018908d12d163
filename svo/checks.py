"""The ground: checks of what a user hands over, on the one door for numbers (`polytopes.checks`); optional packages."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from importlib import import_module
from typing import Any, TypeGuard, TypeVar

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from polytopes.checks import Shape, listed, real_array, real_number, whole_number

__all__ = [
    "Array",
    "bounded_box",
    "check_disturbance_box",
    "check_noise",
    "chosen",
    "expect",
    "expect_kind",
    "expect_one_of",
    "expect_shape",
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
    "sizes",
    "whole_number",
]

Array = NDArray[np.float64]
Item = TypeVar("Item")

_FLOAT = np.dtype(np.float64)


def expect(holds: object, name: str, value: Any, what: str) -> None:
    """Refuse the value of an argument unless something holds; ``what`` was expected instead."""
    if not holds:
        shown = repr(value) if isinstance(value, str) else value
        raise ValueError(f"{name} is {shown}; expected {what}")


def expect_one_of(name: str, value: Any, choices: Collection[str]) -> None:
    """Refuse what is none of some words."""
    expect(value in choices, name, value, f"one of {', '.join(choices)}")


def expect_kind(name: str, value: Any, kind: type | tuple[type, ...], what: str) -> None:
    """Refuse what is of another type; ``what`` was expected instead."""
    if not isinstance(value, kind):
        raise TypeError(f"{name} is a {type(value).__name__}; expected {what}")


def expect_shape(fits: object, name: str, array: NDArray[Any], what: str) -> None:
    """Refuse an array whose shape does not fit; ``what`` was expected instead."""
    if not fits:
        raise ValueError(f"{name} has shape {array.shape}; expected {what}")


def chosen(name: str, value: str, choices: Mapping[str, Item]) -> Item:
    """What a word stands for."""
    expect_one_of(name, value, choices)
    return choices[value]


def sizes(name: str, value: Any, count: int) -> Array:
    """So many finite numbers >= 0, such as half-widths."""
    array = real_array(name, value, (count,))
    expect((array >= 0).all(), name, array, f"{count} finite numbers >= 0")
    return array


def finite_array(name: str, value: Any, *shapes: Shape, meaning: str = "") -> Array:
    """Finite numbers as a read-only copy; errors as of `polytopes.checks.real_array`."""
    array = real_array(name, value, *shapes, meaning=meaning)
    array.setflags(write=False)
    return array


def readings(name: str, value: Any, *shapes: Shape) -> Array:
    """Numbers of which some may be missing (NaN, masked, None): NaN there, and no infinity."""
    return real_array(name, value, *shapes, missing=True)


def floats(name: str, value: Any, *, missing: bool = False) -> Array:
    """What comes at every sample, for a caller that checks shape and NaN: an array of floats goes through as it is."""
    if type(value) is np.ndarray and value.dtype == _FLOAT and value.flags.c_contiguous:
        return value
    if type(value) is list and all(type(v) is float for v in value):
        return np.array(value)
    return real_array(name, value, finite=False, missing=missing)


def positive_number(name: str, value: Any, what: str) -> float:
    """One finite number above zero; ``what`` says which, for the error."""
    expect(is_finite_number(value) and value > 0, name, value, f"a positive {what}")
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
    expect_shape(noise.shape == (ny,), "n", noise, f"({ny},), one half-width a sensor")
    expect(np.isfinite(noise).all() and (noise >= 0).all(), "n", noise, "finite half-widths >= 0")


def bounded_box(name: str, P: HPolytope, dimension: int) -> tuple[Array, Array]:
    """Bounds of a set that must have a point and be bounded."""
    expect_kind(name, P, HPolytope, "an HPolytope, such as HPolytope.box(lower, upper)")
    if P.dim != dimension:
        raise ValueError(f"{name} has dimension {P.dim}; expected {dimension}")
    if P.emptiness().status != "nonempty":
        raise ValueError(f"{name} is empty, or not surely nonempty; expected a bounded set with a point")
    lower, upper = (np.asarray(b, dtype=float) for b in P.bounding_box())
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise ValueError(f"{name} is unbounded; expected a bounded set, such as a box as large as the values can be")
    return lower, upper


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
