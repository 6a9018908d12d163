"""Lengths of rows, and rows about as long as one, whatever their unit: squares of large numbers are no floats."""

import numpy as np

from polytopes.checks import Floats


def lengths(rows: Floats) -> Floats:
    """Euclidean lengths (m,) of rows (m, n)."""
    units = _units(rows)
    with np.errstate(over="ignore"):
        return np.asarray(np.ldexp(np.linalg.norm(np.ldexp(rows, -units[:, None]), axis=1), units))


def evened(rows: Floats, sides: Floats) -> tuple[Floats, Floats]:
    """Rows (m, n) and their right-hand sides (m,), each times the power of two that brings its largest entry near 1."""
    units = _units(rows)
    with np.errstate(over="ignore"):  # a hyperplane beyond all floats bounds none of them
        return np.ldexp(rows, -units[:, None]), np.ldexp(sides, -units)


def _units(rows: Floats) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.asarray(np.frexp(np.abs(rows).max(axis=1, initial=0.0))[1], dtype=np.int64)
