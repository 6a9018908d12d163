"""Sums, differences, images and unions, each written as rows in more coordinates and projected back.

Every function returns rows A, b, C, d.  The lifted systems are exact copies of the rows; equalities between the old and
the new coordinates are solved exactly by the projection.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from polytopes.affine_hull import dimension_of_sum, dimension_of_union
from polytopes.errors import ProjectionLimitError
from polytopes.exact import ZERO, rational, rational_vector, row_to_floats
from polytopes.exact_simplex import affordable, exact_feasibility, exact_maximum
from polytopes.hull import rows_of_points
from polytopes.linear_program import Program
from polytopes.projection import project
from polytopes.rows import Rows
from polytopes.support import is_bounded, known_nonempty, maxima
from polytopes.vertices import vertices

Floats = NDArray[np.float64]
Table = tuple[Floats, Floats, Floats, Floats]
_DIRECT = 1e8  # condition number up to which an image is formed with the inverse of the map
_CONSTANT = 1e-12  # relative variation of a linear form over a set that counts as none
_ROUNDED = 1e-9  # radius of a largest ball, relative to the size of b, from which rounding makes no difference
_MAX_ROWS = 20_000
_CHEAP_ROWS = 1000


def nothing(n: int) -> Table:
    """Rows of the empty set, ``0'x <= -1``."""
    return np.zeros((1, n)), np.array([-1.0]), np.empty((0, n)), np.empty(0)


def everything(n: int) -> Table:
    """Rows of the whole space: none."""
    return np.empty((0, n)), np.empty(0), np.empty((0, n)), np.empty(0)


def product(P: Rows, Q: Rows) -> Table:
    """``{(x, y) : x in P, y in Q}``."""
    A = np.vstack([np.hstack([P.A, np.zeros((P.b.size, Q.dim))]), np.hstack([np.zeros((Q.b.size, P.dim)), Q.A])])
    C = np.vstack([np.hstack([P.C, np.zeros((P.d.size, Q.dim))]), np.hstack([np.zeros((Q.d.size, P.dim)), Q.C])])
    return A, np.concatenate([P.b, Q.b]), C, np.concatenate([P.d, Q.d])


def affine_image(P: Rows, M: Floats, t: Floats) -> Table:
    """``{M x + t : x in P}`` for any matrix M (p, n).

    A well-conditioned square map of a set with a ball inside is inverted; otherwise ``z = M x + t`` is added as
    equalities and x projected out, so that rounding neither empties a flat set nor makes it thick.
    """
    p, n = M.shape
    if p == n and P.d.size == 0 and P.program.fat and np.linalg.cond(M) < _DIRECT:
        A = np.asarray(np.linalg.solve(M.T, P.A.T).T, dtype=np.float64)
        return A, P.b + A @ t, np.empty((0, n)), np.empty(0)
    lifted = Rows(
        np.hstack([np.zeros((P.b.size, p)), P.A]),
        P.b,
        np.vstack([np.hstack([np.eye(p), -M]), np.hstack([np.zeros((P.d.size, p)), P.C])]),
        np.concatenate([t, P.d]),
    )
    return project(lifted, range(p), "auto", _MAX_ROWS, False)


def minkowski_sum(P: Rows, Q: Rows) -> Table:
    """``{x + y : x in P, y in Q}``.

    Elimination of y from ``{(z, y) : z - y in P, y in Q}`` while that is cheap, then the hull of all sums of vertices
    (half the time of the hull of support points where both were measured), if the sets are bounded.
    """
    n = P.dim
    lifted = Rows(
        np.vstack([np.hstack([P.A, -P.A]), np.hstack([np.zeros((Q.b.size, n)), Q.A])]),
        np.concatenate([P.b, Q.b]),
        np.vstack([np.hstack([P.C, -P.C]), np.hstack([np.zeros((Q.d.size, n)), Q.C])]),
        np.concatenate([P.d, Q.d]),
    )
    try:
        return project(lifted, range(n), "fourier-motzkin", _CHEAP_ROWS, False)
    except ProjectionLimitError:
        if is_bounded(P) and is_bounded(Q):
            sums = vertices(P)[:, None, :] + vertices(Q)
            return rows_of_points(sums.reshape(-1, n), lambda: dimension_of_sum(P, Q))
        return project(lifted, range(n), "fourier-motzkin", _MAX_ROWS, False)


