"""Exact rational arithmetic on floats, and the check that proofs of emptiness come down to.

Every finite float is a rational number, so a linear combination of rows of floats can be formed without any rounding.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from flint import arb, arb_mat, fmpq, fmpq_mat, fmpz
from numpy.typing import NDArray

from polytopes.errors import UndecidedError

Multipliers = dict[int, fmpq]  # row index -> multiplier; rows that are absent have multiplier zero

ZERO = fmpq(0)
_INTEGERS = 2**53  # integers up to here are floats
_CANCELLING = 1e-3  # of the terms of a sum: below, its rounding errors would count


def rational(value: float) -> fmpq:
    """The rational number that the float is."""
    return fmpq(*float(value).as_integer_ratio())


def power_of_two(exponent: int) -> fmpq:
    """``2^exponent``."""
    return fmpq(1 << exponent) if exponent >= 0 else fmpq(1, 1 << -exponent)


def rounded_up(value: fmpq) -> float:
    """The smallest float that is at least `value`; inf beyond all floats."""
    try:
        number = int(value.p) / int(value.q)
    except OverflowError:
        return np.inf if value > 0 else -float(np.finfo(np.float64).max)
    return number if rational(number) >= value else float(np.nextafter(number, np.inf))


def ball_up(value: arb) -> float:
    """The least float that is not below any number of a ball."""
    top = value.upper()
    nearest = float(top)
    return nearest if not top > arb(nearest) else float(np.nextafter(nearest, np.inf))


def ball_matrix(matrix: NDArray[np.float64]) -> arb_mat:
    """The same numbers, exactly."""
    rows, columns = matrix.shape
    return arb_mat(rows, columns, [arb(v) for v in matrix.ravel().tolist()])


def rational_vector(values: NDArray[np.float64]) -> list[fmpq]:
    """Entries of a vector as rationals."""
    return [rational(v) for v in values.tolist()]


def rational_matrix(matrix: NDArray[np.float64]) -> fmpq_mat:
    """A float matrix as rationals (a column, if a vector is given)."""
    rows, columns = matrix.shape if matrix.ndim == 2 else (matrix.shape[0], 1)
    return fmpq_mat(rows, columns, rational_vector(matrix.ravel()))


def quotient(numerator: int, denominator: int) -> float:
    """The nearest float.

    Raises
    ------
    UndecidedError
        If it is beyond all floats.
    """
    try:
        return numerator / denominator
    except OverflowError:
        raise UndecidedError("a number of the answer is beyond all floats; use other units.") from None


def to_floats(values: Iterable[fmpq]) -> NDArray[np.float64]:
    """Rationals rounded to the nearest floats."""
    return np.array([quotient(int(v.p), int(v.q)) for v in values], dtype=np.float64)


def row_to_floats(coefficients: Sequence[fmpq], constant: fmpq) -> NDArray[np.float64]:
    """A row and its constant (last) as floats, up to a positive factor.

    The coefficients are exact where they are a multiple of integers below 2^53: ``x - y / 3 <= 1`` becomes
    ``3 x - y <= 3``, so that rows that were parallel stay so.
    """
    largest = max((abs(v) for v in coefficients), default=ZERO)
    if largest == 0:
        return to_floats([*coefficients, constant])
    denominator, divisor = fmpz(1), fmpz(0)
    for v in coefficients:
        denominator = denominator.lcm(v.q)
    for v in coefficients:
        divisor = divisor.gcd((v * denominator).p)
    factor = fmpq(denominator, divisor)
    factor = factor if largest * factor <= _INTEGERS else 1 / largest
    return to_floats(v * factor for v in [*coefficients, constant])


def combine(rows: NDArray[np.float64], rhs: NDArray[np.float64], multipliers: Multipliers) -> tuple[list[fmpq], fmpq]:
    """Exact ``multipliers' rows`` and ``multipliers' rhs``.

    Parameters
    ----------
    rows, rhs : arrays (m, n) and (m,)
    multipliers : dict of row index to rational

    Returns
    -------
    coefficients, constant : list of n rationals, and one rational
    """
    coefficients = [ZERO] * rows.shape[1]
    constant = ZERO
    for i, weight in multipliers.items():
        row = rows[i]
        for j in np.flatnonzero(row).tolist():
            coefficients[j] += weight * rational(row[j])
        constant += weight * rational(rhs[i])
    return coefficients, constant


def refutes(
    A: NDArray[np.float64],
    b: NDArray[np.float64],
    C: NDArray[np.float64],
    d: NDArray[np.float64],
    inequality: Multipliers,
    equality: Multipliers,
) -> bool:
    """Whether the multipliers prove that no x has ``A x <= b`` and ``C x = d`` (Farkas' lemma).

    They do if ``lambda >= 0``, ``lambda'A + mu'C = 0`` and ``lambda'b + mu'd < 0``.  Nothing is rounded.

    Parameters
    ----------
    A, b, C, d : arrays (m, n), (m,), (q, n), (q,)
    inequality, equality : dicts of row index to rational
        Multipliers lambda on the rows of A and mu on the rows of C.
    """
    if not (_indices_fit(inequality, A) and _indices_fit(equality, C)):
        return False
    if any(weight < 0 for weight in inequality.values()):
        return False
    form, bound = combine(A, b, inequality)
    fixed, value = combine(C, d, equality)
    return all(u + v == 0 for u, v in zip(form, fixed, strict=True)) and bound + value < 0


def _indices_fit(multipliers: Multipliers, rows: NDArray[np.float64]) -> bool:
    return all(0 <= i < rows.shape[0] for i in multipliers)


def substituted(
    A: NDArray[np.float64], b: NDArray[np.float64], point: NDArray[np.float64], basis: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rows ``A x <= b`` in z with ``x = point + basis z``, each entry rounded once (exact where terms cancel).

    Rows come scaled by powers of two, to about unit norm.

    Parameters
    ----------
    A, b : arrays (m, n) and (m,)
    point, basis : arrays (n,) and (n, k)
    """
    both = np.hstack([basis, point[:, None]])
    table, magnitude = A @ both, np.abs(A) @ np.abs(both)
    table[:, -1] = b - table[:, -1]
    magnitude[:, -1] += np.abs(b)
    for i, j in np.argwhere(np.abs(table) < _CANCELLING * magnitude).tolist():
        value = rational(b[i]) if j == basis.shape[1] else ZERO
        sign = -1 if j == basis.shape[1] else 1
        for u, v in zip(A[i].tolist(), both[:, j].tolist(), strict=True):
            if u and v:
                value += sign * rational(u) * rational(v)
        table[i, j] = int(value.p) / int(value.q)
    norms = np.linalg.norm(table[:, :-1], axis=1)
    table = np.ldexp(table, -np.frexp(np.where(norms > 0.0, norms, 1.0))[1][:, None])
    return table[:, :-1], table[:, -1]
