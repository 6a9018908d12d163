"""Inclusion and membership without a tolerance, decided about exactly the floats that the rows are.

``Q <= P`` if and only if ``h_Q(a) <= b`` for every row of P.  Floats propose: an upper bound of the support that is not
above b proves it, a lower bound above b refutes it.  What is between them is decided in rationals: by exact multipliers
of the rows at hand, by the rational simplex, or by the generators in integers.
"""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.errors import UndecidedError
from polytopes.exact import rational
from polytopes.exact_sides import exact_form
from polytopes.linear_program import OPTIMAL, UNBOUNDED
from polytopes.outer_supports import lower_supports
from polytopes.outward_normals import support_of
from polytopes.rows import Rows
from polytopes.support import known_nonempty

_EPS = float(np.finfo(np.float64).eps)


def has_point(P: Rows, x: Floats) -> bool:
    """Whether x (n,) satisfies every row of P exactly; rows that rounding leaves open are decided in rationals."""
    normals, sides = half_spaces(P)
    excess, sizes = normals @ x - sides, np.abs(normals) @ np.abs(x) + np.abs(sides)
    room = (P.dim + 3) * _EPS * sizes + 1e-300
    if (excess > room).any():
        return False
    return all(exact_form(normals[i], x) <= sides[i] for i in np.flatnonzero(~(excess < -room)))


def has_exact_point(P: Rows, x: Sequence[Fraction]) -> bool:
    """The same of a point of rationals."""
    normals, sides = half_spaces(P)
    values = [sum((Fraction(u) * v for u, v in zip(row, x, strict=True)), Fraction(0)) for row in normals.tolist()]
    return all(value <= side for value, side in zip(values, sides.tolist(), strict=True))


def half_spaces(P: Rows) -> tuple[Floats, Floats]:
    """Normals and right-hand sides of all rows, an equality as two: those of A, those of C, those of -C."""
    if not P.d.size:
        return P.A, P.b
    return np.vstack([P.A, P.C, -P.C]), np.concatenate([P.b, P.d, -P.d])


def strictest(normals: Floats, sides: Floats) -> tuple[Floats, Floats]:
    """Of rows with one normal, to the bit, the one with the least side; in their order."""
    kept: dict[bytes, int] = {}
    for i, normal in enumerate(normals):
        k = kept.setdefault(normal.tobytes(), i)
        if sides[i] < sides[k]:
            kept[normal.tobytes()] = i
    chosen = sorted(kept.values())
    return normals[chosen], sides[chosen]


def broken_row(P: Rows, Q: Rows) -> int | None:
    """Number of a row of P (see `half_spaces`) that some point of Q breaks; None if Q lies in P.  Exact.

    Raises
    ------
    UndecidedError
        If Q is too large for rational arithmetic where floats cannot decide.
    """
    normals, sides = half_spaces(P)
    asked = _not_given(normals, sides, Q)
    if not asked.size or not known_nonempty(Q):
        return None
    best = Q.program.maximise(normals[asked])
    with np.errstate(over="ignore"):
        excess = best.values - sides[asked]
    doubtful = np.flatnonzero(~(excess <= 0.0))
    for k in doubtful[np.argsort(-np.nan_to_num(excess[doubtful], nan=-np.inf), kind="stable")].tolist():
        normal, side = normals[asked[k]], float(sides[asked[k]])
        known = best.status[k] == OPTIMAL and _bounded_by(Q, normal, best.multipliers[k], side)
        if not known and _exceeds(Q, normal, side, best.status[k]):
            return int(asked[k])
    return None


def _not_given(normals: Floats, sides: Floats, Q: Rows) -> NDArray[np.int64]:
    """Numbers of the rows that Q does not have itself, or not with so small a side."""
    own: dict[bytes, float] = {}
    for normal, side in zip(*half_spaces(Q), strict=True):
        own[normal.tobytes()] = min(float(side), own.get(normal.tobytes(), np.inf))
    given = [own.get(normal.tobytes(), np.inf) <= side for normal, side in zip(normals, sides, strict=True)]
    return np.flatnonzero(~np.array(given, dtype=bool))


def _bounded_by(Q: Rows, normal: Floats, multipliers: Floats, side: float) -> bool:
    """Whether exact multipliers of the rows that float ones use prove ``a'x <= b`` all over Q."""
    bound = Q.program.exact.bound(normal, multipliers)
    return bound is not None and bool(bound[0] <= rational(side))


def _exceeds(Q: Rows, normal: Floats, side: float, status: str) -> bool:
    """Whether some point of Q has ``a'x > b``."""
    if status == UNBOUNDED and Q.program.tells_rays:
        return True
    if Q.wide and lower_supports(Q, normal[None])[0] > side:
        return True
    start = Q.program.exact_point
    outcome = None if start is None else Q.program.exact.maximum(normal, start)
    if outcome is not None and outcome.status != "limit":
        return outcome.status == "unbounded" or bool(outcome.value > rational(side))
    if Q.exact is not None:
        return support_of(Q.exact, normal) > side
    raise UndecidedError(
        f"cannot tell whether a set of {Q.b.size + Q.d.size} rows in {Q.dim} variables keeps {normal.tolist()} x <= "
        f"{side!r}: floats are too close to it, and the set is too large for rational arithmetic."
    )
