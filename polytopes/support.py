"""Support function, support points and what follows from them: bounding box, boundedness, largest ball.

The support function of P is ``h_P(c) = max {c'x : x in P}``: +inf where P is unbounded along c, -inf if P is empty.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from polytopes.box import both_ways
from polytopes.checks import Floats, real_array
from polytopes.duality import equality_multipliers
from polytopes.errors import EmptySetError, UndecidedError
from polytopes.lengths import evened, lengths
from polytopes.linear_program import UNDECIDED, Maxima
from polytopes.rows import Rows
from polytopes.shown import Shown


@dataclass(frozen=True, eq=False)
class SupportResult(Shown):
    """Support in k directions.

    Attributes
    ----------
    values : array (k,)
        +inf where unbounded, -inf if the set is empty.
    points : array (k, n)
        A maximiser per direction (a vertex, if the set has one); NaN where there is none.
    multipliers : array (k, m)
        Nonnegative multipliers of the rows of A; with `equality_multipliers` they combine the rows to
        ``c'x <= value`` (weak duality), up to rounding.
    equality_multipliers : array (k, q)
    """

    values: Floats
    points: Floats
    multipliers: Floats
    equality_multipliers: Floats


@dataclass(frozen=True, eq=False)
class Ball(Shown):
    """A largest ball inside a set: centre (n,) and radius; the radius is inf if it can grow without end.

    The ball lies in the affine set of the explicit equalities.
    """

    centre: Floats
    radius: float


def known_nonempty(P: Rows) -> bool:
    """Whether P has a point.

    Raises
    ------
    UndecidedError
        If that could not be decided.
    """
    if P.as_box is not None or P.prepared is not None or P.program.fat:
        return True
    if P.decided.status == "undecided":
        raise UndecidedError(f"cannot tell whether the set is empty: {P.decided.reason}")
    return P.decided.status == "nonempty"


def maxima(P: Rows, directions: Floats) -> Maxima | None:
    """Maxima of the linear forms over P; None if P is empty.  UndecidedError if one could not be found."""
    if not known_nonempty(P):
        return None
    settled = None if P.prepared is None else P.prepared.maxima(directions)
    if settled is not None:
        return settled
    result = P.program.maximise(directions)
    if UNDECIDED in result.status:
        k = result.status.index(UNDECIDED)
        raise UndecidedError(f"no solver settled the support in direction {k}: {directions[k].tolist()}")
    return result


def support(P: Rows, directions: ArrayLike) -> float | Floats:
    """``h_P(c)`` for one direction (n,) or a batch (k, n): a float or an array (k,)."""
    array = real_array("directions", directions, (P.dim,), ("k", P.dim))
    return supports(P, array[None]).item() if array.ndim == 1 else supports(P, array)


def supports(P: Rows, directions: Floats) -> Floats:
    """``h_P(c)`` (k,) along directions (k, n), rounded up; -inf if P is empty."""
    values = supports_at_once(P, directions)
    if values is None:
        result = maxima(P, directions)
        values = np.full(len(directions), -np.inf) if result is None else result.values
    return values


def supports_at_once(P: Rows, directions: Floats) -> Floats | None:
    """The same by one call of the core, where P is a box or settled by floats; None if it is not."""
    values = None if P.as_box is None else P.as_box.supports(directions)
    return P.prepared.supports(directions) if values is None and P.prepared is not None else values


def support_points(P: Rows, directions: ArrayLike) -> SupportResult:
    """Values, points and multipliers for one direction (n,) or a batch (k, n)."""
    batch = np.atleast_2d(real_array("directions", directions, (P.dim,), ("k", P.dim)))
    result = maxima(P, batch)
    k, q = len(batch), P.d.size
    if result is None:
        nowhere = np.full((k, P.dim), np.nan)
        return SupportResult(np.full(k, -np.inf), nowhere, np.zeros((k, P.b.size)), np.zeros((k, q)))
    known = None if P.as_box is None else P.as_box.supports(batch)
    values = result.values if known is None else known
    finite = np.isfinite(values)
    points = np.where(finite[:, None], result.points, np.nan)
    multipliers = np.where(finite[:, None], result.multipliers, 0.0)
    fixed = np.zeros((k, q))
    fixed[finite] = equality_multipliers(P.C, P.d, batch[finite] - multipliers[finite] @ P.A)
    return SupportResult(values, points, multipliers, fixed)


def bounding_box(P: Rows) -> tuple[Floats, Floats]:
    """Smallest box that contains P: lower (n,) and upper (n,), infinite where P is unbounded.

    Raises
    ------
    EmptySetError
        If P is empty.
    """
    if P.as_box is not None:
        lower, upper = P.as_box.corners.copy()
        return lower, upper
    values = supports(P, both_ways(P.dim))
    if values[0] == -np.inf:
        raise EmptySetError("the empty set has no bounding box; ask emptiness() first.")
    return 0.0 - values[P.dim :], values[: P.dim] + 0.0  # no negative zeros


def is_bounded(P: Rows) -> bool:
    """Whether P lies in a ball (the empty set does): its support along the 2 n axes is finite."""
    if P.as_box is not None:
        return P.as_box.bounded
    return bool((supports(P, both_ways(P.dim)) < np.inf).all())


def chebyshev(P: Rows) -> Ball:
    """A largest ball ``{x : |x - centre| <= radius}`` inside P, within the affine set of the equalities.

    Raises
    ------
    EmptySetError
        If P is empty.
    UndecidedError
        If no solver settled it.
    """
    if not known_nonempty(P):
        raise EmptySetError("the empty set has no largest ball; ask emptiness() first.")
    ball = None if P.prepared is None else P.prepared.ball()
    if ball is not None:
        return Ball(*ball)
    flat = P.program.flat
    if not flat.free:
        return Ball(flat.point.copy(), 0.0)
    along = np.linalg.qr(flat.basis / np.linalg.norm(flat.basis, axis=0))[0] if flat.pivots else np.eye(P.dim)
    A, b = evened(P.A, P.b)
    norms = lengths(A @ along) * flat.restrict(P.A, P.b)[0].any(axis=1)
    radius = np.append(np.zeros(P.dim), 1.0)
    lifted = Rows(
        np.vstack([np.hstack([A, norms[:, None]]), -radius]),
        np.append(b, 0.0),
        np.hstack([P.C, np.zeros((P.d.size, 1))]),
        P.d,
    )
    best = maxima(lifted, radius[None])
    assert best is not None  # P has a point, and r = 0 fits there
    if np.isinf(best.values[0]):
        return Ball(P.program.interior.point.copy(), np.inf)
    return Ball(best.points[0, : P.dim], max(float(best.points[0, P.dim]), 0.0))
