"""Exact rational arithmetic on floats, and the one check that every proof of emptiness comes down to.

Every finite float is a rational number, so a linear combination of rows of floats can be formed without any rounding.
The functions take plain arrays and rational multipliers: a certificate of an `HPolytope` and the proof of an observer's
window are checked by the same lines.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from flint import fmpq, fmpq_mat, fmpz
from numpy.typing import NDArray

Multipliers = dict[int, fmpq]  # row index -> multiplier; rows that are absent have multiplier zero

ZERO = fmpq(0)
_INTEGERS = 2**53  # integers up to here are floats
_CANCELLING = 1e-3  # of the terms of a sum: below, its rounding errors would count


def rational(value: float) -> fmpq:
    """The rational number that the float is."""
    return fmpq(*float(value).as_integer_ratio())


def rational_vector(values: NDArray[np.float64]) -> list[fmpq]:
    """Entries of a vector as rationals."""
    return [rational(v) for v in values.tolist()]


def rational_matrix(matrix: NDArray[np.float64]) -> fmpq_mat:
    """A float matrix as rationals (a column, if a vector is given)."""
    rows, columns = matrix.shape if matrix.ndim == 2 else (matrix.shape[0], 1)
    return fmpq_mat(rows, columns, rational_vector(matrix.ravel()))


def to_floats(values: Iterable[fmpq]) -> NDArray[np.float64]:
    """Rationals rounded to the nearest floats."""
    return np.array([int(v.p) / int(v.q) for v in values], dtype=np.float64)


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


def least_over_box(
    coefficients: Sequence[fmpq], lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> fmpq | None:
    """Exact minimum of a linear form over a box; None if it is unbounded below.

    Infinite bounds are allowed where the coefficient is exactly zero.
    """
    total = ZERO
    for j, coefficient in enumerate(coefficients):
        if coefficient == 0:
            continue
        bound = lower[j] if coefficient > 0 else upper[j]
        if not np.isfinite(bound):
            return None
        total += coefficient * rational(bound)
    return total


def refutes(
    A: NDArray[np.float64],
    b: NDArray[np.float64],
    C: NDArray[np.float64],
    d: NDArray[np.float64],
    inequality: Multipliers,
    equality: Multipliers,
    box: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> bool:
    """Whether the multipliers prove that no x (in the box, if given) has ``A x <= b`` and ``C x = d`` (Farkas' lemma).

    With ``g = lambda'A + mu'C`` and ``lambda >= 0``, the proof holds if the minimum of ``g'x`` over the box exceeds
    ``lambda'b + mu'd``; without a box, g must be exactly zero.  Nothing is rounded.

    Parameters
    ----------
    A, b, C, d : arrays (m, n), (m,), (q, n), (q,)
    inequality, equality : dicts of row index to rational
        Multipliers lambda on the rows of A and mu on the rows of C.
    box : pair of arrays (n,), optional
        Bounds of the variables; may be infinite.
    """
    if not (_indices_fit(inequality, A) and _indices_fit(equality, C)):
        return False
    if any(weight < 0 for weight in inequality.values()):
        return False
    form, bound = combine(A, b, inequality)
    fixed, value = combine(C, d, equality)
    form = [u + v for u, v in zip(form, fixed, strict=True)]
    if box is None:
        return all(v == 0 for v in form) and bound + value < 0
    least = least_over_box(form, *box)
    return least is not None and least > bound + value


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
