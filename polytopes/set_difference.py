"""The part of a set that is outside another, in pieces whose interiors are disjoint.

Row by row of Q (Bemporad, Morari, Dua and Pistikopoulos 2002, Theorem 3): piece i keeps the rows before and breaks row
i.  Rows are taken as they are or with their signs turned, so that nothing is rounded; each piece is closed, and is kept
if a point of P lies strictly beyond the row, decided exactly.
"""

from collections.abc import Iterable, Sequence
from typing import TypeVar

import numpy as np

from polytopes.inclusion import broken_row, half_spaces, strictest
from polytopes.rows import Rows
from polytopes.separation import intersects
from polytopes.support import known_nonempty

Piece = TypeVar("Piece", bound=Rows)


def difference(P: Piece, Q: Rows) -> list[Piece]:
    """Pieces of the closure of ``{x in P : x not in Q}``.

    Raises
    ------
    UndecidedError
        If a question could not be decided exactly.
    """
    if not intersects(P, Q):
        return [P] if known_nonempty(P) else []
    pieces, rest = [], P
    for normal, side in zip(*strictest(*half_spaces(Q)), strict=True):
        if broken_row(Rows(normal[None], [side]), rest) is not None:
            pieces.append(_with_row(rest, 0.0 - normal, 0.0 - side))
            rest = _with_row(rest, normal, side)
    return pieces


def remainder(pieces: Iterable[Piece], sets: Iterable[Rows]) -> list[Piece]:
    """Pieces of what some sets leave of given ones; none if and only if they cover them."""
    left = list(pieces)
    for Q in sets:
        left = [piece for P in left for piece in difference(P, Q)]
    return left


def disjoint(pieces: Sequence[Piece]) -> list[Piece]:
    """The same union by pieces whose interiors are disjoint: each without those before it."""
    return [part for i, P in enumerate(pieces) for part in remainder([P], pieces[:i])]


def _with_row(P: Piece, normal: np.ndarray[tuple[int], np.dtype[np.float64]], side: float) -> Piece:
    return P.with_rows(np.vstack([P.A, normal]), np.append(P.b, side))
