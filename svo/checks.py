"""Checks of a model's arrays; every error names the argument, what it is and what was expected."""

from __future__ import annotations

from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def finite_array(name: str, value: Any) -> Array:
    """A read-only copy as floats; ValueError if it is not numeric or not finite."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is not numeric: {error}") from error
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has shape {array.shape} and contains NaN or Inf; expected finite numbers")
    array.setflags(write=False)
    return array


def is_finite_number(value: Any) -> TypeGuard[float]:
    """Whether a value is one real number, neither NaN nor infinite."""
    return isinstance(value, int | float | np.number) and not isinstance(value, complex) and bool(np.isfinite(value))


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
