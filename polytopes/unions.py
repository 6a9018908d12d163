"""Convex sets that contain a union: its convex hull, and its bounds along given normals."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from polytopes import combinations
from polytopes.checks import real_array
from polytopes.hpolytope import HPolytope
from polytopes.rows import same_space
from polytopes.support import known_nonempty, outer_offsets


def convex_hull(sets: Sequence[HPolytope]) -> HPolytope:
    """Closed convex hull of a union; empty sets add nothing.

    Bounded sets: the hull of their vertices.  Otherwise a projection of the lifted form of Balas (1985), in as many
    coordinates as all sets together.

    Parameters
    ----------
    sets : sequence of HPolytope
        At least one, all of one dimension.
    """
    _checked(sets)
    return HPolytope(*combinations.hull_of_union(sets))


def union_bounds(sets: Sequence[HPolytope], directions: ArrayLike | None = None) -> HPolytope:
    """Smallest set ``{x : T x <= h}`` with the given normals that contains every set: ``h`` is the largest support.

    One linear program for each set and normal, where `convex_hull` needs vertices.  Normals along which a set is
    unbounded are left out; offsets are rounded outward (128 units of last place).

    Parameters
    ----------
    sets : sequence of HPolytope
        At least one, all of one dimension; empty sets add nothing.
    directions : array_like (k, n), optional
        The normals T; those of a box if absent.
    """
    n = _checked(sets)
    normals = (
        np.vstack([np.eye(n), -np.eye(n)]) if directions is None else real_array("directions", directions, ("k", n))
    )
    some = [P for P in sets if known_nonempty(P)]
    if not some:
        return HPolytope.empty(n)
    offsets = np.max([outer_offsets(P, normals) for P in some], axis=0)
    finite = np.isfinite(offsets)
    return HPolytope(normals[finite], offsets[finite])


def _checked(sets: Sequence[HPolytope]) -> int:
    """The dimension of the sets."""
    if not sets:
        raise ValueError("sets is empty; expected at least one HPolytope.")
    for P in sets:
        same_space(sets[0], P)
    return sets[0].dim
