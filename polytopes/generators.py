"""Vertices, rays and lines of any set, and the set of given ones."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from polytopes.checks import Floats
from polytopes.errors import EmptySetError, UnboundedError, UndecidedError
from polytopes.exact_generators import integer_form
from polytopes.hull import Spread, outer_rows, point_offsets
from polytopes.integers import floats_of_directions, floats_of_points, integer_rows, short
from polytopes.minkowski_weyl import ExactGenerators, distinct, generators_of
from polytopes.outward import float_rows
from polytopes.rows import Rows, Table
from polytopes.shown import Shown
from polytopes.support import is_bounded, known_nonempty
from polytopes.vertices import vertices

_FEW = 200  # long points up to which a flat hull is found in integers


@dataclass(frozen=True, eq=False)
class Generators(Shown):
    """``conv(vertices) + cone(rays) + span(lines)``: arrays (k, n), (r, n) and (l, n).

    With lines, the vertices and rays are those of the part of the set across the lines (some coordinates zero).
    """

    vertices: Floats
    rays: Floats
    lines: Floats


def generators(P: Rows) -> Generators:
    """Vertices, rays and lines of a nonempty set: of an unbounded one in integers, rounded to floats in the end.

    Raises
    ------
    EmptySetError
        If P is empty.
    UndecidedError
        If P is unbounded and its double description too large.
    """
    if not known_nonempty(P):
        raise EmptySetError("the empty set has no generators; ask emptiness() first.")
    if P.exact is None and is_bounded(P):
        nothing = np.empty((0, P.dim))
        return Generators(vertices(P), nothing, nothing)
    found = in_integers(P)
    return Generators(
        floats_of_points(found.vertices), floats_of_directions(found.rays), floats_of_directions(found.lines)
    )


def in_integers(P: Rows) -> ExactGenerators:
    """The generators of a set in integers, whatever its rows.

    Raises
    ------
    UndecidedError
        At the limit of rays.
    """
    return generators_of(integer_form(P.A, P.b, P.C, P.d)) if P.exact is None else P.exact


def exact_vertices(P: Rows) -> list[tuple[Fraction, ...]]:
    """The vertices of a bounded set in rationals, in lexicographic order; none if it is empty.

    Raises
    ------
    UnboundedError
        If P is unbounded.
    UndecidedError
        At the limit of rays.
    """
    if not known_nonempty(P):
        return []
    found = in_integers(P)
    if len(found.rays) or len(found.lines):
        raise UnboundedError("P is unbounded, so its vertices do not describe it; intersect it with a box first.")
    return sorted(tuple(Fraction(int(v), int(row[-1])) for v in row[:-1]) for row in found.vertices.tolist())


def rows_of_generators(V: Floats, rays: Floats) -> Table:
    """Rows A, b, C, d of ``conv(V) + cone(rays)``, k >= 1 points.

    In integers where the numbers are short, where there are rays, and where the points are flat; the rows are exact if
    they are floats, and outward else.
    """
    points = integer_rows(np.hstack([V, np.ones((len(V), 1))]))
    directions = integer_rows(rays[rays.any(axis=1)])
    exact = short(points) or len(directions) > 0
    spread = None if exact else Spread.of(V)
    if spread is None or (len(V) <= _FEW and spread.rank < V.shape[1]):
        found = ExactGenerators(distinct(points), distinct(directions), directions[:0])
        try:
            return float_rows(found)
        except UndecidedError:
            if len(directions):
                raise
    A, b = outer_rows(spread or Spread.of(V), point_offsets(V))
    return A, b, np.empty((0, V.shape[1])), np.empty(0)
