"""Whether inputs can keep a set: it is enough to ask at its vertices, rays and lines (Gutman and Cwikel 1986).

States that can be kept form a convex set, so that it holds P if it holds the generators of P.  For each of them all
``(x, u, x+)`` form a polytope without any rounding, and whether it has a point is decided in rationals.
"""

from __future__ import annotations

from fractions import Fraction
from math import inf

import numpy as np

from polytopes import HPolytope, UndecidedError
from polytopes.generators import in_integers
from polytopes.inclusion import half_spaces
from polytopes.integers import are_floats, up
from polytopes.outer_supports import exact_support
from svo.analysis.one_step_sets import LinearSystem
from svo.checks import Array


def can_be_kept(P: HPolytope, system: LinearSystem) -> bool:
    """Whether for every x in P some u in U leads to P whatever w is; False too where a rounded side leaves it open.

    Raises
    ------
    UndecidedError
        If P has too many generators, or a ray that is no float.
    """
    if P.is_empty():
        return True
    found, sure = in_integers(P), _surely_inside(P, system)
    if sure is None:
        return False
    vertices = (_face(P, [Fraction(v, row[-1]) for v in row[:-1]]) for row in found.vertices.tolist())
    if any(system.kept_inputs(vertex, sure).is_empty() for vertex in vertices):
        return False
    rays = [*found.rays.tolist(), *found.lines.tolist(), *(-found.lines).tolist()]
    return not any(_directions(system, P, ray).is_empty() for ray in rays)


def _surely_inside(P: HPolytope, system: LinearSystem) -> HPolytope | None:
    """Points z with ``z + E w`` in P for all w, sides rounded down; None if there are none, for W is unbounded."""
    normals, sides = half_spaces(P)
    if system.disturbed is None:
        return P
    directions = np.pad(normals, ((0, 0), (system.E.shape[1], 0)))
    reach = [exact_support(system.disturbed, row) for row in directions]
    if inf in reach:
        return None
    return HPolytope(normals, [-up(h - Fraction(b)) for b, h in zip(sides.tolist(), reach, strict=True)])


def _face(P: HPolytope, x: list[Fraction]) -> HPolytope:
    """The least face of P that holds x: the rows that x keeps with equality."""
    rows = [[Fraction(v) for v in row] for row in P.A.tolist()]
    values = [sum((u * v for u, v in zip(row, x, strict=True)), Fraction(0)) for row in rows]
    held = [i for i, (value, b) in enumerate(zip(values, P.b.tolist(), strict=True)) if value == Fraction(b)]
    return HPolytope(np.empty((0, P.dim)), [], np.vstack([P.A[held], P.C]), np.append(P.b[held], P.d))


def _directions(system: LinearSystem, P: HPolytope, ray: list[int]) -> HPolytope:
    """All inputs along which a ray of P leads to a direction of P."""
    if not are_floats(ray):
        raise UndecidedError("a ray of the set is no float; intersect it with a box first.")
    U = system.inputs
    still = LinearSystem(system.A, system.B, inputs=None if U is None else _cone(U))
    return still.kept_inputs(_point(np.array(ray, dtype=np.float64)), _cone(P))


def _cone(P: HPolytope) -> HPolytope:
    """The directions of a nonempty set."""
    return HPolytope(P.A, 0.0 * P.b, P.C, 0.0 * P.d)


def _point(x: Array) -> HPolytope:
    return HPolytope(np.empty((0, x.size)), [], np.eye(x.size), x)
