"""Generators of a polyhedral cone in integers: the double description method (Motzkin et al. 1953).

The cone ``{y : G y <= 0}`` is the sum of its lines (the null space of G) and a pointed cone.  The pointed cone begins
with a simplex, as many independent rows as it has dimensions, and takes the other rows one by one: the rays beyond a
row go, and each ray inside is joined with each adjacent ray beyond where the edge between them meets the row.  Two rays
are adjacent if no third one lies on all rows that both lie on (Fukuda and Prodon 1996).  Nothing is rounded: the
compiled core does it in machine integers; where a product could overflow, it is done again in Python's own.
"""

from typing import Any

import numpy as np
from flint import fmpq_mat, fmpz_mat
from numpy.typing import NDArray

from polytopes import kernel
from polytopes.errors import UndecidedError

Integers = NDArray[Any]  # int64, or object: Python integers of any size
Words = NDArray[np.uint64]

MAX_RAYS = 10_000
"""Rays of one cone, at any step, beyond which the method gives up; memory and time go with their number squared."""

_MACHINE = 2**62  # sums below do not overflow
_TOGETHER = 2**22  # words that one step of the test of adjacency holds at a time


def cone_generators(G: Integers, max_rays: int = MAX_RAYS) -> tuple[Integers, Integers]:
    """Extreme rays (r, d) and lines (l, d) of ``{y : G y <= 0}``, primitive integers.

    With lines, a ray stands for all that differ from it by lines: the one that is zero in as many coordinates as there
    are lines.

    Parameters
    ----------
    G : integers (m, d)
    max_rays : int
        Limit on the rays at any step.

    Raises
    ------
    UndecidedError
        At the limit.
    """
    d = G.shape[1]
    lines, pivots = null_space(G)
    rays = np.zeros((0, d), dtype=object)
    if pivots:
        across = _pointed_rays(np.ascontiguousarray(G[:, pivots]), max_rays)
        rays = np.zeros((len(across), d), dtype=across.dtype)
        rays[:, pivots] = across
    return rays, lines


def null_space(G: Integers) -> tuple[Integers, list[int]]:
    """A basis (l, d) of ``{y : G y = 0}`` in primitive integers, and the other coordinates of a solved form."""
    m, d = G.shape
    reduced, denominator, rank = fmpz_mat(m, d, G.ravel().tolist()).rref()
    rows = [[int(reduced[k, j]) for j in range(d)] for k in range(rank)]
    pivots = [next(j for j in range(d) if row[j]) for row in rows]
    basis = np.zeros((d - rank, d), dtype=object)
    for line, j in zip(basis, (j for j in range(d) if j not in pivots), strict=True):
        line[j] = int(denominator)
        line[pivots] = [-row[j] for row in rows]
    return primitive(basis), pivots


def primitive(rows: Integers) -> Integers:
    """Rows divided by the greatest common divisor of their entries; in machine integers where they fit."""
    if not rows.size:
        return rows
    divided: Integers = rows // np.maximum(np.gcd.reduce(rows, axis=1), 1)[:, None]
    small = divided.dtype == object and max(map(abs, divided.flat)) < _MACHINE
    return divided.astype(np.int64) if small else divided


def _pointed_rays(G: Integers, max_rays: int) -> Integers:
    """Extreme rays of a pointed cone ``{y : G y <= 0}``: G has full column rank."""
    found: Integers | None = None if G.dtype == object else kernel.pointed_cone(G, max_rays)
    if found is None:
        G = G[_good_order(G)]
        start = _independent(G)
        found = _large_rays(G.astype(object), start, _simplex(G[start]).astype(object), max_rays)
    if len(found) > max_rays:
        raise UndecidedError(
            f"the double description of {len(G)} rows in {G.shape[1]} coordinates passes its limit of {max_rays} rays."
        )
    return found


