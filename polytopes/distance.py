"""Distances: of a point or a set from a set in the norms 1, 2 and inf, and Hausdorff's between sets."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import inf, isqrt
from typing import Self

import numpy as np

from polytopes.checks import Floats
from polytopes.errors import EmptySetError
from polytopes.exact_generators import integer_form
from polytopes.generators import generators, in_integers
from polytopes.inclusion import broken_row, has_point
from polytopes.integers import up
from polytopes.least_distance import nearest
from polytopes.outer_supports import exact_maximum_of
from polytopes.product import product
from polytopes.rows import Rows
from polytopes.separation import intersects
from polytopes.support import is_bounded, known_nonempty, maxima, support

_EPS = float(np.finfo(np.float64).eps)
NORMS = (1, 2, inf)
Ends = Callable[[Floats], tuple[Floats, Floats]]  # of a solution: the two points that it stands for


class Distance(float):
    """A distance: a float, with bounds and with the points that it is between.

    Parameters
    ----------
    value : float
        The float that it is.
    lower, upper : float
        The exact distance is between them.  In the Euclidean norm they are neighbouring floats, proved in rationals, up
        to some 100 variables and rows that are held; beyond, `upper` holds to the rounding of the points.
    point, other : array (n,) or None
        A point of this set, and the nearest one of the other set (or the point that was given); None if a set is empty.
    """

    lower: float
    upper: float
    point: Floats | None
    other: Floats | None

    def __new__(
        cls, value: float, lower: float, upper: float, point: Floats | None = None, other: Floats | None = None
    ) -> Self:
        """A float with the rest beside it."""
        made = super().__new__(cls, value)
        made.lower, made.upper, made.point, made.other = lower, upper, point, other
        return made

    def __reduce__(self) -> tuple[type[Self], tuple[float, float, float, Floats | None, Floats | None]]:
        return type(self), (float(self), self.lower, self.upper, self.point, self.other)


def closest_point(P: Rows, x: Floats) -> Floats:
    """The point of a set with the least Euclidean distance from x (n,); it is unique.

    Raises
    ------
    EmptySetError
        If P is empty.
    """
    if not known_nonempty(P):
        raise EmptySetError("the empty set has no closest point; ask is_empty() first.")
    return x.copy() if has_point(P, x) else nearest(P, np.eye(P.dim), x).point


def distance_to_point(P: Rows, x: Floats, norm: float) -> Distance:
    """``min {|y - x| : y in P}``; inf for the empty set, 0 exactly if x is in P."""
    if not known_nonempty(P):
        return Distance(inf, inf, inf)
    if has_point(P, x):
        return Distance(0.0, 0.0, 0.0, x, x)
    if norm == 2:
        return _euclidean(P, np.eye(P.dim), x, lambda y: (y, x))
    return _by_program(P, np.eye(P.dim), x, norm, lambda y: (y, x))


def distance_to_set(P: Rows, Q: Rows, norm: float) -> Distance:
    """``min {|x - y| : x in P, y in Q}``; inf if a set is empty, 0 exactly if they meet."""
    if not (known_nonempty(P) and known_nonempty(Q)):
        return Distance(inf, inf, inf)
    common = intersects(P, Q).point
    if common is not None:
        return Distance(0.0, 0.0, 0.0, common, common)
    n, both = P.dim, Rows(*product(P, Q))
    difference = np.hstack([np.eye(n), -np.eye(n)])
    if norm == 2:
        return _euclidean(both, difference, np.zeros(n), lambda y: (y[:n], y[n:]))
    return _by_program(both, difference, np.zeros(n), norm, lambda y: (y[:n], y[n:]))


def hausdorff(P: Rows, Q: Rows, norm: float) -> float:
    """``max(max_P d(x, Q), max_Q d(x, P))``, attained in vertices, distances being convex.

    Unbounded sets are at a finite distance if and only if their rays and lines are directions of both.
    """
    some = known_nonempty(P), known_nonempty(Q)
    if not all(some):
        return inf if any(some) else 0.0
    if not (_has_directions(P, Q) and _has_directions(Q, P)):
        return inf
    return max(_farthest(P, Q, norm), _farthest(Q, P, norm))


def _farthest(P: Rows, Q: Rows, norm: float) -> float:
    """The largest distance of a vertex of P from Q; 0 if P lies in Q, decided exactly."""
    if broken_row(Q, P) is None:
        return 0.0
    corners = generators(P).vertices
    if norm == 2:
        missed = [nearest(Q, np.eye(Q.dim), x, exactly=False).point - x for x in corners]
        values = np.linalg.norm(missed, axis=1)
    else:
        values = np.array([-float(support(*_program(Q, np.eye(Q.dim), x, norm))) for x in corners])
    return float(distance_to_point(Q, corners[int(values.argmax())], norm))  # floats tell which one is the farthest


def _has_directions(P: Rows, Q: Rows) -> bool:
    """Whether every ray and line of P is a direction of Q, decided in integers."""
    if is_bounded(P):
        return True
    directions, rows = in_integers(P), integer_form(Q.A, Q.b, Q.C, Q.d)
    A, C = rows.inequalities[:, :-1].astype(object), rows.equalities[:, :-1].astype(object)
    rays, lines = directions.rays.astype(object).T, directions.lines.astype(object).T
    return not ((A @ rays > 0).any() or (A @ lines != 0).any() or (C @ rays != 0).any() or (C @ lines != 0).any())


def _euclidean(P: Rows, F: Floats, g: Floats, ends: Ends) -> Distance:
    """The least ``|F y - g|_2`` over P, which is not zero."""
    found = nearest(P, F, g)
    point, other = ends(found.point)
    if found.squared is not None:
        return Distance(*_root(found.squared), point, other)
    missed = F @ found.point - g
    value = float(np.linalg.norm(missed))
    # h(-a) bounds a'(F y - g) from below, for the unit normal a along the gap
    normal = missed / value
    best = maxima(P, -(F.T @ normal)[None])
    assert best is not None
    rounding = (F.size + 8) * _EPS * (float(np.abs(found.point).max()) + float(np.abs(g).max(initial=0.0)))
    lower = max(0.0, float(-best.values[0] - normal @ g) * (1.0 - 4.0 * _EPS) - rounding)
    return Distance(value, min(lower, value), value + rounding, point, other)


def _root(squared: Fraction) -> tuple[float, float, float]:
    """The root of a positive number: a nearest float, and those not above and not below it."""
    shift = max(0, 128 - squared.numerator.bit_length() + squared.denominator.bit_length())
    shift += shift % 2
    whole = isqrt((squared.numerator << shift) // squared.denominator)
    near = float(Fraction(whole, 1 << (shift // 2)))
    lower = near if Fraction(near) ** 2 <= squared else float(np.nextafter(near, 0.0))
    upper = near if Fraction(near) ** 2 >= squared else float(np.nextafter(near, inf))
    return near, lower, upper


def _by_program(P: Rows, F: Floats, g: Floats, norm: float, ends: Ends) -> Distance:
    """The least ``|F y - g|`` over P by a linear program."""
    lifted, least = _program(P, F, g, norm)
    exact = exact_maximum_of(lifted, least)
    if exact is not None:
        maximum, at = exact
        return Distance(float(-maximum), -up(maximum), up(-maximum), *ends(at[: P.dim]))
    best = maxima(lifted, least[None])
    assert best is not None
    y = best.points[0, : P.dim]
    point, other = ends(y)
    value, lower = float(np.linalg.norm(F @ y - g, norm)), max(0.0, -float(best.values[0]))
    return Distance(value, min(lower, value), value * (1.0 + 1e-12), point, other)


def _program(P: Rows, F: Floats, g: Floats, norm: float) -> tuple[Rows, Floats]:
    """Rows in y and one bound t, or one for each entry of ``F y - g``, and the form whose maximum is the distance's."""
    k, more = len(g), 1 if norm == inf else len(g)
    sides = np.ones((k, 1)) if norm == inf else np.eye(k)
    lifted = Rows(
        np.vstack([np.hstack([P.A, np.zeros((P.b.size, more))]), np.hstack([F, -sides]), np.hstack([-F, -sides])]),
        np.concatenate([P.b, g, -g]),
        np.hstack([P.C, np.zeros((P.d.size, more))]),
        P.d,
    )
    return lifted, np.append(np.zeros(P.dim), -np.ones(more))
