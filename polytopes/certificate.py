"""Farkas certificates: rational multipliers that prove a system of rows to have no solution."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
from flint import fmpq, fmpq_mat
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.exact import ZERO, Multipliers, combine, power_of_two, rational, rational_matrix, refutes
from polytopes.shown import Picture, Shown

_ZERO_WEIGHT = 1e-13  # of the largest float multiplier: below, a row takes no part in a proof


class HasRows(Protocol):
    """Anything with rows ``A x <= b``, ``C x = d``."""

    @property
    def A(self) -> Floats: ...
    @property
    def b(self) -> Floats: ...
    @property
    def C(self) -> Floats: ...
    @property
    def d(self) -> Floats: ...


@dataclass(frozen=True)
class Certificate(Shown):
    """Multipliers ``lambda >= 0`` on ``A x <= b`` and free mu on ``C x = d`` that combine to ``0 <= negative``.

    Attributes
    ----------
    inequality, equality : dict of int to fmpq
        Multipliers by row number; rows that are absent have multiplier zero.
    """

    inequality: Multipliers
    equality: Multipliers

    def verify(self, P: HasRows) -> bool:
        """Whether this proves P empty, in exact rational arithmetic on the floats of P.

        True only if all lambda are nonnegative, ``lambda'A + mu'C`` is exactly zero and ``lambda'b + mu'd < 0``.
        """
        return refutes(P.A, P.b, P.C, P.d, self.inequality, self.equality)

    def gap(self, P: HasRows) -> float:
        """``-(lambda'b + mu'd)`` with multipliers of sum one: how far the rows of P are from a common point.

        In the units of b.  A gap of 1e-16 of the entries of b means that rows contradict each other only by rounding.
        """
        _, bound = combine(P.A, P.b, self.inequality)
        _, value = combine(P.C, P.d, self.equality)
        total = sum((abs(v) for v in [*self.inequality.values(), *self.equality.values()]), ZERO)
        if total == 0:
            return 0.0
        ratio = -(bound + value) / total
        return int(ratio.p) / int(ratio.q)

    def __repr__(self) -> str:
        count = len(self.inequality) + len(self.equality)
        return f"<Certificate: exact multipliers of {count} rows>"

    def _picture(self) -> Picture:
        rows = [*self.inequality.items(), *self.equality.items()]

        def draw(ax: Any) -> None:
            ax.stem([i for i, _ in rows], [int(v.p) / int(v.q) for _, v in rows])
            ax.set(xlabel="row", ylabel="multiplier")

        return Picture(draw)

    def to_dict(self) -> dict[str, dict[str, str]]:
        """A dict of strings that JSON can hold without loss: row number to ``"numerator/denominator"``."""
        return {
            "inequality": {str(i): f"{v.p}/{v.q}" for i, v in sorted(self.inequality.items())},
            "equality": {str(i): f"{v.p}/{v.q}" for i, v in sorted(self.equality.items())},
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Read ``data``, what `to_dict` wrote.

        Raises
        ------
        ValueError
            If a part is missing or an entry is not a fraction of integers.
        """
        return cls(_parse(data, "inequality"), _parse(data, "equality"))


def _parse(data: Mapping[str, Any], part: str) -> Multipliers:
    try:
        entries = data[part].items()
    except (LookupError, AttributeError, TypeError):
        raise ValueError(f"certificate has no table {part!r} of multipliers; expected what to_dict writes.") from None
    multipliers: Multipliers = {}
    for row, text in entries:
        try:
            numerator, denominator = str(text).split("/")
            multipliers[int(row)] = fmpq(int(numerator), int(denominator))
        except (ValueError, ZeroDivisionError):
            raise ValueError(
                f"certificate[{part!r}][{row!r}] is {text!r}; expected a row number and 'numerator/denominator'."
            ) from None
    return multipliers


def exact_combination(P: HasRows, weights: Floats, powers: NDArray[np.int64]) -> Certificate | None:
    """Exact multipliers, not all zero, with ``lambda'A + mu'C = 0`` on the support of float ones; None if it has none.

    The largest ones are solved for, so that rounding is absorbed where it cannot change a sign; any that the equations
    leave free keep their float values.  What they combine the right-hand sides to is for the caller to see.

    Parameters
    ----------
    P : object with rows
    weights : array (m,)
        Approximate multipliers of the rows times ``2^powers``, nonnegative up to rounding.
    powers : array (m,) of int
    """
    support = np.flatnonzero(weights > _ZERO_WEIGHT * np.max(weights, initial=0.0))
    support = support[np.argsort(-weights[support], kind="stable")]
    if not support.size:
        return None
    exact = [rational(weights[i]) * power_of_two(int(powers[i])) for i in support]
    columns = np.vstack([P.C, P.A[support[1:]], P.A[support[:1]]]).T
    solution = _solve_free(rational_matrix(columns), exact[1:], exact[0])
    if solution is None or any(v < 0 for v in solution[P.d.size :]):
        return None
    equality = {j: v for j, v in enumerate(solution[: P.d.size]) if v != 0}
    inequality = {int(i): v for i, v in zip(support[1:], solution[P.d.size :], strict=True) if v != 0}
    return Certificate({int(support[0]): exact[0], **inequality}, equality)


def complete_certificate(P: HasRows, inequality: Multipliers) -> Certificate:
    """Certificate of exact multipliers lambda and the mu that solve ``lambda'A + mu'C = 0``, which must be solvable."""
    target, _ = combine(P.A, P.b, inequality)
    q, n = P.C.shape
    table = rational_matrix(P.C.T)
    entries = [table[j, k] if k < q else -target[j] for j in range(n) for k in range(q + 1)]
    reduced, rank = fmpq_mat(n, q + 1, entries).rref()
    equality: Multipliers = {}
    for k in range(rank):
        leading = next(j for j in range(q + 1) if reduced[k, j] != 0)
        if reduced[k, q] != 0:
            equality[leading] = reduced[k, q]
    return Certificate(inequality, equality)


def _solve_free(columns: fmpq_mat, guesses: list[fmpq], leader: fmpq) -> list[fmpq] | None:
    """Solve ``columns [u; leader] = 0`` for u; what is left free takes its guess, or zero (the first entries of u)."""
    reduced, rank = columns.rref()
    unknowns = columns.ncols() - 1
    leading = [next(j for j in range(unknowns + 1) if reduced[k, j] != 0) for k in range(rank)]
    if leading and leading[-1] == unknowns:
        return None
    solution = [ZERO] * (unknowns - len(guesses)) + guesses
    free = [j for j in range(unknowns) if j not in leading]
    for k, j in enumerate(leading):
        solution[j] = -reduced[k, unknowns] * leader - sum((reduced[k, f] * solution[f] for f in free), ZERO)
    return solution
