"""Projection on some of the coordinates: equalities first, then one of three methods on what is left.

Equalities (implicit ones included) are solved exactly for the coordinates that go; what remains is a full-dimensional
set in fewer coordinates.  Then

- "fourier-motzkin" eliminates one coordinate after the other; the only method for unbounded sets, and the fastest where
  rows are sparse;
- "convex-hull" refines a hull of support points; the choice for dense rows, its cost goes with the facets it finds;
- "vertices" takes the hull of projected vertices; good only while the vertices can be listed (total dimension <= 6).

"auto" takes the hull of the projected generators, in integers, where rows are short or the set is flat or thin, and
they are at most 200.  Else it eliminates as long as no step forms more than 3000 rows (some 5 ms) or lets the next one
be foreseen to.  Beyond, a bounded set of at most 5 coordinates, or of 6 with a shadow in 4 or 5, goes by its vertices
(each round of the refinement is a hull in so many coordinates); any other with a bounded shadow by the hull of support
points.  Measured on sets of 4 to 8 coordinates and 30 to 80 rows, see ``docs/polytopes.md``.
"""

from collections.abc import Sequence

import numpy as np
from flint import fmpq

from polytopes.affine import AffineSet, affine_set
from polytopes.affine_hull import explicit
from polytopes.box import both_ways, box_rows
from polytopes.checks import Floats
from polytopes.errors import ProjectionLimitError, UnboundedError
from polytopes.exact import row_to_floats
from polytopes.exact_generators import few_generators
from polytopes.fourier_motzkin import eliminate
from polytopes.generators import exact_hull
from polytopes.hull import normals_around, normals_by_supports
from polytopes.minkowski_weyl import shadow
from polytopes.outer_supports import upper_supports
from polytopes.outer_template import outer_template
from polytopes.outward import float_rows
from polytopes.prepared import PreparedRows
from polytopes.rows import Rows, Table, no_equalities
from polytopes.support import known_nonempty, maxima
from polytopes.vertices import vertices

METHODS = ("auto", "fourier-motzkin", "convex-hull", "vertices")
_UNBOUNDED = "the projection is unbounded; only method='fourier-motzkin' can describe it."
_CHEAP_ROWS = 3000  # rows of one step; beyond, another method was faster in every measured case
_LISTED = 6  # coordinates up to which the vertices of dense rows are few enough to list
_FEW_CORNERS = 200  # vertices up to which their hull is taken where they are exact
_FEW = 5  # coordinates up to which listing them always was the fastest
_COSTLY_SHADOW = 4  # coordinates of a shadow from which one hull of all vertices beats several of support points


def project(
    P: Rows, keep: Sequence[int], method: str, max_rows: int, outer: bool
) -> tuple[Floats, Floats, Floats, Floats]:
    """Rows A, b, C, d of ``{x_keep : x in P}``, in the order of `keep`.

    Parameters
    ----------
    P : Rows
    keep : sequence of int
        Different coordinates.
    method : str
        One of `METHODS`.
    max_rows : int
        Limit on the rows of one step of Fourier-Motzkin elimination.
    outer : bool
        At that limit, return a superset (the template of the normals at hand) instead of raising.

    Raises
    ------
    ProjectionLimitError
        At the limit, without `outer`.
    UnboundedError
        If P is unbounded and the method needs vertices.
    """
    n, k = P.dim, len(keep)
    known = _shadow_at_once(P, list(keep)) if method == "auto" else None
    if known is not None:
        return known
    if not known_nonempty(P):
        return np.zeros((1, k)), np.array([-1.0]), np.empty((0, k)), np.empty(0)
    few = few_generators(*P.table, P.short, P.program) if method == "auto" else None
    if few is not None:
        return float_rows(shadow(few, list(keep)))
    P = explicit(P)
    if not P.d.size and P.program.kept.size == P.b.size:
        order = [*keep, *(j for j in range(n) if j not in keep)]
        body = P if order == list(range(n)) else Rows(P.A[:, order], P.b)
        A, b = _project_body(body, k, P.program.interior.point[order], method, max_rows, outer)
        return A, b, np.empty((0, k)), np.empty(0)
    gone = [j for j in range(n) if j not in keep]
    flat = affine_set(P.C, P.d, first=gone)
    C, d = _equalities_left(flat, keep)
    rows, rhs = flat.restrict_exactly(P.A, P.b)
    free = [j for j in keep if j in flat.free]
    A, b = np.zeros((0, k)), np.empty(0)
    if free and rows.any():
        order = [flat.free.index(j) for j in free] + [q for q, j in enumerate(flat.free) if j not in free]
        some = rows.any(axis=1)
        body = Rows(rows[some][:, order], rhs[some])
        inner = P.program.interior.point[flat.free][order]
        reduced, b = _project_body(body, len(free), inner, method, max_rows, outer)
        A = np.zeros((b.size, k))
        A[:, [list(keep).index(j) for j in free]] = reduced
    return A, b, C, d


