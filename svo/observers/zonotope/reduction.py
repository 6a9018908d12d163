"""Fewer generators and constraints: supersets of a constrained zonotope (Scott et al., Automatica 69, 2016, section 4).

What an elimination or a reduction rounds is added to ``room`` and ``slack``, so that the result contains the set in
exact arithmetic.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lstsq, qr

from svo.checks import Array
from svo.observers.zonotope.zonotope import EPS, TINY, ConstrainedZonotope, unit

_RANK = 1e-9  # of the scaled generators, below which a direction counts as flat
_EQUALITY = 1e-3  # of a constraint's terms: what is lost of a constraint without slack is compared with this


def reduced(Z: ConstrainedZonotope, max_generators: int, max_constraints: int) -> ConstrainedZonotope:
    """A superset with at most so many generators and constraints.

    Parameters
    ----------
    Z : ConstrainedZonotope
    max_generators : int
        At least the dimension.
    max_constraints : int
    """
    Z = without_redundant(rescaled(Z))
    while len(Z.offset) > max_constraints:
        Z = without_redundant(_without_one_constraint(Z))
    return _with_fewer_generators(Z, max_generators)


def rescaled(Z: ConstrainedZonotope) -> ConstrainedZonotope:
    """The same set with every xi over the interval that the constraints imply."""
    lower, upper = Z.implied()
    center = 0.5 * (lower + upper)
    half = np.minimum(0.5 * (upper - lower) * (1.0 + 4.0 * EPS) + 4.0 * EPS, 1.0)
    sums = np.abs(Z.generators).sum(axis=1), np.abs(Z.constraints).sum(axis=1)
    rounding = unit(lower.size)
    return ConstrainedZonotope(
        center=Z.center + Z.generators @ center,
        generators=Z.generators * half,
        room=Z.room + rounding * (sums[0] + np.abs(Z.center)) + TINY,
        constraints=Z.constraints * half,
        offset=Z.offset - Z.constraints @ center,
        slack=Z.slack + rounding * (sums[1] + np.abs(Z.offset)) + TINY,
    )


def without_redundant(Z: ConstrainedZonotope) -> ConstrainedZonotope:
    """Without the constraints that hold for every |xi| <= 1, and without generators that are zero."""
    needed = np.abs(Z.offset) + np.abs(Z.constraints).sum(axis=1) > Z.slack
    A = Z.constraints[needed]
    used = Z.generators.any(axis=0) | A.any(axis=0)
    return replace(
        Z, generators=Z.generators[:, used], constraints=A[:, used], offset=Z.offset[needed], slack=Z.slack[needed]
    )


def _without_one_constraint(Z: ConstrainedZonotope) -> ConstrainedZonotope:
    """Constraint i gives xi_j, whose bound is given up; (i, j) is the pair whose excess over that bound costs least."""
    G, A, size = Z.generators, Z.constraints, np.abs(Z.constraints)
    total = size.sum(axis=1)
    inverse = np.divide(1.0, size, out=np.full_like(A, np.inf), where=size > EPS * total[:, None])
    is_pair = np.isfinite(inverse)
    terms = (np.abs(Z.offset) + Z.slack + total)[:, None]
    excess = np.maximum(terms * np.where(is_pair, inverse, 0.0) - 2.0, 0.0)
    widths = np.abs(G).sum(axis=1) + Z.room
    weight = (np.abs(G) / np.where(widths > 0.0, widths, 1.0)[:, None]).sum(axis=0)
    weight = weight + (size / (total + Z.slack)[:, None]).sum(axis=0)
    cost = np.where(is_pair & np.isfinite(excess), excess * weight, np.inf)
    i, j = np.unravel_index(int(np.argmin(cost)), cost.shape)
    if not np.isfinite(cost[i, j]):
        return _take_rows(Z, np.arange(len(Z.offset)) != 0)
    ratio, share, base = A[i] / A[i, j], Z.slack[i] / A[i, j], Z.offset[i] / A[i, j]
    ratio[j] = -share  # the column of xi_j becomes that of the constraint's own slack
    g, a = G[:, j].copy(), A[:, j].copy()
    generators, constraints = G - np.outer(g, ratio), A - np.outer(a, ratio)
    generators[:, j], constraints[:, j] = g * share, a * share
    spread = np.abs(ratio).sum() + abs(base)
    rounding = unit(A.shape[1])
    kept = np.arange(len(Z.offset)) != i
    return _take_rows(
        ConstrainedZonotope(
            center=Z.center + g * base,
            generators=generators,
            room=Z.room + rounding * (widths + np.abs(Z.center) + np.abs(g) * spread) + TINY,
            constraints=constraints,
            offset=Z.offset - a * base,
            slack=Z.slack + rounding * (total + np.abs(Z.offset) + np.abs(a) * spread) + TINY,
        ),
        kept,
    )


def _take_rows(Z: ConstrainedZonotope, kept: NDArray[np.bool_]) -> ConstrainedZonotope:
    return replace(Z, constraints=Z.constraints[kept], offset=Z.offset[kept], slack=Z.slack[kept])


def _with_fewer_generators(Z: ConstrainedZonotope, limit: int) -> ConstrainedZonotope:
    """``room`` becomes generators; those that cost least go into a parallelotope of others, and into the slack.

    The lifted generators [g; a] of section 4.3: g = T rho widens T, and a - A_T rho widens the constraints.
    """
    folded = np.flatnonzero(Z.room > 0.0)
    G = np.hstack([Z.generators, np.diag(Z.room)[:, folded]])
    A = np.hstack([Z.constraints, np.zeros((len(Z.offset), folded.size))])
    plain = replace(Z, generators=G, constraints=A, room=np.zeros(Z.dim))
    surplus = G.shape[1] - limit
    if surplus <= 0:
        return plain
    widths = np.abs(G).sum(axis=1)
    scaled = G / np.where(widths > 0.0, widths, 1.0)[:, None]
    _, R, order = qr(scaled, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(R))
    rank = int((diagonal > _RANK * diagonal[0]).sum())
    base, rest = order[:rank], np.sort(order[rank:])
    rho = lstsq(scaled[:, base], scaled[:, rest])[0] if rank else np.zeros((0, rest.size))
    moved = np.abs(A[:, rest] - A[:, base] @ rho)
    volume = np.prod(1.0 + np.abs(rho), axis=0) - 1.0 - np.abs(rho).sum(axis=0)
    tight = Z.slack + _EQUALITY * np.abs(A).sum(axis=1)
    cost = volume + (moved / np.where(tight > 0.0, tight, 1.0)[:, None]).sum(axis=0)
    gone = np.argsort(cost, kind="stable")[:surplus]
    return _absorbed(plain, base, np.delete(rest, gone), rest[gone], rho[:, gone])


def _absorbed(Z: ConstrainedZonotope, base: Array, kept: Array, gone: Array, rho: Array) -> ConstrainedZonotope:
    """Generators ``gone`` replaced by ``base`` times rho, which may be rough: what it leaves goes to room and slack."""
    scale = 1.0 + np.abs(rho).sum(axis=1)
    rounding = unit(rho.size)
    results = []
    for matrix in (Z.generators, Z.constraints):
        wide = matrix[:, base] * scale
        left = np.abs(matrix[:, gone] - matrix[:, base] @ rho).sum(axis=1)
        terms = np.abs(matrix[:, gone]).sum(axis=1) + 2.0 * np.abs(wide).sum(axis=1)
        results.append((np.hstack([wide, matrix[:, kept]]), left * (1.0 + rounding) + rounding * terms + TINY))
    (generators, room), (constraints, slack) = results
    return replace(Z, generators=generators, room=Z.room + room, constraints=constraints, slack=Z.slack + slack)
