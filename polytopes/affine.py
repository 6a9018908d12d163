"""Solutions of ``C x = d``, found by exact elimination and rounded only at the end.

The rank and the consistency of equalities are decided in rationals, so an equality stays an equality however small its
coefficients are, and no tolerance takes a dependent row for an independent one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from flint import fmpq, fmpq_mat
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.derived import derived
from polytopes.exact import (
    ZERO,
    Multipliers,
    power_of_two,
    rational,
    rational_matrix,
    rational_vector,
    row_to_floats,
    to_floats,
)
from polytopes.integers import lowest_bit

_EPS = float(np.finfo(np.float64).eps)
_NO_BITS = 2**20  # exponent of the last bit of zero


@dataclass(frozen=True, eq=False)
class AffineSet:
    """``{x : C x = d}`` as ``x = point + basis z``, where z is the vector of free coordinates of x.

    Attributes
    ----------
    pivots, free : list of int
        Coordinates that the equalities determine, and the others in increasing order.
    solved : fmpq_mat
        Reduced rows ``x_pivot = solved[:, -1] - solved[:, :-1] x_free``, exact.
    contradiction : dict or None
        Multipliers mu with ``mu'C = 0`` and ``mu'd < 0`` if there is no solution.
    """

    dim: int
    pivots: list[int]
    free: list[int]
    solved: fmpq_mat
    contradiction: Multipliers | None

    @derived
    def point(self) -> Floats:
        """A solution (n,): the one with free coordinates zero."""
        point = np.zeros(self.dim)
        if self.pivots:
            point[self.pivots] = to_floats(self.solved[k, len(self.free)] for k in range(len(self.pivots)))
        return point

    @derived
    def basis(self) -> Floats:
        """Directions of the set, array (n, number of free coordinates)."""
        basis = np.zeros((self.dim, len(self.free)))
        basis[self.free, np.arange(len(self.free))] = 1.0
        for k, j in enumerate(self.pivots):
            basis[j] = to_floats(-self.solved[k, q] for q in range(len(self.free)))
        return basis

    def lift(self, z: Floats) -> Floats:
        """Point or points with free coordinates z, array (..., free) to (..., n)."""
        if not self.pivots:
            return z.copy()
        x: Floats = self.point + z @ self.basis.T
        x[..., self.free] = z
        return x

    def lift_exactly(self, z: list[fmpq]) -> list[fmpq]:
        """The exact point with free coordinates z."""
        x = [ZERO] * self.dim
        for j, value in zip(self.free, z, strict=True):
            x[j] = value
        for k, j in enumerate(self.pivots):
            x[j] = self.solved[k, len(self.free)] - sum((self.solved[k, q] * v for q, v in enumerate(z)), ZERO)
        return x

    def restrict(self, A: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Rows ``A x <= b`` on the set, in its free coordinates.

        Rows that cancel (their own coefficients were much larger) are formed exactly: rounding would turn a row that is
        constant on the set into noise.
        """
        if not self.pivots:
            return A, b
        with np.errstate(over="ignore", invalid="ignore"):  # beyond floats on the way: formed exactly too
            reduced, rhs = A @ self.basis, b - A @ self.point
            magnitude = np.abs(A) @ np.abs(self.basis)
        known = ((np.abs(reduced) >= 1e-3 * magnitude) & np.isfinite(magnitude)).all(axis=1) & np.isfinite(rhs)
        cancelled = ~known if self.free else np.ones(len(b), bool)
        for i in np.flatnonzero(cancelled).tolist():
            row, constant = self.restricted_row(A[i], b[i])
            reduced[i], rhs[i] = to_floats(row), to_floats([constant])[0]
        return reduced, rhs

    def restriction_errors(self, A: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Bounds of what `restrict` rounds: arrays (m, free) and (m,), zero for sums that are floats all along."""
        solution = np.hstack([self.basis, self.point[:, None]])
        with np.errstate(over="ignore"):  # a bound that is infinite proves nothing
            reach = np.abs(A) @ np.abs(solution)
        reach[:, -1] += np.abs(b)
        errors = (self.dim + 6) * _EPS * reach
        if not self._rounded:
            errors[exact_sums(A, b, solution, reach)] = 0.0
        return errors[:, :-1], errors[:, -1]

    @derived
    def _rounded(self) -> bool:
        """Whether an entry of the basis or the point is not exactly what it stands for."""
        free = len(self.free)
        exact = [self.solved[k, q] for k in range(len(self.pivots)) for q in range(free + 1)]
        return any(rational(v) != u for u, v in zip(exact, to_floats(exact), strict=True))

    def in_units(self, exponents: NDArray[np.int64]) -> "AffineSet":
        """The same set in coordinates ``x_j = 2^exponents[j] z_j``."""
        entries = []
        for k, j in enumerate(self.pivots):
            powers = [*(exponents[self.free] - exponents[j]).tolist(), -int(exponents[j])]
            entries += [self.solved[k, q] * power_of_two(p) for q, p in enumerate(powers)]
        solved = fmpq_mat(len(self.pivots), len(self.free) + 1, entries)
        return replace(self, solved=solved)

    def restrict_exactly(self, A: Floats, b: Floats) -> tuple[Floats, Floats]:
        """The same in rationals throughout, each row up to a positive factor (see `row_to_floats`)."""
        if not self.pivots:
            return A, b
        exact = [self.restricted_row(row, value) for row, value in zip(A, b, strict=True)]
        table = [row_to_floats(coefficients, constant) for coefficients, constant in exact]
        both = np.array(table).reshape(len(b), len(self.free) + 1)
        return both[:, :-1], both[:, -1]

    def restricted_row(self, row: Floats, rhs: float) -> tuple[list[fmpq], fmpq]:
        """One row ``row'x <= rhs`` on the set, exactly: its coefficients in the free coordinates and its constant."""
        return self.restricted_form(rational_vector(row), rational(rhs))

    def restricted_form(self, exact: list[fmpq], rhs: fmpq) -> tuple[list[fmpq], fmpq]:
        """The same of a row in rationals."""
        coefficients, constant = [exact[j] for j in self.free], rhs
        for k, j in enumerate(self.pivots):
            if exact[j] != 0:
                constant = constant - exact[j] * self.solved[k, len(self.free)]
                for q in range(len(self.free)):
                    coefficients[q] -= exact[j] * self.solved[k, q]
        return coefficients, constant


def affine_set(C: Floats, d: Floats, first: Sequence[int] = (), units: NDArray[np.int64] | None = None) -> AffineSet:
    """Solve ``C x = d`` exactly.

    Parameters
    ----------
    C, d : arrays (q, n) and (q,)
    first : sequence of int
        Coordinates to solve for before any other.  The solved row of another coordinate has no entry in them.
    units : array (n,) of int, optional
        Exponents of two: the coordinates in which large pivots are looked for are ``x_j / 2^units[j]``.
    """
    q, n = C.shape
    if q == 0:
        return AffineSet(n, [], list(range(n)), fmpq_mat(0, n + 1), None)
    order = _pivot_order(C if units is None else _in_units(C, units), list(first))
    table = rational_matrix(np.hstack([C[:, order], d[:, None]]))
    reduced, rank = table.rref()
    leading = [next(j for j in range(n + 1) if reduced[k, j] != 0) for k in range(rank)]
    if leading and leading[-1] == n:
        return AffineSet(n, [], list(range(n)), fmpq_mat(0, n + 1), _contradiction(C, d))
    columns = sorted((j for j in range(n) if j not in leading), key=lambda j: order[j])
    pivots, free = [int(order[j]) for j in leading], [int(order[j]) for j in columns]
    entries = [reduced[k, j] for k in range(rank) for j in [*columns, n]]
    return AffineSet(n, pivots, free, fmpq_mat(rank, len(columns) + 1, entries), None)


def _in_units(C: Floats, units: NDArray[np.int64]) -> Floats:
    """Columns times powers of two, rows of zeros as they are and others with a largest entry of about one."""
    mantissas, powers = np.frexp(C)
    powers = np.where(C != 0.0, powers + units, -(2**40))
    top = powers.max(axis=1, keepdims=True)
    return np.where(C != 0.0, np.ldexp(mantissas, np.maximum(powers - top, -2000)), 0.0)


def exact_sums(A: Floats, b: Floats, solution: Floats, reach: Floats) -> NDArray[np.bool_]:
    """Entries of ``A solution`` (b added to the last column) of which no partial sum is rounded.

    All its terms are multiples of one power of two, and their sizes sum up to `reach`.
    """
    finest = np.full(reach.shape, _NO_BITS)
    finest[:, -1] = _finest(b)
    of_rows, of_solution = _finest(A), _finest(solution)
    for k in range(A.shape[1]):
        finest = np.minimum(finest, of_rows[:, k, None] + of_solution[k])
    return np.asarray(np.frexp(reach)[1] - finest < 52)


def _finest(values: Floats) -> NDArray[np.int64]:
    """Exponent of the last bit of each number, huge for zero."""
    return np.where(values != 0.0, lowest_bit(values), _NO_BITS)


def _pivot_order(C: Floats, first: list[int]) -> NDArray[np.int64]:
    """Columns of C, `first` and then those that make good pivots (complete pivoting in floats) in front."""
    work = C / np.where(np.abs(C).max(axis=1) > 0, np.abs(C).max(axis=1), 1.0)[:, None]
    others = [j for j in range(C.shape[1]) if j not in first]
    order: list[int] = []
    for group in (first, others):
        chosen: list[int] = []
        while group and np.abs(work[:, group]).max() > 0.0:
            i, k = np.unravel_index(np.argmax(np.abs(work[:, group])), (C.shape[0], len(group)))
            j = group[k]
            chosen.append(j)
            work = work - np.outer(work[:, j] / work[i, j], work[i])
            work[i], work[:, j] = 0.0, 0.0
        order += chosen + [j for j in group if j not in chosen]
    return np.array(order, dtype=np.int64)


def _contradiction(C: Floats, d: Floats) -> Multipliers:
    """Multipliers mu with mu'C = 0 and mu'd = -1."""
    q, n = C.shape
    reduced, rank = rational_matrix(np.hstack([C, d[:, None], np.eye(q)])).rref()
    for k in range(rank):
        if all(reduced[k, j] == 0 for j in range(n)) and reduced[k, n] != 0:
            return {i: -reduced[k, n + 1 + i] for i in range(q) if reduced[k, n + 1 + i] != 0}
    raise AssertionError("an inconsistent system has a row that reduces to 0 = 1")
