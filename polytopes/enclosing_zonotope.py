"""Zonotopes ``{c + G xi : |xi| <= 1}`` around a polytope, with the generators of a template scaled as little as goes.

With as many generators as coordinates the zonotope is a parallelotope, the smallest one along them: supports of all
``(x, y)`` with ``x = G y``.  With more, the sum of their lengths is least so that each vertex v has a xi with
``v = c + G xi`` (Guibas, Nguyen and Zhang 2003, section 8.2), a linear program.  The principal axes are those of the
vertices (Stursberg and Krogh 2003).  What was rounded on the way is found in rationals, and held by a small generator
along each coordinate that it reaches.
"""

from fractions import Fraction

import numpy as np

from polytopes.checks import Floats
from polytopes.errors import EmptySetError, UnboundedError, UndecidedError
from polytopes.generators import exact_vertices
from polytopes.integers import up
from polytopes.rows import Rows
from polytopes.support import bounding_box, is_bounded, known_nonempty, support
from polytopes.vertices import vertices


def enclosing_zonotope(P: Rows, template: Floats) -> tuple[Floats, Floats]:
    """Centre (n,) and generators (n, g) around a bounded set, along the columns of a template of rank n.

    Raises
    ------
    EmptySetError, UnboundedError
        If there is none.
    UndecidedError
        If there are too many vertices for rationals, with more generators than coordinates, or no solution.
    """
    if not known_nonempty(P):
        raise EmptySetError("the empty set has no zonotope around it; ask is_empty() first.")
    if not is_bounded(P):
        raise UnboundedError("P is unbounded, and zonotopes are not; intersect it with a box first.")
    square = template.shape[0] == template.shape[1]
    centre, generators, missed = _parallelotope(P, template) if square else _of_vertices(P, template)
    extra = np.diag(missed)[:, missed > 0.0]
    return centre, np.hstack([generators[:, generators.any(axis=0)], extra])


def principal_axes(P: Rows) -> Floats:
    """Orthonormal axes (n, n) of the vertices of a bounded set, as columns; those of the coordinates for one."""
    points = vertices(P) if known_nonempty(P) and is_bounded(P) else np.empty((0, P.dim))
    if len(points) < 2:
        return np.eye(P.dim)
    middle = 0.5 * points.max(axis=0) + 0.5 * points.min(axis=0)
    offsets = points - middle
    size = float(np.abs(offsets).max())
    offsets = np.ldexp(offsets, -int(np.frexp(size)[1]))
    return np.asarray(np.linalg.eigh(offsets.T @ offsets)[1])


def _parallelotope(P: Rows, G: Floats) -> tuple[Floats, Floats, Floats]:
    """Centre, generators, and how far a point may lie beyond them along each coordinate (n,)."""
    n = P.dim
    lower, upper = bounding_box(P) if np.array_equal(G, np.eye(n)) else _ends_along(P, G)
    middle = 0.5 * lower + 0.5 * upper
    halves = np.array([_half(*ends) for ends in zip(lower.tolist(), middle.tolist(), upper.tolist(), strict=True)])
    centre, generators = G @ middle, G * halves
    missed = [abs(_exact(row, middle) - Fraction(c)) for row, c in zip(G, centre.tolist(), strict=True)]
    for i in range(n):
        missed[i] += sum(abs(_exact(G[i, [j]], halves[[j]]) - Fraction(generators[i, j])) for j in range(n))
    return centre, generators, np.array([up(v) for v in missed])


def _ends_along(P: Rows, G: Floats) -> tuple[Floats, Floats]:
    """The least box around ``{y : G y in P}``, outward."""
    n = P.dim
    both = Rows(
        np.hstack([P.A, np.zeros((P.b.size, n))]),
        P.b,
        np.vstack([np.hstack([P.C, np.zeros((P.d.size, n))]), np.hstack([-np.eye(n), G])]),
        np.append(P.d, np.zeros(n)),
    )
    axes = np.hstack([np.zeros((n, n)), np.eye(n)])
    ends = np.atleast_1d(support(both, np.vstack([axes, -axes])))
    return -ends[n:], ends[:n]


def _half(lower: float, middle: float, upper: float) -> float:
    return up(max(Fraction(upper) - Fraction(middle), Fraction(middle) - Fraction(lower)))


def _of_vertices(P: Rows, G: Floats) -> tuple[Floats, Floats, Floats]:
    """The same, by the vertices."""
    corners = exact_vertices(P)
    V = np.array([[float(v) for v in corner] for corner in corners])
    lower, upper = bounding_box(P)
    size = np.ldexp(1.0, np.frexp(np.where(upper > lower, upper - lower, 1.0))[1])
    lengths = np.linalg.norm(G / size[:, None], axis=0)
    template = G / size[:, None] / lengths
    middle, xi = _least_lengths((V - lower) / size, template)
    missed = (V - lower) / size - middle - xi @ template.T
    xi = xi + missed @ np.linalg.pinv(template).T
    sizes = np.abs(xi).max(axis=0)
    centre, generators = lower + size * middle, G * (sizes / lengths)
    xi = xi / np.where(sizes > 0.0, sizes, 1.0)
    beyond = [
        [
            abs(v - Fraction(c) - _exact(row, weights))
            for v, c, row in zip(corner, centre.tolist(), generators, strict=True)
        ]
        for corner, weights in zip(corners, np.clip(xi, -1.0, 1.0), strict=True)
    ]
    return centre, generators, np.array([up(max(values)) for values in zip(*beyond, strict=True)])


def _least_lengths(V: Floats, G: Floats) -> tuple[Floats, Floats]:
    """The centre (n,) and the weights (k, g) of points V (k, n) by unit generators with ``sum_j max |xi_j|`` least."""
    import scipy.sparse as sparse
    from scipy.optimize import linprog

    (k, n), g = V.shape, G.shape[1]
    each = sparse.identity(k)
    equal = sparse.hstack([np.tile(np.eye(n), (k, 1)), np.zeros((k * n, g)), sparse.kron(each, G)])
    within = [
        sparse.hstack([np.zeros((k * g, n)), np.tile(-np.eye(g), (k, 1)), sign * sparse.identity(k * g)])
        for sign in (1.0, -1.0)
    ]
    costs = np.concatenate([np.zeros(n), np.ones(g), np.zeros(k * g)])
    free = [(None, None)] * n + [(0.0, None)] * g + [(None, None)] * (k * g)
    found = linprog(costs, sparse.vstack(within), np.zeros(2 * k * g), equal, V.ravel(), free, method="highs")
    if found.x is None:
        raise UndecidedError(f"no zonotope was found: the linear program ended with {found.message!r}.")
    return np.asarray(found.x[:n]), np.asarray(found.x[n + g :].reshape(k, g))


def _exact(row: Floats, x: Floats) -> Fraction:
    return sum((Fraction(u) * Fraction(v) for u, v in zip(row.tolist(), x.tolist(), strict=True)), Fraction(0))
