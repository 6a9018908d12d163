"""Images of explicit polytopes under the vertices of Delta, their hull, and the limits on its facets.

The state after a sample is M(Delta) (x, w) + t(Delta), affine in Delta at fixed x and w, so that the hull over the
vertices of Delta contains it for every Delta between them (Rosa and Silvestre 2013, section 2, without the later
measurements that their proof does not cover).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.spatial import QhullError

from polytopes import HPolytope, ProjectionLimitError, UndecidedError, convex_hull
from svo.checks import Array
from svo.models import UncertainModel

EXACT_FACETS = 500
"""Facets of one set beyond which exact mode gives up."""
_EXACT_ROWS = 5_000  # the same for the rows that one step of elimination forms
_BUDGET_ROWS = 1_000  # the same under a budget; beyond, the normals at hand make a template
_HULL_POINTS = 80  # vertices beyond which a hull in three or more dimensions has too many facets to be reduced
_INVERTIBLE = 1e4  # condition number of A up to which x is expressed by the next state
# Relative to the terms of a row. Far above rounding on purpose: exact sensors leave slabs that a contraction thins to
# 1e-13, where float programs over nearly parallel rows answered wrong by 1e-3; as thick as this they stay well posed.
_OUTWARD = 3e-12


class FacetLimitError(RuntimeError):
    """An exact set has more facets than exact mode takes on."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f"{what}; exact sets grow without end. Give a budget, such as max_facets=60 (a superset), "
            "or use WindowObserver, whose cost does not depend on facets"
        )


def transitions(stack: Array, model: UncertainModel, u: Array) -> list[tuple[Array, Array]]:
    """M (n, n + nw) and t (n,) of x(k+1) = M (x, w) + t at every vertex of Delta.

    Only a Delta that enters the state at this sample, in an interval of some width, has two ends.
    """
    n, nu = model.n_states, model.n_inputs
    ends: list[list[float]] = [
        sorted(set(uncertainty.bounds)) if item[:n].any() else [uncertainty.bounds[0]]
        for item, uncertainty in zip(stack[1:], model.uncertainties, strict=True)
    ]
    maps = []
    for delta in itertools.product(*ends):
        total = (stack[0] + np.tensordot(np.array(delta), stack[1:], axes=1))[:n]
        maps.append((np.delete(total, np.s_[n : n + nu + 1], axis=1), total[:, n : n + nu] @ u + total[:, n + nu]))
    return maps


def hull_of_images(joint: HPolytope, maps: Sequence[tuple[Array, Array]], max_facets: int | None) -> HPolytope:
    """Hull of the images of a bounded set of (x, w) under maps (M, t), rounded outward.

    Raises
    ------
    FacetLimitError
        In exact mode (``max_facets`` None), at its limits.
    """
    images = [image(joint, M, t, max_facets) for M, t in maps]
    if len(images) == 1:
        return images[0]
    return template(images, *hull_normals(images, max_facets))


def image(joint: HPolytope, M: Array, t: Array, max_facets: int | None) -> HPolytope:
    """{M z + t : z in joint}, rounded outward; under a budget its box, where it is too thin for float programs."""
    try:
        return outward(_exact_image(joint, M, t, max_facets))
    except UndecidedError:
        if max_facets is None:
            raise
    ends = outer_support(joint, np.vstack([M, -M]))
    return outward(HPolytope.box(t - ends[len(t) :], t + ends[: len(t)]))


def _exact_image(joint: HPolytope, M: Array, t: Array, max_facets: int | None) -> HPolytope:
    """The equations eliminate x, Fourier and Motzkin w."""
    n = len(M)
    A, E = M[:, :n], M[:, n:]
    if E.shape[1] == 0 or np.linalg.cond(A) > _INVERTIBLE:
        return joint.affine_map(M, t)
    lifted = _pulled_back(joint, A, E, t)
    rows = _EXACT_ROWS if max_facets is None else _BUDGET_ROWS
    try:
        return lifted.project(range(n), method="fourier-motzkin", max_rows=rows, outer=max_facets is not None)
    except ProjectionLimitError as error:
        raise FacetLimitError(
            f"the projection on the next state forms more than {_EXACT_ROWS} rows in one step of elimination"
        ) from error


