"""Constrained zonotopes ``{c + G xi : |xi| <= 1, A xi = b}`` and their way from and to rows.

Every bounded set is one (Scott, Raimondo, Marseglia and Braatz 2016, Theorem 1): with its bounding box ``c + G xi`` and
sigma a lower bound of ``h'x`` over it, the row ``h'x <= k`` is the constraint
``h'G xi + (k - sigma) / 2 eta = (k + sigma) / 2 - h'c`` with one more generator eta, whose column in G is zero.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes.affine_image import affine_image
from polytopes.checks import Floats, real_array
from polytopes.errors import EmptySetError, UnboundedError
from polytopes.inclusion import strictest
from polytopes.integers import up
from polytopes.outer_supports import upper_supports
from polytopes.rows import Rows, Table, a_set, nothing
from polytopes.shown import Shown
from polytopes.support import bounding_box, is_bounded, known_nonempty
from polytopes.value import Value


@dataclass(frozen=True, eq=False)
class ConstrainedZonotope(Shown, Value):
    """``{centre + generators xi : |xi_j| <= 1, constraints xi = offset}``; a zonotope without constraints.

    Parameters
    ----------
    centre : array_like (n,)
    generators : array_like (n, g)
    constraints, offset : array_like (c, g) and (c,), optional

    Raises
    ------
    TypeError, ValueError
        If an array is not numeric and finite, or a shape does not fit.
    """

    centre: Floats
    generators: Floats
    constraints: Floats
    offset: Floats

    def __init__(
        self,
        centre: ArrayLike,
        generators: ArrayLike,
        constraints: ArrayLike | None = None,
        offset: ArrayLike | None = None,
    ) -> None:
        if (constraints is None) != (offset is None):
            raise ValueError("constraints and offset must be given together: constraints xi = offset.")
        middle = real_array("centre", centre, ("n",))
        G = real_array("generators", generators, (middle.size, "g"), meaning="one row per entry of centre")
        g = G.shape[1]
        A = np.empty((0, g)) if constraints is None else real_array("constraints", constraints, ("c", g))
        b = np.empty(0) if offset is None else real_array("offset", offset, (len(A),))
        for name, array in zip(("centre", "generators", "constraints", "offset"), (middle, G, A, b), strict=True):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def of(cls, P: Rows) -> Self:
        """A bounded set as a constrained zonotope with n + m generators and m + q constraints; right to rounding.

        Raises
        ------
        EmptySetError, UnboundedError
            If P is empty or unbounded.
        """
        if not known_nonempty(a_set(P, "P")):
            raise EmptySetError("the empty set is no constrained zonotope around a point; ask is_empty() first.")
        if not is_bounded(P):
            raise UnboundedError("P is unbounded, and zonotopes are not; intersect it with a box first.")
        lower, upper = bounding_box(P)
        centre = 0.5 * lower + 0.5 * upper
        G = np.diag(np.maximum(upper - centre, centre - lower))
        rows = P.A.any(axis=1)
        A, b = P.A[rows], P.b[rows]
        least = -upper_supports(P, -A)
        m, q = len(b), P.d.size
        constraints = np.block([[A @ G, np.diag(0.5 * (b - least))], [P.C @ G, np.zeros((q, m))]])
        offset = np.append(0.5 * (b + least) - A @ centre, P.d - P.C @ centre)
        return cls(centre, np.hstack([G, np.zeros((P.dim, m))]), constraints, offset)

    @property
    def dim(self) -> int:
        """Dimension n of the space."""
        return int(self.centre.size)

    def __repr__(self) -> str:
        c, g = self.constraints.shape
        return f"ConstrainedZonotope(dim={self.dim}, {g} generators, {c} constraints)"


def rows_of_zonotope(Z: ConstrainedZonotope) -> Table:
    """Rows of the image of ``{|xi| <= 1, A xi = b}`` under ``c + G xi``; exact or outward, as images are."""
    if not Z.generators.any():
        fixed = np.empty((0, Z.dim)), np.empty(0), np.eye(Z.dim), Z.centre
        return fixed if _has_point(Z) else nothing(Z.dim)
    kept, A, b, C, d = _without_slacks(Z)
    axes = np.eye(len(kept))
    cube = Rows(np.vstack([axes, -axes, A]), np.append(np.ones(2 * len(kept)), b), C, d)
    return affine_image(cube, Z.generators[:, kept], Z.centre)


def _has_point(Z: ConstrainedZonotope) -> bool:
    """Whether some ``|xi| <= 1`` keeps the constraints."""
    axes = np.eye(Z.generators.shape[1])
    if not axes.size:
        return not Z.offset.any()
    return known_nonempty(Rows(np.vstack([axes, -axes]), np.ones(2 * len(axes)), Z.constraints, Z.offset))


def _without_slacks(Z: ConstrainedZonotope) -> tuple[NDArray[np.int64], Floats, Floats, Floats, Floats]:
    """The generators that count, and ``{|xi| <= 1, A xi = b}`` as rows on these, repeated ones once, and equalities.

    A generator of zeros that one constraint has, ``a'xi + w eta = b``, only says that ``b - |w| <= a'xi <= b + |w|``.
    """
    used = np.count_nonzero(Z.constraints, axis=0)
    slack = np.flatnonzero(~Z.generators.any(axis=0) & (used <= 1))
    of_row = {int(np.flatnonzero(Z.constraints[:, j])[0]): int(j) for j in slack if used[j]}  # one a row: the last
    dropped = [int(j) for j in slack if not used[j]] + list(of_row.values())
    kept = np.setdiff1d(np.arange(Z.generators.shape[1]), dropped)
    loose = np.array(sorted(of_row), dtype=np.int64)
    rest = np.setdiff1d(np.arange(len(Z.offset)), loose)
    rows = Z.constraints[np.ix_(loose, kept)]
    widths = [abs(Fraction(Z.constraints[i, j])) for i, j in sorted(of_row.items())]
    sides = [Fraction(v) for v in Z.offset[loose].tolist()]
    above = [up(v + w) for v, w in zip(sides, widths, strict=True)]
    below = [up(w - v) for v, w in zip(sides, widths, strict=True)]
    A, b = strictest(np.vstack([rows, -rows]) + 0.0, np.array(above + below))
    return kept, A, b, Z.constraints[np.ix_(rest, kept)], Z.offset[rest]
