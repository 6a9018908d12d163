"""The inscribed ellipsoid of largest volume, and the enclosing one of least volume (Loewner and John 1948).

Both are unique, and go with affine maps; of a flat set they lie in its affine hull.  The inscribed one maximises
``log det B`` with ``|B a_i| <= b_i - a_i'c`` for every row (Boyd and Vandenberghe 2004, section 8.4.2), by cvxpy in
coordinates where the set is about round.  The enclosing one of the vertices is found by Khachiyan's method with away
steps (Todd and Yildirim 2007).
"""

from dataclasses import dataclass
from math import gamma, pi

import numpy as np
from numpy.typing import ArrayLike

from polytopes.affine_hull import explicit
from polytopes.checks import Floats, real_array
from polytopes.errors import EmptySetError, UnboundedError, UndecidedError
from polytopes.frame import unit_body
from polytopes.lengths import evened, lengths
from polytopes.moments import Triangulated
from polytopes.rows import Rows
from polytopes.shown import Shown
from polytopes.support import is_bounded, known_nonempty

_EPS = float(np.finfo(np.float64).eps)
_OPTIMAL = 1e-9  # relative excess of the volume at which Khachiyan's method ends
_ROUNDS = 100_000


@dataclass(frozen=True, eq=False)
class Ellipsoid(Shown):
    """``{centre + axes u : |u| <= 1}``.

    Attributes
    ----------
    centre : array (n,)
    axes : array (n, d)
        Of rank d, the dimension of the ellipsoid: below n for a flat one.
    """

    centre: Floats
    axes: Floats

    @property
    def volume(self) -> float:
        """The d-dimensional volume; 1 for a point."""
        d = self.axes.shape[1]
        return float(pi ** (d / 2) / gamma(d / 2 + 1) * np.prod(np.linalg.svd(self.axes, compute_uv=False)))

    def support(self, directions: ArrayLike) -> Floats:
        """``c'x + |axes'c|`` along directions (k, n), or (n,): array (k,)."""
        n = self.centre.size
        rows = np.atleast_2d(real_array("directions", directions, (n,), ("k", n)))
        return np.asarray(rows @ self.centre + np.linalg.norm(rows @ self.axes, axis=1))

    def surface(self, directions: ArrayLike) -> Floats:
        """The points ``centre + axes u / |u|`` for directions u (k, d), none zero: array (k, n)."""
        rows = real_array("directions", directions, ("k", self.axes.shape[1]))
        sizes = lengths(rows)[:, None]
        if rows.shape[1] and not sizes.all():
            raise ValueError(f"directions has a zero row, {int(sizes.argmin())}; expected directions.")
        return np.asarray(self.centre + rows / sizes @ self.axes.T)


def inscribed_ellipsoid(P: Rows) -> Ellipsoid:
    """The largest ellipsoid in a bounded set; its rows are kept to rounding.

    Raises
    ------
    EmptySetError, UnboundedError
        If there is none.
    UndecidedError
        If the set is too thin, or the solver did not end.
    """
    _check(P, "largest ellipsoid inside")
    flat = explicit(P)
    program = flat.program.balanced
    if not program.flat.free:
        return Ellipsoid(program.flat.point.copy(), np.empty((P.dim, 0)))
    body = unit_body(program.AT.T, program.rhs, program.centre)
    if body is None:
        raise UndecidedError("no largest ellipsoid was found: the set is too thin for floats.")
    centre, axes = _largest(body.rows, body.rhs)
    middle = program.lift(body.lift(centre))
    spread = np.array([program.lift(body.lift(centre + axis)) - middle for axis in axes.T]).T
    A, b = evened(P.A, P.b)
    reach, room = lengths(A @ spread), b - A @ middle
    crossed = reach > np.maximum(room, 0.0)
    factor = float((room[crossed] / reach[crossed]).min(initial=1.0))
    return Ellipsoid(middle, spread * max(factor, 0.0) * (1.0 - 8.0 * _EPS))


def _largest(rows: Floats, rhs: Floats) -> tuple[Floats, Floats]:
    """Centre (d,) and axes (d, d), the root of a matrix, of the largest ellipsoid in ``rows z <= rhs``."""
    import cvxpy as cp

    d = rows.shape[1]
    B, c = cp.Variable((d, d), PSD=True), cp.Variable(d)
    problem = cp.Problem(cp.Maximize(cp.log_det(B)), [cp.norm(rows @ B, axis=1) <= rhs - rows @ c])
    problem.solve(solver=cp.CLARABEL)
    if problem.status not in ("optimal", "optimal_inaccurate") or B.value is None or c.value is None:
        raise UndecidedError(f"no largest ellipsoid was found: the solver ended as {problem.status!r}.")
    return np.asarray(c.value), np.asarray(B.value)


def enclosing_ellipsoid(P: Rows) -> Ellipsoid:
    """The least ellipsoid around a bounded set; every vertex is inside to rounding, its volume least to 1e-9.

    Raises
    ------
    EmptySetError, UnboundedError
        If there is none.
    UndecidedError
        If the double description passes 10 000 rays, or rounding ends the search.
    """
    _check(P, "least ellipsoid around it")
    body = Triangulated.of(P)
    z, d = body.z, body.z.shape[1]
    if not d:
        return Ellipsoid(body.lifted(np.empty(0)), np.empty((P.dim, 0)))
    weights = _weights(z)
    centre = weights @ z
    offsets = z - centre
    root = np.linalg.cholesky((offsets * weights[:, None]).T @ offsets)
    farthest = float(np.linalg.norm(np.linalg.solve(root, offsets.T), axis=0).max())
    middle = body.lifted(centre)
    axes = np.array([body.lifted(centre + axis) - middle for axis in (root * farthest).T]).T
    return Ellipsoid(middle, axes * (1.0 + 16.0 * _EPS))


def _weights(points: Floats) -> Floats:
    """Weights (k,) of points (k, d) whose second moments are those of the least ellipsoid around them."""
    k, d = points.shape
    lifted, weights = np.hstack([points, np.ones((k, 1))]), np.full(k, 1.0 / k)
    for _ in range(_ROUNDS):
        moments = (lifted * weights[:, None]).T @ lifted
        reach = np.einsum("ij,ij->i", lifted @ np.linalg.inv(moments), lifted) / (d + 1)
        used = np.where(weights > 0.0, reach, np.inf)
        far, near = int(reach.argmax()), int(used.argmin())
        if max(reach[far] - 1.0, 1.0 - used[near]) < _OPTIMAL:
            return weights
        j = far if reach[far] - 1.0 >= 1.0 - used[near] else near
        step = (reach[j] - 1.0) / ((d + 1) * reach[j] - 1.0)
        step = max(step, -weights[j] / (1.0 - weights[j])) if weights[j] < 1.0 else step
        weights = (1.0 - step) * weights
        weights[j] = max(weights[j] + step, 0.0)
    raise UndecidedError("no least ellipsoid was found: its weights did not settle.")


def _check(P: Rows, what: str) -> None:
    if not known_nonempty(P):
        raise EmptySetError(f"the empty set has no {what}; ask is_empty() first.")
    if not is_bounded(P):
        raise UnboundedError(f"P is unbounded: there is no {what}; intersect it with a box first.")