def pontryagin_difference(P: Rows, Q: Rows) -> Table:
    """``{x : x + y in P for all y in Q}``: each row moves inward by the support of Q.

    An equality ``c'x = d`` of P survives only if ``c'y`` is constant over Q (to 1e-12 of its size); else nothing is
    left.  Where rounding could empty what is flat, or the reverse, the supports are exact.
    """
    k = P.b.size
    result = maxima(Q, np.vstack([P.A, P.C, -P.C]))
    if result is None:
        return everything(P.dim)
    if not np.isfinite(result.values).all():
        return nothing(P.dim)
    upper, lower = result.values[k : k + P.d.size], -result.values[k + P.d.size :]
    if (upper - lower > _CONSTANT * np.maximum(1.0, np.abs(upper))).any():
        return nothing(P.dim)
    moved = P.A, P.b - result.values[:k], P.C.copy(), P.d - (upper + lower) / 2.0
    if _clear(Rows(*moved).program, P.program.size):
        return moved
    return _moved_exactly(P, Q) or moved


def _clear(program: Program, size: float) -> bool:
    """Whether rounding of right-hand sides that were differences of numbers of a size changes nothing of the set."""
    nearest = abs(program.interior.radius) if program.consistent else 0.0
    return nearest > _ROUNDED * max(program.size, size)


def _moved_exactly(P: Rows, Q: Rows) -> Table | None:
    """The rows of P moved inward by the exact supports of Q, up to positive factors; None if that costs too much."""
    start = exact_feasibility(Q.A, Q.b, Q.program.flat, Q.program.interior.point) if affordable(*Q.A.shape) else None
    if start is None or start.status != "reached":
        return None
    k, m = P.b.size, P.d.size
    found = [exact_maximum(Q.A, Q.b, Q.program.flat, row, start.point) for row in np.vstack([P.A, P.C, -P.C])]
    if any(best.status != "optimal" for best in found):
        return None
    above, upper, lower = found[:k], found[k : k + m], found[k + m :]
    sides = [best.value for best in above] + [(u.value - v.value) / 2 for u, v in zip(upper, lower, strict=True)]
    rows, constants = np.vstack([P.A, P.C]), np.concatenate([P.b, P.d])
    table = np.empty((k + m, P.dim + 1))
    for i, side in enumerate(sides):
        table[i] = row_to_floats([*rational_vector(rows[i]), rational(constants[i]) - side], ZERO)[:-1]
    return table[:k, :-1], table[:k, -1], table[k:, :-1], table[k:, -1]


def hull_of_union(sets: Sequence[Rows]) -> Table:
    """Closed convex hull of the union.

    Bounded sets: the hull of all their vertices.  Otherwise the lifted form of Balas, projected: with
    ``A_i x_i <= l_i b_i``, ``l_i >= 0``, ``sum l_i = 1``, the hull is ``{sum x_i}``.
    """
    n = sets[0].dim
    some = [P for P in sets if known_nonempty(P)]
    if not some:
        return nothing(n)
    if len(some) == 1:
        return some[0].A.copy(), some[0].b.copy(), some[0].C.copy(), some[0].d.copy()
    if all(is_bounded(P) for P in some):
        return rows_of_points(np.vstack([vertices(P) for P in some]), lambda: dimension_of_union(some))
    return project(_balas(some), range(n), "auto", _MAX_ROWS, False)


def _balas(sets: list[Rows]) -> Rows:
    """Lifted rows over (z, x_1, ..., x_k, l_1, ..., l_k)."""
    n, k = sets[0].dim, len(sets)
    width = n + k * n + k
    inequalities: list[Floats] = []
    equalities: list[Floats] = []
    for i, P in enumerate(sets):
        part, weight = slice(n + i * n, n + (i + 1) * n), n + k * n + i
        for table, rows, rhs in ((inequalities, P.A, P.b), (equalities, P.C, P.d)):
            block = np.zeros((rhs.size, width))
            block[:, part], block[:, weight] = rows, -rhs
            table.append(block)
    weights = np.hstack([np.zeros((k, width - k)), np.eye(k)])
    total = np.hstack([np.eye(n), *[-np.eye(n)] * k, np.zeros((n, k))])
    A = np.vstack([*inequalities, -weights])
    C = np.vstack([*equalities, total, weights.sum(axis=0)])
    d = np.zeros(len(C))
    d[-1] = 1.0
    return Rows(A, np.zeros(len(A)), C, d)
