"""Is a union of sets convex, and by which rows?  (Bemporad, Fukuda and Torrisi 2001)

The envelope of a union is what the rows of each set bound that hold all over the others.  A union is convex if and only
if it covers its envelope (their Theorem 3), which then is the union.  Only rows that were given occur in it: nothing is
rounded.
"""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from polytopes.inclusion import broken_row, half_spaces, strictest
from polytopes.rows import Rows
from polytopes.set_difference import remainder

Piece = TypeVar("Piece", bound=Rows)


def envelope(sets: Sequence[Piece]) -> Piece:
    """The set of the rows of each of some nonempty sets that hold all over the others, an equality as two rows."""
    rows, sides = [np.empty((0, sets[0].dim))], [np.empty(0)]
    for i, P in enumerate(sets):
        normals, bounds = strictest(*half_spaces(P))
        others = [Q for k, Q in enumerate(sets) if k != i]
        holds = [_holds(normal, bound, others) for normal, bound in zip(normals, bounds.tolist(), strict=True)]
        rows.append(normals[holds])
        sides.append(bounds[holds])
    return type(sets[0])(np.vstack(rows), np.concatenate(sides))


def convex_union(sets: Sequence[Piece]) -> Piece | None:
    """The union of nonempty sets as one set; None if it is not convex.

    Raises
    ------
    UndecidedError
        If a question could not be decided exactly.
    """
    whole = envelope(sets)
    return None if remainder([whole], sets) else whole


def merged(sets: Sequence[Piece]) -> list[Piece]:
    """The same union by fewer sets: pairs whose union is convex become one, as long as there are such (greedy)."""
    done: list[Piece] = []
    pending = list(sets)
    while pending:
        P = pending.pop(0)
        for k, Q in enumerate(done):
            both = convex_union([P, Q])
            if both is not None:
                pending.append(both)
                del done[k]
                break
        else:
            done.append(P)
    return done


def _holds(normal: np.ndarray[tuple[int], np.dtype[np.float64]], bound: float, sets: Sequence[Rows]) -> bool:
    half_space = Rows(normal[None], [bound])
    return all(broken_row(half_space, P) is None for P in sets)
