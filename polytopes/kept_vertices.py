"""Vertices that are known because a set was made from them, or from a set of known ones by an invertible map.

They are kept in integers, and only where the rows are exactly those of their hull: a map whose rows had to be rounded
has a larger set, and then its vertices are found from its rows.  Nothing is computed before somebody asks.
"""

from collections.abc import Callable
from itertools import product
from typing import TypeVar

import numpy as np
from flint import fmpz_mat
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.double_description import Integers, primitive
from polytopes.exact_generators import integer_form
from polytopes.integers import integer_rows
from polytopes.minkowski_weyl import ExactGenerators, ExactRows, image, stacked
from polytopes.rows import Rows

Set = TypeVar("Set", bound=Rows)
_MOST = 4096  # vertices that are kept


def keeping(made: Set, find: Callable[[], ExactGenerators | None]) -> Set:
    """The set, which finds its vertices so when it is asked for them."""
    made.__dict__["finds_vertices"] = find
    return made


def of_points(V: Floats) -> ExactGenerators:
    """Vertices (k, n) that are floats."""
    found = of_integers(integer_rows(np.hstack([V, np.ones((len(V), 1))])))
    found.__dict__["points"] = V  # derived from the integers it would be the same
    return found


def of_integers(points: Integers) -> ExactGenerators:
    """Vertices ``[x, t]`` (k, n + 1)."""
    nothing = np.zeros((0, points.shape[1] - 1), dtype=np.int64)
    return ExactGenerators(points, nothing, nothing)


def of_box(lower: Floats, upper: Floats) -> ExactGenerators | None:
    """The corners of a box; None if it is empty, unbounded or has too many."""
    if 2**lower.size > _MOST or not (np.isfinite(lower).all() and np.isfinite(upper).all() and (lower <= upper).all()):
        return None
    ends = [sorted({low, high}) for low, high in zip(lower.tolist(), upper.tolist(), strict=True)]
    return of_points(np.array(list(product(*ends))))


def among(points: Integers, rows: ExactRows) -> ExactGenerators:
    """Those of some points (k, n + 1) that are vertices of their hull, by its rows.

    The rows that a point of a face touches are touched by the vertices of that face too, and by these alone.
    """
    homogeneous = np.hstack([points[:, :-1], -points[:, -1:]]).astype(object)
    touches = (rows.inequalities.astype(object) @ homogeneous.T == 0).astype(np.int64)
    shared = touches.T @ touches
    others = (shared == shared.diagonal()[:, None]).sum(axis=1)
    return of_integers(points[others == 1])


def moved(P: Rows, made: Set, M: Floats, t: Floats) -> Set:
    """The image ``{M x + t : x in P}``, made by rows in the order of those of P, with the images of the vertices."""

    def find() -> ExactGenerators | None:
        known = P.made_of
        if known is None or M.shape != (P.dim, P.dim) or (made.b.size, made.d.size) != (P.b.size, P.d.size):
            return None
        *whole, scale = integer_rows(np.append(np.hstack([M, t[:, None]]).ravel(), 1.0)[None])[0].tolist()
        table = np.array(whole, dtype=object).reshape(P.dim, P.dim + 1)
        if fmpz_mat(table[:, :-1].tolist()).rank() < P.dim:
            return None
        found = image(known, table[:, :-1], table[:, -1], scale)
        return found if np.array_equal(_touches(made, found), _touches(P, known)) else None

    return keeping(made, find)


def of_product(P: Rows, Q: Rows, made: Set) -> Set:
    """The product, with all pairs of vertices."""

    def find() -> ExactGenerators | None:
        first, second = P.made_of, Q.made_of
        if first is None or second is None or len(first.vertices) * len(second.vertices) > _MOST:
            return None
        pairs = [
            [*(v * y[-1] for v in x[:-1]), *(v * x[-1] for v in y[:-1]), x[-1] * y[-1]]
            for x in first.vertices.tolist()
            for y in second.vertices.tolist()
        ]
        return of_integers(primitive(np.array(pairs, dtype=object)))

    return keeping(made, find)


def _touches(P: Rows, found: ExactGenerators) -> NDArray[np.bool_]:
    """Which rows of P (m + q) each vertex keeps with equality."""
    rows, corners = integer_form(*P.table), found.vertices.astype(object)
    whole = stacked(rows.inequalities, rows.equalities).astype(object)
    return np.asarray(whole[:, :-1] @ corners[:, :-1].T == whole[:, -1:] * corners[:, -1], dtype=bool)
