"""The rows of a program in even units for the rational simplex: it pivots alike whatever the units of the user are."""

from dataclasses import dataclass, replace

import numpy as np
from flint import fmpq, fmpq_mat
from numpy.typing import NDArray

from polytopes.affine import AffineSet
from polytopes.checks import Floats
from polytopes.derived import derived
from polytopes.exact import ZERO, power_of_two, rational, to_floats
from polytopes.exact_simplex import ExactOutcome, affordable, exact_feasibility, exact_maximum

Exponents = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class EvenRows:
    """``A x <= b`` on an affine set, each row and coordinate to be multiplied by a power of two, which is exact.

    Attributes
    ----------
    rows, columns : arrays (m,) and (n,) of int
        The exponents: row i times ``2^rows[i]``, in coordinates ``x_j = 2^columns[j] z_j``.
    """

    A: Floats
    b: Floats
    flat: AffineSet
    rows: Exponents
    columns: Exponents

    @property
    def affordable(self) -> bool:
        """Whether a rational simplex of this size ends in reasonable time."""
        return affordable(*self.A.shape)

    def only(self, chosen: Exponents) -> "EvenRows":
        """Some of the rows."""
        return replace(self, A=self.A[chosen], b=self.b[chosen], rows=self.rows[chosen])

    @derived
    def _even(self) -> tuple[Floats, Floats, AffineSet]:
        A = np.ldexp(self.A, self.rows[:, None] + self.columns)
        return A, np.ldexp(self.b, self.rows), self.flat.in_units(self.columns)

    def feasible(self, guess: Floats, strictly: bool = False) -> ExactOutcome:
        """`exact_feasibility` from a float point (n,), everything in the user's units."""
        return self._in_users_units(exact_feasibility(*self._even, np.ldexp(guess, -self.columns), strictly))

    def maximum(self, direction: Floats, start: list[fmpq]) -> ExactOutcome:
        """`exact_maximum` from a point that satisfies every row, everything in the user's units."""
        even = [v * power_of_two(-int(p)) for v, p in zip(start, self.columns, strict=True)]
        return self._in_users_units(exact_maximum(*self._even, self._even_form(direction), even))

    def _even_form(self, direction: Floats) -> list[fmpq]:
        """``c'x`` as a form in even units, where it may be beyond floats."""
        return [rational(v) * power_of_two(int(p)) for v, p in zip(direction.tolist(), self.columns, strict=True)]

    def bound(self, direction: Floats, weights: Floats) -> tuple[fmpq, dict[int, fmpq]] | None:
        """The exact bound of ``c'x`` by the rows that carry float multipliers (m,), and the exact multipliers.

        With ``c = A'y`` exactly and y >= 0, ``c'x <= y'b`` all over the set; None if those rows have no such y.
        """
        used = np.flatnonzero(weights).tolist()
        A, b, flat = self._even
        rows = [flat.restricted_row(A[i], b[i]) for i in used]
        form, constant = flat.restricted_form(self._even_form(direction), ZERO)
        entries = [v for j in range(len(form)) for v in [*(row[j] for row, _ in rows), form[j]]]
        reduced, rank = fmpq_mat(len(form), len(used) + 1, entries).rref()
        leading = [next(j for j in range(len(used) + 1) if reduced[k, j] != 0) for k in range(rank)]
        y = [reduced[k, len(used)] for k in range(rank)]
        if len(used) in leading or any(v < 0 for v in y):
            return None
        value = sum((v * rows[k][1] for k, v in zip(leading, y, strict=True)), -constant)
        return value, {used[k]: v * power_of_two(int(self.rows[used[k]])) for k, v in zip(leading, y, strict=True)}

    def _in_users_units(self, outcome: ExactOutcome) -> ExactOutcome:
        point = [v * power_of_two(int(p)) for v, p in zip(outcome.point, self.columns, strict=True)]
        multipliers = {i: v * power_of_two(int(self.rows[i])) for i, v in outcome.multipliers.items()}
        return ExactOutcome(outcome.status, point, outcome.value, multipliers)


def weights_of(outcome: ExactOutcome, rows: int) -> Floats:
    """The multipliers of an optimum over all rows, rounded to floats."""
    multipliers = np.zeros(rows)
    for i, weight in outcome.multipliers.items():
        multipliers[i] = to_floats([weight])[0]
    return multipliers
