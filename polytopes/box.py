"""Boxes: sets whose rows have one entry each.  What they are asked most needs no program.

Bounds are quotients, rounded outward by less than one unit of the last place where they are no floats; supports are
sums of products in twice the working precision, rounded up.
"""

from functools import lru_cache
from itertools import product
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.native import Address, Entries, InCore, Integer, function
from polytopes.rounding import check_rounding

_COORDINATES = 16  # with more, vertices are too many
_NONE, _, _KNOWN, _WIDE = range(4)  # what the core says of rows

_box = function("fdi_box", *[Integer] * 2, *[Address] * 2, Entries, returns=Integer)
_supports = function("fdi_box_supports", *[Integer] * 2, *[Address] * 2, Entries, returns=Integer)


class Box(NamedTuple):
    """A box that is not empty: its corners, its point, and its corners rounded inward are the rows of an array."""

    found: Floats
    kind: int

    @property
    def corners(self) -> Floats:
        """Lower and upper (2, n), rounded outward; infinite where there is no row."""
        return self.found[:2]

    @property
    def point(self) -> Floats:
        """A point (n,) that satisfies every row exactly."""
        return self.found[2]

    @classmethod
    def of(cls, rows: InCore) -> Self | None:
        """The box of rows ``A x <= b``; None if they are none, or empty, or far from the origin."""
        check_rounding()
        found = np.empty((5, rows[0]))
        kind = _box(*rows, found)
        return None if kind == _NONE else cls(found, kind)

    @property
    def rounded(self) -> NDArray[np.bool_]:
        """Along which axes (n,) a corner was rounded."""
        return np.asarray((self.corners != self.found[3:]).any(axis=0))

    @property
    def exact(self) -> bool:
        """Whether it is bounded and full-dimensional, and nothing in its corners was rounded."""
        return self.kind == _WIDE

    @property
    def vertices(self) -> Floats | None:
        """Its vertices (k, n) in lexicographic order; None if it is unbounded, one was rounded, or they are many."""
        if self.kind < _KNOWN or self.point.size > _COORDINATES:
            return None
        ends = [(u, v) if u < v else (u,) for u, v in self.corners.T.tolist()]
        return np.array(list(product(*ends)))

    @property
    def bounded(self) -> bool:
        return self.kind >= _KNOWN or bool(np.isfinite(self.corners).all())

    def supports(self, directions: Floats) -> Floats | None:
        """Upper bounds (k,) of the supports along directions (k, n); None if the numbers are of too different sizes."""
        check_rounding()
        k, n = directions.shape
        values = np.empty(k)
        return values if _supports(n, k, self.found.tobytes(), directions.tobytes(), values) else None


def box_rows(lower: Floats, upper: Floats) -> tuple[Floats, Floats]:
    """Rows A (2 n, n) and b (2 n,) of a bounded box."""
    return both_ways(lower.size), np.concatenate([upper, 0.0 - lower])


@lru_cache(256)
def both_ways(n: int) -> Floats:
    """The axes of R^n and their opposites (2 n, n)."""
    axes = np.vstack([np.eye(n), -np.eye(n)])
    axes.setflags(write=False)
    return axes
