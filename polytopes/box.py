"""Boxes: sets whose rows have one entry each.  What they are asked most needs no program.

Bounds are quotients, rounded outward by less than one unit of the last place where they are no floats; supports are
sums of products in twice the working precision, rounded up.
"""

from typing import NamedTuple, Self

import numpy as np

from polytopes.checks import Floats
from polytopes.native import Entries, Given, Integer, function
from polytopes.rounding import check_rounding

_box = function("fdi_box", *[Integer] * 2, *[Given] * 2, Entries, returns=Integer)
_supports = function("fdi_box_supports", *[Integer] * 2, *[Given] * 2, Entries, returns=Integer)


class Box(NamedTuple):
    """A box that is not empty.

    Attributes
    ----------
    corners : array (2, n)
        Lower and upper, rounded outward; infinite where there is no row.
    point : array (n,)
        Satisfies every row exactly.
    """

    corners: Floats
    point: Floats

    @classmethod
    def of(cls, A: Floats, b: Floats, C: Floats) -> Self | None:
        """The box of rows ``A x <= b``, ``C x = d``; None if they are none, or empty, or far from the origin."""
        check_rounding()
        m, n = A.shape
        if len(C) or np.count_nonzero(A) > m:
            return None
        bounds = np.empty((5, n))
        return cls(bounds[:2], bounds[2]) if _box(m, n, A, b, bounds) else None

    @property
    def bounded(self) -> bool:
        return np.count_nonzero(np.isfinite(self.corners)) == self.corners.size

    def supports(self, directions: Floats) -> Floats | None:
        """Upper bounds (k,) of the supports along directions (k, n); None if the numbers are of too different sizes."""
        check_rounding()
        k, n = directions.shape
        values = np.empty(k)
        return values if _supports(n, k, self.corners, directions, values) else None
