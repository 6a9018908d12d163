"""Fewer facets, from outside: dropping rows where that lets the set grow least."""

import heapq

import numpy as np

from polytopes.checks import Floats
from polytopes.lengths import lengths
from polytopes.linear_program import OPTIMAL
from polytopes.preparation import prepare
from polytopes.rows import Rows


def reduced_rows(P: Rows, max_facets: int) -> tuple[Floats, Floats]:
    """At most `max_facets` of the rows of a minimal description: a superset of P, bounded if P is.

    Greedy: the row goes whose removal lets its own support grow least (in distance).  Growths only increase while rows
    go, so a stale one is a lower bound and is renewed only when it comes first.

    Parameters
    ----------
    P : Rows
        Minimal and not empty.
    max_facets : int
        At least twice the dimension, so that a bounded set can stay bounded.
    """
    kept = list(range(P.b.size))
    queue = [(0.0, i) for i in kept]
    while len(kept) > max_facets:
        _, i = heapq.heappop(queue)
        growth = _growth(P, kept, i)
        if queue and growth > queue[0][0]:
            heapq.heappush(queue, (growth, i))
        else:
            kept.remove(i)
    return P.A[kept], P.b[kept]


def _growth(P: Rows, kept: list[int], i: int) -> float:
    """How far the set would reach beyond row i without it."""
    others = [j for j in kept if j != i]
    best = prepare(P.A[others], P.b[others], P.C, P.d).maximise(P.A[[i]])
    if best.status[0] != OPTIMAL:
        return np.inf
    return float(best.values[0] - P.b[i]) / float(lengths(P.A[[i]])[0])
