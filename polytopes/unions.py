"""Convex sets that contain a union: its convex hull, and its bounds along given normals."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from polytopes.checks import Floats, listed, real_array
from polytopes.generators import exact_hull, in_integers
from polytopes.hpolytope import HPolytope
from polytopes.hull import normals_around
from polytopes.minkowski_weyl import union
from polytopes.outer_supports import upper_supports
from polytopes.outward import float_rows
from polytopes.rows import Rows, Table, nothing, same_space
from polytopes.support import is_bounded, known_nonempty
from polytopes.vertices import vertices


def convex_hull(sets: Sequence[HPolytope]) -> HPolytope:
    """Closed convex hull of a union, ``conv(V_1, ..., V_k) + cone(R_1, ..., R_k)``; empty sets add nothing.

    In integers, and exact where the result is floats, if all sets are computed with in integers or one is unbounded;
    else the hull of the vertices tells the normals, and the largest support of a set along each is rounded up.

    Parameters
    ----------
    sets : sequence of HPolytope
        At least one, all of one dimension.

    Raises
    ------
    UndecidedError
        If a set is unbounded and the double description of it or of the hull too large.
    """
    return HPolytope(*_hull_rows(_checked(sets)))


def _hull_rows(sets: Sequence[Rows]) -> Table:
    n = sets[0].dim
    known = _of_exact_corners(sets) if len(sets) > 1 else None
    if known is not None:
        return known
    some = [P for P in sets if known_nonempty(P)]
    if not some:
        return nothing(n)
    if len(some) == 1:
        return some[0].A, some[0].b, some[0].C, some[0].d
    if not all(_by_floats(P) for P in some) and (
        all(P.exact is not None for P in some) or not all(is_bounded(P) for P in some)
    ):
        return float_rows(union([in_integers(P) for P in some]))
    normals = normals_around(np.vstack([vertices(P) for P in some]))
    return normals, _largest_supports(some, normals), np.empty((0, n)), np.empty(0)


def _of_exact_corners(sets: Sequence[Rows]) -> Table | None:
    """The hull of sets whose vertices are floats of few bits; None if they are not such."""
    corners = [P.corners for P in sets]
    return exact_hull(np.vstack([V.points for V in corners if V])) if all(V and V.exact for V in corners) else None


def _by_floats(P: Rows) -> bool:
    """Whether floats know the vertices of a set that is not one of integers."""
    return P.listed is not None or (P.as_box is not None and P.as_box.vertices is not None and not P.short)


def _largest_supports(sets: Sequence[Rows], normals: Floats) -> Floats:
    largest: Floats = np.max([upper_supports(P, normals) for P in sets], axis=0)
    return largest


def union_bounds(sets: Sequence[HPolytope], directions: ArrayLike | None = None) -> HPolytope:
    """Smallest set ``{x : T x <= h}`` with the given normals that contains every set: ``h`` is the largest support.

    One linear program for each set and normal, where `convex_hull` needs vertices.  Normals along which a set is
    unbounded are left out; offsets are exact or rounded outward (see `upper_supports`).

    Parameters
    ----------
    sets : sequence of HPolytope
        At least one, all of one dimension; empty sets add nothing.
    directions : array_like (k, n), optional
        The normals T; those of a box if absent.
    """
    sets = _checked(sets)
    n = sets[0].dim
    normals = (
        np.vstack([np.eye(n), -np.eye(n)]) if directions is None else real_array("directions", directions, ("k", n))
    )
    some = [P for P in sets if known_nonempty(P)]
    if not some:
        return HPolytope.empty(n)
    offsets = _largest_supports(some, normals)
    finite = np.isfinite(offsets)
    return HPolytope(normals[finite], offsets[finite])


def _checked(sets: Sequence[HPolytope]) -> list[HPolytope]:
    """The sets, at least one, in one space."""
    given = listed("sets", sets, HPolytope)
    if not given:
        raise ValueError("sets is empty; expected at least one HPolytope.")
    for P in given:
        same_space(given[0], P)
    return given
