"""Vertices, rays and lines of any set, and the set of given ones."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from polytopes.box import both_ways
from polytopes.checks import Floats
from polytopes.double_description import Integers
from polytopes.errors import EmptySetError, UnboundedError, UndecidedError
from polytopes.exact_generators import integer_form
from polytopes.fractions_given import exact_table, integers_of, primitive_row
from polytopes.general_position import rows_around
from polytopes.hull import Spread, outer_rows, point_offsets
from polytopes.integers import floats_of_directions, floats_of_points, integer_rows, short
from polytopes.kept_vertices import among
from polytopes.minkowski_weyl import ExactGenerators, distinct, generators_of, rows_of
from polytopes.outward import are_exact, float_rows
from polytopes.rows import Rows, Table, no_equalities
from polytopes.short_sets import are_short, short_hull, short_unit
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
    known = P.exact if P.made_of is None else P.made_of
    return generators_of(integer_form(P.A, P.b, P.C, P.d)) if known is None else known


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


def rows_of_fractions(V: Any, rays: Any) -> Table:
    """The same of points and rays with fractions among their numbers, taken exactly; rows outward if not floats.

    Raises
    ------
    TypeError, ValueError
        If an entry is no number, or a shape does not fit.
    UndecidedError
        If the double description passes 10 000 rows.
    """
    points = exact_table("V", V)
    directions = [] if rays is None else [row for row in exact_table("rays", rays) if any(row)]
    n = len(points[0]) if points else 0
    if not n or any(len(row) != n for row in directions):
        raise ValueError(f"V has shape ({len(points)}, {n}); expected (k, n), one or more points, and rays as long.")
    parts = [primitive_row([*row, Fraction(1)]) for row in points], [primitive_row(row) for row in directions]
    vertices, cone = integers_of(parts[0], n + 1), integers_of(parts[1], n)
    return float_rows(ExactGenerators(distinct(vertices), distinct(cone), cone[:0]))


def exact_hull(V: Floats) -> Table | None:
    """Rows A, b, C, d of the hull of points (k, n) of few bits, or of any numbers (k, 1), exact; None if it is flat."""
    if V.shape[1] > 1:
        return _table(short_hull(V))
    numbers = V.ravel().tolist()
    low, high = min(numbers), max(numbers)
    return (both_ways(1), np.array([high, 0.0 - low]), *no_equalities(1)) if low < high else None


def _table(rows: Floats | None) -> Table | None:
    return None if rows is None else (rows[:, :-1], rows[:, -1], *no_equalities(rows.shape[1] - 1))


def rows_of_generators(V: Floats, rays: Floats) -> Table:
    """Rows A, b, C, d of ``conv(V) + cone(rays)``, k >= 1 points; see `hull_and_vertices`."""
    return hull_and_vertices(V, rays)[0]


def hull_and_vertices(V: Floats, rays: Floats) -> tuple[Table, Callable[[], ExactGenerators] | None]:
    """The rows, and what finds the vertices where these are exactly those of the points.

    In integers where the numbers are short, where there are rays, and where the points are flat; the rows are exact if
    they are floats, and outward else.
    """
    on_a_line = V.shape[1] == 1
    few_bits = not on_a_line and are_short(V)
    known = exact_hull(V) if (few_bits or on_a_line) and not len(rays) else None
    if known is not None:
        return known, lambda: among(distinct(_homogeneous(V)), integer_form(*known))
    unit = 0 if few_bits else short_unit(V)
    if unit:
        A, b, C, d = rows_of_generators(np.ldexp(V, -unit), rays)
        return (A, np.ldexp(b, unit), C, np.ldexp(d, unit)), None
    around = None if few_bits or len(rays) else _table(rows_around(V))
    if around is not None:
        return around, None
    points = _homogeneous(V)
    directions = integer_rows(rays[rays.any(axis=1)])
    exact = short(points) or len(directions) > 0
    spread = None if exact else Spread.of(V)
    if spread is None or (len(V) <= _FEW and spread.rank < V.shape[1]):
        found = ExactGenerators(distinct(points), distinct(directions), directions[:0])
        try:
            rows = rows_of(found)
            kept = None if len(directions) or not are_exact(rows) else partial(among, found.vertices, rows)
            return float_rows(found, rows), kept
        except UndecidedError:
            if len(directions):
                raise
    A, b = outer_rows(spread or Spread.of(V), point_offsets(V))
    return (A, b, np.empty((0, V.shape[1])), np.empty(0)), None


def _homogeneous(V: Floats) -> Integers:
    """Points (k, n) as rows ``[x, t]`` of integers."""
    return integer_rows(np.hstack([V, np.ones((len(V), 1))]))