def _shadow_at_once(P: Rows, keep: list[int]) -> Table | None:
    """The shadow of a box, the hull of projected vertices that are few and floats of few bits, or a shadow on a line by
    supports that floats settle; None if it is none of these.
    """
    if P.as_box is not None and P.as_box.exact:
        lower, upper = P.as_box.corners[:, keep]
        return *box_rows(lower, upper), *no_equalities(len(keep))
    if P.corners is not None and P.corners.exact and len(P.corners.points) <= _FEW_CORNERS:
        return exact_hull(P.corners.points[:, keep])
    return None if len(keep) > 1 or P.prepared is None or P.short else _ends(P.prepared, P.dim, keep[0])


def _ends(rows: PreparedRows, n: int, j: int) -> Table | None:
    """The shadow of a set of R^n on a coordinate by its supports; None if floats do not settle them."""
    values = rows.supports(both_ways(n)[j::n])
    if values is None:
        return None
    ends = values < np.inf
    return both_ways(1)[ends], values[ends], *no_equalities(1)


def _equalities_left(flat: AffineSet, keep: Sequence[int]) -> tuple[Floats, Floats]:
    """Equalities between the coordinates that stay, of a system solved for the others first."""
    fixed = [k for k, j in enumerate(flat.pivots) if j in keep]
    C, d = np.zeros((len(fixed), flat.dim)), np.zeros(len(fixed))
    for row, k in enumerate(fixed):
        solved = [flat.solved[k, q] for q in range(len(flat.free) + 1)]
        entries = row_to_floats([fmpq(1), *solved[:-1]], solved[-1])
        C[row, [flat.pivots[k], *flat.free]], d[row] = entries[:-1], entries[-1]
    return C[:, list(keep)], d


def _project_body(P: Rows, k: int, inner: Floats, method: str, max_rows: int, outer: bool) -> tuple[Floats, Floats]:
    """The same for a full-dimensional set of inequalities and its first k coordinates."""
    if method == "auto":
        return _project_automatically(P, k, inner, max_rows, outer)
    if method == "vertices":
        normals = normals_around(np.ascontiguousarray(vertices(P)[:, :k]))
        return normals, upper_supports(P, _lifted(normals, P.dim))
    if method == "convex-hull":
        normals = normals_by_supports(lambda directions: _shadow_points(P, directions), inner[:k])
        bounds = upper_supports(P, _lifted(normals, P.dim))
        if not np.isfinite(bounds).all():
            raise UnboundedError(_UNBOUNDED)
        return normals, bounds
    try:
        return eliminate(P.A, P.b, list(range(k, P.dim)), inner, max_rows)
    except ProjectionLimitError:
        if not outer:
            raise
        return _template(P, k)


def _project_automatically(P: Rows, k: int, inner: Floats, max_rows: int, outer: bool) -> tuple[Floats, Floats]:
    """Fourier-Motzkin as long as it stays cheap; then one of the hulls, if there is one."""
    try:
        return eliminate(P.A, P.b, list(range(k, P.dim)), inner, min(max_rows, _CHEAP_ROWS), cautious=True)
    except ProjectionLimitError:
        return _project_body(P, k, inner, _method_for_dense_rows(P, k), max_rows, outer)


def _method_for_dense_rows(P: Rows, k: int) -> str:
    axes = np.eye(P.dim)
    result = maxima(P, np.vstack([axes[:k], -axes[:k], axes[k:], -axes[k:]]))
    assert result is not None  # the set is full-dimensional
    finite = np.isfinite(result.values)
    if not finite[: 2 * k].all():
        return "fourier-motzkin"
    listed = P.dim <= _FEW or (P.dim <= _LISTED and k >= _COSTLY_SHADOW)
    return "vertices" if finite.all() and listed else "convex-hull"


def _shadow_points(P: Rows, directions: Floats) -> Floats:
    """Projected support points along directions (m, k) of the shadow."""
    k = directions.shape[1]
    result = maxima(P, _lifted(directions, P.dim))
    if result is None or not np.isfinite(result.values).all():
        raise UnboundedError(_UNBOUNDED)
    return result.points[:, :k]


def _lifted(directions: Floats, n: int) -> Floats:
    """Directions (m, k) of the shadow in the n coordinates of the set."""
    return np.hstack([directions, np.zeros((len(directions), n - directions.shape[1]))])


def _template(P: Rows, k: int) -> tuple[Floats, Floats]:
    """A superset of the shadow: its supports along the parts of the rows, and along the axes."""
    normals = np.vstack([P.A[:, :k], np.eye(k), -np.eye(k)])
    normals = np.unique(normals[normals.any(axis=1)], axis=0)
    T, h = outer_template(P, np.hstack([normals, np.zeros((len(normals), P.dim - k))]))
    return T[:, :k], h