def _large_rays(G: Integers, start: list[int], rays: Integers, max_rays: int) -> Integers:
    """The same in integers of any size, from the rays of the rows `start`; more than the limit where it is passed.

    A table holds each ray and, behind it, its products with all rows of G, so that a new ray costs one combination.
    """
    m, d = G.shape
    table = np.hstack([rays, rays @ G.T])
    on = np.zeros((len(rays), (m + 63) // 64), dtype=np.uint64)  # a bit for each row taken that the ray lies on
    for i in start:
        _mark(on, i, table[:, d + i] == 0)
    for i in sorted(set(range(m)) - set(start)):
        table, on = _cut(table, on, i, d)
        if len(table) > max_rays:
            break
    return primitive(table[:, :d])


def _good_order(G: Integers) -> list[int]:
    """Short rows first, those of one length by their entries: facets of symmetric cones so make the fewest rays.

    368 facets of a cut polytope in R^15: at most some hundreds of rays, where the order of entries alone passes 10 000.
    """
    rows = G.tolist()
    return sorted(range(len(rows)), key=lambda i: (sum(map(abs, rows[i])), rows[i]))


def _independent(G: Integers) -> list[int]:
    """The first rows of G, in its order, that form a basis."""
    m, d = G.shape
    reduced, _, rank = fmpz_mat(d, m, np.ascontiguousarray(G.T).ravel().tolist()).rref()
    return [next(j for j in range(m) if reduced[k, j] != 0) for k in range(rank)]


def _simplex(B: Integers) -> Integers:
    """Rays of ``{y : B y <= 0}`` for an invertible B: the columns of minus the inverse."""
    d = len(B)
    inverse = fmpq_mat(d, d, B.ravel().tolist()).inv()
    numerators, denominator = inverse.numer_denom()
    columns = np.array([[-int(numerators[i, j]) for i in range(d)] for j in range(d)], dtype=object)
    return primitive(columns if denominator > 0 else -columns)


def _mark(on: Words, i: int, which: NDArray[np.bool_]) -> None:
    on[which, i // 64] |= np.uint64(1 << (i % 64))


def _cut(table: Integers, on: Words, i: int, d: int) -> tuple[Integers, Words]:
    """The table after row i of G is taken."""
    values = table[:, d + i]
    _mark(on, i, values == 0)
    beyond = np.flatnonzero(values > 0)
    if not beyond.size:
        return table, on
    inside, stays = np.flatnonzero(values < 0), values <= 0
    first, second = _adjacent(on, beyond, inside, d)
    fresh = _combined(table, first, second, d + i, d)
    both = on[first] & on[second]
    _mark(both, i, np.ones(len(both), dtype=bool))
    return np.concatenate([table[stays], fresh]), np.concatenate([on[stays], both])


def _combined(table: Integers, first: NDArray[np.int64], second: NDArray[np.int64], column: int, d: int) -> Integers:
    """Where the edges between rays beyond and rays inside meet a row: primitive rays with their products."""
    above, below = table[first, column], -table[second, column]
    fresh = table[first] * below[:, None] + table[second] * above[:, None]
    if len(fresh):
        fresh //= np.gcd.reduce(fresh[:, :d], axis=1)[:, None]
    return fresh


def _adjacent(
    on: Words, beyond: NDArray[np.int64], inside: NDArray[np.int64], d: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The pairs of adjacent rays, one beyond the row and one inside."""
    pairs: list[NDArray[np.int64]] = []
    step = max(1, _TOGETHER // max(1, inside.size * on.shape[1]))
    for k in range(0, beyond.size, step):
        some = beyond[k : k + step]
        common = on[some][:, None] & on[inside][None]
        enough = np.bitwise_count(common).sum(axis=2) >= d - 2  # rows on a common edge have at least this rank
        first, second = np.nonzero(enough)
        alone = _alone(on, common[first, second])
        pairs.append(np.array([some[first[alone]], inside[second[alone]]]))
    first, second = np.concatenate(pairs, axis=1) if pairs else np.zeros((2, 0), np.int64)
    return first, second


def _alone(on: Words, common: Words) -> NDArray[np.bool_]:
    """For each set of rows: do only two rays lie on all of them?"""
    alone = np.empty(len(common), dtype=bool)
    step = max(1, _TOGETHER // max(1, on.size))
    for k in range(0, len(common), step):
        some = common[k : k + step, None]
        alone[k : k + step] = ((on[None] & some) == some).all(axis=2).sum(axis=1) == 2
    return alone