def _pulled_back(joint: HPolytope, A: Array, E: Array, t: Array) -> HPolytope:
    """A set of (x, w) as rows over (x', w) with x' = A x + E w + t, outward.

    With an inverse in floats x = back (x' - E w - t) + (I - back A) x: the last term and the rounding of the rows are
    bounded over the set. Equalities become two rows.
    """
    (n, nw), back, reach = E.shape, np.linalg.inv(A), reach_of(joint)
    inverse = np.block([[back, -back @ E], [np.zeros((nw, n)), np.eye(nw)]])
    shift = np.concatenate([-back @ t, np.zeros(nw)])
    rows, sides = np.vstack([joint.A, joint.C, -joint.C]), np.concatenate([joint.b, joint.d, -joint.d])
    unit, sizes = (2 * joint.dim + 4) * float(np.finfo(np.float64).eps), np.abs(back)
    ahead = np.abs(np.hstack([A, E])) @ reach + np.abs(t)  # of |x'|
    terms = np.concatenate([sizes @ (ahead + np.abs(E) @ reach[n:] + np.abs(t)), reach[n:]])
    missed = (np.abs(np.eye(n) - back @ A) + unit * sizes @ np.abs(A)) @ reach[:n]
    room = np.abs(rows[:, :n]) @ missed + unit * (np.abs(rows) @ terms + np.abs(sides))
    lifted, flat = rows @ inverse, np.s_[joint.b.size :]
    room[flat] += _OUTWARD * np.abs(lifted[flat]) @ np.concatenate([ahead, reach[n:]])
    return HPolytope(lifted, sides - rows @ shift + room)


def limited(P: HPolytope, max_facets: int | None) -> HPolytope:
    """A minimal description of P, in at most so many facets: a superset if need be.

    Raises
    ------
    FacetLimitError
        In exact mode, beyond `EXACT_FACETS`.
    """
    minimal = P.remove_redundancy()
    if max_facets is not None:
        return minimal if len(minimal.b) <= max_facets else minimal.outer_reduce(max_facets)
    if len(minimal.b) > EXACT_FACETS:
        raise FacetLimitError(f"the set has {len(minimal.b)} facets, more than the {EXACT_FACETS} of exact mode")
    return minimal


def template(sets: Sequence[HPolytope], normals: Array, flat: Array) -> HPolytope:
    """Smallest polytope around several sets with the given normals (k, n), rounded outward.

    Directions ``flat`` (q, n) give two rows.
    """
    rows = np.vstack([normals, flat, -flat])
    reach = np.max([reach_of(P) for P in sets], axis=0)
    room = _OUTWARD * np.abs(rows) @ reach
    return HPolytope(rows, np.max([outer_support(P, rows) for P in sets], axis=0) + room)


def outward(P: HPolytope) -> HPolytope:
    """P with every row moved outward, by 3e-12 of its terms over P; equalities become two rows."""
    rows, sides = np.vstack([P.A, P.C, -P.C]), np.concatenate([P.b, P.d, -P.d])
    return HPolytope(rows, sides + _OUTWARD * np.abs(rows) @ reach_of(P))


def reach_of(P: HPolytope) -> Array:
    """Upper bounds of |x_i| over a bounded set."""
    ends = np.abs(outer_support(P, np.vstack([np.eye(P.dim), -np.eye(P.dim)])))
    return np.maximum(ends[: P.dim], ends[P.dim :])


def outer_support(P: HPolytope, directions: Array) -> Array:
    """Upper bounds (k,) of the support of a bounded set that is not empty.

    Raises
    ------
    UndecidedError
        If one is not proved.
    """
    bounds: Array = np.asarray(P.support(directions))
    if not np.isfinite(bounds).all():
        raise UndecidedError("the set is too thin, or empty: there is no bound of its points")
    return bounds


def widened_rows(P: HPolytope) -> HPolytope:
    """P with its equalities as pairs of inequalities with room for rounding, for an intersection with an equal set."""
    room = _OUTWARD * np.abs(P.C) @ reach_of(P)
    return HPolytope(np.vstack([P.A, P.C, -P.C]), np.concatenate([P.b, P.d + room, room - P.d]))


def hull_normals(images: Sequence[HPolytope], max_facets: int | None) -> tuple[Array, Array]:
    """Normals and flat directions of the hull; under a budget, those of the images where the hull is too large."""
    n = images[0].dim
    if max_facets is None:
        try:
            hull = convex_hull(images)
        except (QhullError, UndecidedError) as error:
            reason = str(error).splitlines()[0]
            raise FacetLimitError(f"the hull over the vertices of Delta was not found ({reason})") from error
        return hull.A, hull.C
    try:
        points = np.vstack([P.vertices() for P in images])
        if n <= 2 or len(points) <= _HULL_POINTS:
            hull = HPolytope.from_vertices(points)
            return hull.A, hull.C
    except (QhullError, UndecidedError):
        pass  # the template below needs no vertices
    axes = np.eye(n)
    rows = np.vstack([axes, -axes, *(P.A for P in images), *(P.C for P in images), *(-P.C for P in images)])
    rows = rows[rows.any(axis=1)]
    return np.unique(rows / np.linalg.norm(rows, axis=1)[:, None], axis=0), np.zeros((0, n))
