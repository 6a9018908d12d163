"""Points and sets inside a set, and equality of sets, with a stated tolerance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polytopes.answers import Answer
from polytopes.checks import Floats
from polytopes.errors import UndecidedError
from polytopes.inclusion import half_spaces
from polytopes.integers import up
from polytopes.lengths import evened, lengths
from polytopes.outer_supports import exact_support
from polytopes.rows import Rows
from polytopes.support import known_nonempty, support_points, supports_at_once

_DOUBTFUL = 1e-6  # of its terms: what a row is broken by that may be the error of a support


@dataclass(frozen=True, eq=False)
class Containment(Answer):
    """Whether a set lies in another; true or false in an ``if``.

    Attributes
    ----------
    holds : bool
    counterexample : array (n,) or None
        Where it does not hold: a point of the inner set beyond the row, the farthest one if there is one.
    row : int or None
        The row that it breaks: row i of A, or row i - m of C.
    excess : float
        How far the inner set reaches beyond that row, a distance in the units of x; 0 where it holds, inf where the
        set is unbounded along the normal.
    """

    counterexample: Floats | None = None
    row: int | None = None
    excess: float = 0.0


def contains_points(P: Rows, points: Floats, tol: float) -> NDArray[np.bool_]:
    """For each point (k, n): is it within `tol` of every half-space and hyperplane of P (Euclidean distance)?"""
    (A, b, lengths), (C, d, fixed) = P.even_inequalities, P.even_equalities
    inside = (points @ A.T - b <= tol * lengths).all(axis=1)
    on = (np.abs(points @ C.T - d) <= tol * fixed).all(axis=1)
    return np.asarray(inside & on, dtype=bool)


def contains_set(P: Rows, Q: Rows, tol: float) -> Containment:
    """Whether every point of Q is within `tol` of every half-space and hyperplane of P.

    That is ``h_Q(a_i) <= b_i + tol |a_i|`` for every row of P (both signs for an equality); the empty set lies in any.
    """
    if not known_nonempty(Q):
        return Containment(True)
    if _surely_within(P, Q):
        return Containment(True)
    normals, sides = evened(*half_spaces(P))
    sizes = lengths(normals)
    values = _supports(Q, normals)
    beyond = values - sides
    doubtful = ~(beyond <= tol * sizes) & (beyond <= _DOUBTFUL * (np.abs(values) + np.abs(sides)))
    for k in np.flatnonzero(doubtful).tolist():
        beyond[k] = _settled(Q, normals[k], values[k]) - sides[k]
    broken = ~(beyond <= tol * sizes)
    if not broken.any():
        return Containment(True)
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = np.where(broken, np.where(np.isnan(beyond), np.inf, beyond) / sizes, -np.inf)
    i = int(np.argmax(excess))
    row = i if i < P.b.size + P.d.size else i - P.d.size
    return Containment(False, _beyond(Q, normals[i], float(sides[i]), tol), row, float(excess[i]))


def _surely_within(P: Rows, Q: Rows) -> bool:
    """Whether upper bounds of the supports of Q prove, without a tolerance, that it lies in P."""
    if P.d.size:
        return False
    values = supports_at_once(Q, P.A)
    return values is not None and bool((values <= P.b).all())


def _supports(Q: Rows, normals: Floats) -> Floats:
    """Supports of a nonempty set as floats see them: along what is no ray but for rounding they are finite."""
    values = None if Q.prepared is None else Q.prepared.supports(normals)
    return values if values is not None and (values < np.inf).all() else Q.program.estimate(normals)


def _settled(Q: Rows, normal: Floats, value: float) -> float:
    """A support that is found too large where rows nearly repeat: the exact one, if it is smaller and can be had."""
    try:
        return min(float(value), up(exact_support(Q, normal)))
    except UndecidedError:
        return float(value)


def _beyond(Q: Rows, normal: Floats, side: float, tol: float) -> Floats | None:
    """A point of Q beyond a row: the farthest, or, where there is none, one as far beyond as Q is from the origin."""
    best = support_points(Q, normal)
    if np.isfinite(best.values[0]):
        return best.points[0]
    near = Q.program.interior.point
    room = float(np.linalg.norm(normal)) * (2.0 * tol + float(np.linalg.norm(near)) + 1.0)
    far = max(side, float(normal @ near)) + room
    return Q.with_rows(np.vstack([Q.A, -normal]), np.append(Q.b, -far)).decided.witness


def equal_sets(P: Rows, Q: Rows, tol: float) -> bool:
    """Whether each set contains the other within `tol`."""
    return bool(contains_set(P, Q, tol)) and bool(contains_set(Q, P, tol))
