"""Rows as they are given, prepared for questions by one call of the core, where floats settle them at once.

That is the case of most sets: rows of which none is zero, with a largest ball that is not small.  All others, and forms
whose bound is not near the value that was found, go through `Program`.  See `core/polytopes/questions.c`.
"""

from functools import lru_cache
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from polytopes.affine import AffineSet, affine_set
from polytopes.checks import Floats
from polytopes.exact_units import EvenRows
from polytopes.linear_program import (
    CLEAN,
    OPTIMAL,
    SHARP,
    SMALL_BALL,
    UNBOUNDED,
    WIDEST,
    Interior,
    Maxima,
    Program,
    small,
)
from polytopes.native import Address, Entries, InCore, Integer, Real, arrays, function, handle, scratch
from polytopes.rounding import check_rounding

_prepare = function("fdi_prepared", *[Integer] * 2, *[Address] * 2, *[Real] * 2, *[Address] * 2, returns=Integer)
_ball = function("fdi_prepared_ball", *[Integer] * 2, *[Address] * 2, *[Real] * 2, Entries, Address, returns=Integer)
_supports = function(
    "fdi_prepared_supports", *[Integer] * 3, *[Address] * 2, *[Real] * 2, Entries, *[Address] * 4, returns=Integer
)
_facets = function("fdi_prepared_facets", *[Integer] * 2, Address, Entries, Address, returns=Integer)
_size, _room = (function(f"fdi_prepared_{name}", *[Integer] * 2, returns=Integer) for name in ("size", "room"))
_ball_room, _facets_room = (
    lru_cache(1024)(function(f"fdi_prepared_{name}_room", *[Integer] * 2, returns=Integer))
    for name in ("ball", "facets")
)
_supports_room = lru_cache(1024)(function("fdi_prepared_supports_room", *[Integer] * 3, returns=Integer))


@lru_cache(1024)
def _sizes(n: int, m: int) -> tuple[int, int]:
    """Doubles of the block of a set and of what is worked in; none where a set is not for the core."""
    return (_size(n, m), _room(n, m)) if m and small(n, m) else (0, 0)


class PreparedRows(NamedTuple):
    """Rows ``A x <= b``, and the block of the core that they are prepared in."""

    rows: InCore
    block: Floats
    at: Any

    @classmethod
    def of(cls, rows: InCore) -> Self | None:
        """The rows prepared; None where floats do not settle at once that a ball fits in."""
        check_rounding()
        size, room = _sizes(rows[0], rows[1])
        if not size:
            return None
        block = np.empty(size)
        at = handle(block)
        return cls(rows, block, at) if _prepare(*rows, WIDEST, SMALL_BALL, at, scratch(room)) else None

    @property
    def centre(self) -> Floats:
        """The centre (n,) of the largest ball in even units; it satisfies every row by more than is rounded."""
        return self.block[2 : 2 + self.rows[0]].copy()

    @property
    def radius(self) -> float:
        """That of the largest ball in even units."""
        return self.block.item(0)

    def supports(self, directions: Floats) -> Floats | None:
        """Upper bounds (k,) of the supports along directions (k, n), inf where unbounded; None if one is open."""
        values = np.empty(len(directions))
        return values if self._settled(directions, values) else None

    def lower_supports(self, directions: Floats) -> Floats | None:
        """Lower bounds (k,) of the supports, a little below them, inf where unbounded; None if one is open."""
        values, lower = np.empty((2, len(directions)))
        if not self._settled(directions, values, lower=handle(lower)):
            return None
        return np.where(values < np.inf, lower, np.inf)

    @property
    def row_powers(self) -> NDArray[np.int64]:
        """The exponents (m,) of the powers of two that bring the rows into even units."""
        return self._parts()[9].view(np.int64)

    def maxima(self, directions: Floats) -> Maxima | None:
        """The same with points and multipliers."""
        k = len(directions)
        values, points, weights = np.empty(k), np.empty(directions.shape), np.zeros((k, self.rows[1]))
        if not self._settled(directions, values, handle(points), handle(weights)):
            return None
        return Maxima(values, points, weights, [UNBOUNDED if value == np.inf else OPTIMAL for value in values.tolist()])

    def _settled(
        self, directions: Floats, values: Floats, points: Any = None, weights: Any = None, lower: Any = None
    ) -> int:
        check_rounding()
        n, m, k = *self.rows[:2], len(directions)
        room = scratch(_supports_room(n, m, k))
        settled: int = _supports(
            n, m, k, self.at, directions.tobytes(), CLEAN, SHARP, values, points, weights, lower, room
        )
        return settled

    def ball(self) -> tuple[Floats, float] | None:
        """Centre (n,) and radius of a largest ball; None if it is not settled."""
        n, m, A, _ = self.rows
        found = np.empty(n + 1)
        settled = _ball(n, m, A, self.at, WIDEST, CLEAN, found, scratch(_ball_room(n, m)))
        return (found[:n], found.item(n)) if settled else None

    def facets(self) -> NDArray[np.int64] | None:
        """Numbers of a minimal set of the rows; None if rounding leaves one open."""
        n, m = self.rows[:2]
        rows = np.empty(m, np.int64)
        count = _facets(n, m, self.at, rows, scratch(_facets_room(n, m)))
        return None if count < 0 else rows[:count]

    def program(self) -> Program:
        """The rows as a program, its largest ball known."""
        n, m = self.rows[:2]
        A, b = arrays(self.rows)
        _, _, AT, rhs, norms, centre, weights, _, columns, rows = self._parts()
        radius, powers, row_powers = self.radius, columns.view(np.int64), rows.view(np.int64)
        flat, AT, every = _everywhere(n), AT.reshape(n, m), np.arange(m)
        exact = EvenRows(A, b, flat, row_powers, powers)
        program = Program(A, b, flat, exact, AT, rhs, norms, row_powers, powers, every, None)
        program.__dict__["interior"] = Interior(program.lift(centre[:n]), centre[:n], radius, weights, True)
        return program

    def _parts(self) -> list[Floats]:
        """Head, point, AT, rhs, norms, centre, multipliers, reach, exponents of columns and rows, as in the core."""
        n, m = self.rows[:2]
        parts, end = [], 0
        for size in (2, n, n * m, m, m, n + 1, m, n, n, m):
            parts.append(self.block[end : end + size])
            end += size
        return parts


@lru_cache(64)
def _everywhere(n: int) -> AffineSet:
    """R^n, the affine set of no equalities."""
    return affine_set(np.empty((0, n)), np.empty(0))
