"""Upper bounds of the support function that no rounding undercuts, also of sets or directions known up to an error.

For x in ``{A x <= b, C x = d}`` and multipliers y >= 0 and z, weak duality says ``c'x <= y'b + z'd + r'|x|`` with
``r = |c - A'y - C'z|``.  Multipliers of float programs leave an r of some rounding errors, so a bound of |x| makes it a
bound of ``c'x``; along the axes it bounds |x| itself.
"""

import math
from fractions import Fraction

import numpy as np

from polytopes.checks import Floats
from polytopes.duality import equality_multipliers
from polytopes.errors import UndecidedError
from polytopes.exact import to_floats
from polytopes.generators import in_integers
from polytopes.integers import up
from polytopes.linear_program import Maxima
from polytopes.outward_normals import support_of
from polytopes.rows import Rows
from polytopes.support import known_nonempty, maxima, supports_at_once

_EPS = float(np.finfo(np.float64).eps)
_TINY = float(np.finfo(np.float64).tiny)


def upper_supports(P: Rows, directions: Floats, uncertain: Floats | None = None) -> Floats:
    """Upper bounds (k,) of the supports of a nonempty set along directions (k, n); +inf where it is unbounded.

    Parameters
    ----------
    P : Rows
    directions : array (k, n)
    uncertain : array (k, n), optional
        Each entry of the directions may be off by so much (bounded sets only).

    Raises
    ------
    UndecidedError
        If a support could not be found.
    """
    of_floats = uncertain is None and (P.as_box is not None or not P.short)
    at_once = supports_at_once(P, directions) if of_floats else None
    if at_once is not None and (P.as_box is not None or np.isfinite(at_once).all()):
        return at_once
    if uncertain is None and P.exact is not None:
        return np.array([up(support_of(P.exact, row)) for row in directions])
    best = maxima(P, directions)
    assert best is not None
    if uncertain is None:
        return best.values
    most = reach(P)
    if most is None:
        raise UndecidedError("no bound of the points of the set was proved.")
    known = ~(directions.any(axis=1) | uncertain.any(axis=1))  # of zero the support is zero
    return np.where(known, 0.0, np.nextafter(best.values + (1.0 + (P.dim + 4) * _EPS) * (uncertain @ most), np.inf))


def lower_supports(P: Rows, directions: Floats) -> Floats:
    """Lower bounds (k,) of the supports of a wide set along directions (k, n), a little below them.

    A point that floats found best breaks rows by rounding; drawn towards the centre of a largest ball, it breaks none.
    """
    best = maxima(P, directions)
    assert best is not None
    with np.errstate(over="ignore", invalid="ignore"):  # beyond floats: no bound
        lower = _drawn_inward(P, directions, best.points)
    return np.where(np.isfinite(lower), lower, -np.inf)


