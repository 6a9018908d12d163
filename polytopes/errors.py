"""Errors of their own kind, and the checks shared by every operation."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


class UndecidedError(ArithmeticError):
    """A question whose answer could be neither proved nor refuted; the message says why."""


class UnboundedError(ValueError):
    """An operation that needs a bounded set was given an unbounded one."""


class EmptySetError(ValueError):
    """An operation that needs a point was given the empty set."""


class ProjectionLimitError(RuntimeError):
    """Fourier-Motzkin elimination would form more rows than it was allowed to."""


def as_array(name: str, value: ArrayLike, ndim: int, *, finite: bool = True) -> NDArray[np.float64]:
    """`value` as a new float64 array of `ndim` dimensions.

    Raises
    ------
    TypeError
        If it is not real and numeric.
    ValueError
        If it has another number of dimensions, a NaN, or (with `finite`) an infinity.
    """
    raw: Any = np.asarray(value)
    if raw.dtype.kind not in "biuf":
        raise TypeError(f"{name} has dtype {raw.dtype}; expected real numbers. Convert it to floats.")
    array = np.array(raw, dtype=np.float64, order="C")
    if array.ndim != ndim:
        raise ValueError(f"{name} has shape {array.shape}; expected an array of {ndim} dimension(s).")
    if np.count_nonzero(np.isfinite(array)) == array.size:  # half the time of `all`, for small arrays
        return array
    if np.isnan(array).any():
        raise ValueError(f"{name} contains NaN; expected numbers. Remove or replace the missing entries.")
    if finite:
        raise ValueError(f"{name} contains an infinity; expected finite numbers. Leave out a row that does not bound.")
    return array


def as_vector(name: str, value: ArrayLike, size: int) -> NDArray[np.float64]:
    """`value` as a new finite vector of `size` entries; ValueError otherwise."""
    vector = as_array(name, value, 1)
    if vector.size != size:
        raise ValueError(f"{name} has shape {vector.shape}; expected ({size},), the dimension of the set.")
    return vector


def as_matrix(name: str, value: ArrayLike, columns: int) -> NDArray[np.float64]:
    """`value` as a new finite matrix of `columns` columns; ValueError otherwise."""
    matrix = as_array(name, value, 2)
    if matrix.shape[1] != columns:
        raise ValueError(f"{name} has shape {matrix.shape}; expected {columns} columns, the dimension of the set.")
    return matrix


def as_tolerance(tol: float) -> float:
    """A nonnegative distance; ValueError otherwise."""
    if not tol >= 0.0:
        raise ValueError(f"tol is {tol}; expected a nonnegative distance.")
    return float(tol)