def _drawn_inward(P: Rows, directions: Floats, points: Floats) -> Floats:
    """Values (k,) at points (k, n) drawn towards the centre of a largest ball, less their rounding."""
    centre, unit = P.program.interior.point, (P.dim + 3) * _EPS
    rounding = unit * (np.abs(points) @ np.abs(P.A.T) + np.abs(P.b))
    broken = np.maximum(points @ P.A.T - P.b, 0.0) + rounding
    room = np.maximum(P.b - P.A @ centre - unit * (np.abs(P.A) @ np.abs(centre) + np.abs(P.b)), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        back = np.where(P.A.any(axis=1), broken / (broken + room), 0.0).max(axis=1, initial=0.0)
    values, sizes = (directions * points).sum(axis=1), (np.abs(directions) * np.abs(points)).sum(axis=1)
    drawn = values - back * np.maximum(values - directions @ centre, 0.0)
    return np.asarray(drawn - 3.0 * unit * (np.abs(directions) @ np.abs(centre) + sizes))


def reach(P: Rows, moved: Floats | None = None) -> Floats | None:
    """Bounds (n,) of |x| over a nonempty set; None if none is proved.

    Parameters
    ----------
    P : Rows
    moved : array (m + q, n + 1), optional
        Each entry of the rows ``[A, b]`` and ``[C, d]`` may be off by so much.
    """
    axes = np.vstack([np.eye(P.dim), -np.eye(P.dim)])
    best = maxima(P, axes)
    return None if best is None else _proved_reach(best.values, *_duality(P, axes, best, moved))


def _duality(P: Rows, rows: Floats, best: Maxima, moved: Floats | None) -> tuple[Floats, Floats]:
    """Constants (k,) and weights (k, n) with ``c'x <= constant + weights'|x|`` all over P; rounding is in them."""
    Y = np.where(np.isfinite(best.values)[:, None], np.maximum(best.multipliers, 0.0), 0.0)
    Z = equality_multipliers(P.C, P.d, rows - Y @ P.A)
    unit = (np.count_nonzero(Y, axis=1).max() + P.d.size + P.dim + 4) * _EPS
    sizes = np.abs(np.hstack([np.vstack([P.A, P.C]), np.append(P.b, P.d)[:, None]]))
    spread = np.hstack([Y, np.abs(Z)]) @ (unit * sizes + (0.0 if moved is None else moved))
    constant = Y @ P.b + Z @ P.d + spread[:, -1]
    return constant, np.abs(rows - Y @ P.A - Z @ P.C) + spread[:, :-1] + unit * np.abs(rows)


def _proved_reach(values: Floats, constant: Floats, weights: Floats) -> Floats | None:
    """Bounds (n,) of |x| from those along the axes (2 n of them): a guess that no point can lie on the border of.

    The set is convex and has a point inside, so that none lies beyond either.
    """
    if not np.isfinite(values).all():
        return None
    sizes = np.abs(values).reshape(2, -1).max(axis=0)
    guess = 2.0 * sizes + _TINY
    for _ in range(4):
        ends = (constant + weights @ guess).reshape(2, -1).max(axis=0)
        ends += 4.0 * _EPS * np.abs(ends)
        if (ends < guess).all():
            return np.asarray(ends)
        guess = 10.0 * np.maximum(guess, ends)
    return None


def exact_supports(P: Rows, directions: Floats) -> list[Fraction] | None:
    """Exact supports of a nonempty set along directions in which it is bounded; None if that costs too much."""
    exact = P.exact
    found = [_maximum(P, row) if exact is None else support_of(exact, row) for row in directions]
    fractions = [value for value in found if isinstance(value, Fraction)]
    return fractions if len(fractions) == len(directions) else None


def _maximum(P: Rows, direction: Floats) -> Fraction | None:
    found = exact_maximum_of(P, direction)
    return None if found is None else found[0]


def exact_maximum_of(P: Rows, direction: Floats) -> tuple[Fraction, Floats] | None:
    """The exact maximum of a linear form over a nonempty set, and where; None if the rational simplex does not end."""
    start = P.program.exact_point
    if start is None:
        return None
    outcome = P.program.exact.maximum(direction, start)
    if outcome.status != "optimal":
        return None
    return Fraction(int(outcome.value.p), int(outcome.value.q)), to_floats(outcome.point)


def exact_support(P: Rows, direction: Floats) -> Fraction | float:
    """The exact support of any set along a direction: inf where it is unbounded, -inf if it is empty.

    Raises
    ------
    UndecidedError
        If P is too large for rational arithmetic.
    """
    if not known_nonempty(P):
        return -math.inf
    if P.made_of is not None:
        return support_of(P.made_of, direction)
    if P.exact is None and P.program.exact_point is not None:
        outcome = P.program.exact.maximum(direction, P.program.exact_point)
        if outcome.status == "optimal":
            return Fraction(int(outcome.value.p), int(outcome.value.q))
        if outcome.status == "unbounded":
            return math.inf
    return support_of(in_integers(P), direction)
