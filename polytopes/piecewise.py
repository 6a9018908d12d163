"""`Union`: a set that need not be convex, as polytopes that it consists of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import containment, plotting
from polytopes.checks import Floats, different_coordinates, listed, real_array, real_number
from polytopes.constructions import Constructions
from polytopes.convex_union import convex_union, merged
from polytopes.errors import EmptySetError
from polytopes.rows import Rows
from polytopes.set_difference import disjoint, remainder
from polytopes.shown import Picture, Shown
from polytopes.signatures import options_by_name
from polytopes.support import bounding_box, known_nonempty
from polytopes.volume import volume


class Union(Shown):
    """A union of closed polyhedra of one dimension; which may overlap.

    A value, as the sets in it are.  What is asked of it is decided about the rows as they are, without a tolerance,
    and no result is rounded, unless a method says so.

    Parameters
    ----------
    pieces : sequence of HPolytope
        At least one; empty ones are left out, unless all are.

    Raises
    ------
    TypeError, ValueError
        If a piece is no set, or the dimensions differ.
    UndecidedError
        If it is open whether a piece is empty.
    """

    __hash__ = None  # type: ignore[assignment]  # as of sets
    __array_ufunc__ = None  # numpy and pandas leave operators to it
    __pandas_priority__ = 5000

    def __init__(self, pieces: Sequence[Constructions]) -> None:
        given = listed("pieces", pieces, Constructions, called="HPolytope")
        if not given:
            raise ValueError("pieces is empty; expected at least one HPolytope, HPolytope.empty(n) for the empty set.")
        for P in given:
            if P.dim != given[0].dim:
                raise ValueError(f"pieces have dimensions {given[0].dim} and {P.dim}; expected one dimension.")
        self._pieces = tuple(P for P in given if known_nonempty(P)) or (given[0],)

    @property
    def pieces(self) -> tuple[Any, ...]:
        """The sets that it consists of, none of them empty unless all is."""
        return self._pieces

    @property
    def dim(self) -> int:
        """Dimension n of the space."""
        return self._pieces[0].dim

    def __repr__(self) -> str:
        return f"Union(dim={self.dim}, {len(self._pieces)} piece{'s' if len(self._pieces) > 1 else ''})"

    def _picture(self) -> Picture | None:
        return None if self.is_empty() or self.dim == 1 else Picture(lambda ax: self.plot(ax))

    def is_empty(self) -> bool:
        """Whether it has no point."""
        return not known_nonempty(self._pieces[0])

    @options_by_name
    def contains(self, x: ArrayLike | Constructions | Union, *, tol: float = 1e-9) -> bool | NDArray[np.bool_]:
        """Whether a point (n,) or each of k points (k, n) lies in a piece; or whether a set or a union is covered.

        Parameters
        ----------
        x : array_like, HPolytope or Union
        tol : float
            Of points: nonnegative distance, in the units of x, by which half-spaces may be missed.  That a set is
            covered is decided exactly, whatever `tol` is.
        """
        slack = real_number("tol", tol, least=0.0)
        if isinstance(x, Rows | Union):
            return not remainder(self._same_space(x), self._pieces)
        points = real_array("x", x, (self.dim,), ("k", self.dim))
        batch = np.atleast_2d(points)
        inside = np.any([containment.contains_points(P, batch, slack) for P in self._pieces], axis=0)
        return bool(inside[0]) if points.ndim == 1 else np.asarray(inside)

    def __contains__(self, x: Any) -> bool:
        return any(x in P for P in self._pieces)  # type: ignore[operator]

    def __le__(self, other: Constructions | Union) -> bool:
        if not isinstance(other, Rows | Union):
            return NotImplemented
        return not remainder(self._pieces, self._same_space(other))

    def __ge__(self, other: Constructions | Union) -> bool:
        return bool(self.contains(other)) if isinstance(other, Rows | Union) else NotImplemented

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Constructions | Union):
            return NotImplemented
        return self.dim == other.dim and self <= other and self >= other

    def __or__(self, other: Constructions | Union) -> Union:
        return Union([*self._pieces, *self._same_space(other)]) if isinstance(other, Rows | Union) else NotImplemented

    __ror__ = __or__

    def __and__(self, other: Constructions | Union) -> Union:
        if not isinstance(other, Rows | Union):
            return NotImplemented
        return Union([P.intersection(Q) for P in self._pieces for Q in self._same_space(other)])

    __rand__ = __and__

    def difference(self, Q: Constructions | Union) -> Union:
        """The closure of what is left without a set or a union Q, by pieces whose interiors are disjoint if these are.

        Exact.  The number of pieces may grow with the product of the numbers of rows.
        """
        left = remainder(self._pieces, self._same_space(Q))
        return Union(left or [type(self._pieces[0]).empty(self.dim)])  # type: ignore[attr-defined]

    def complement(self, within: Constructions) -> Union:
        """The closure of what is in the set `within`, and not in this union."""
        return Union([within]).difference(self)

    def disjoint(self) -> Union:
        """The same union by pieces whose interiors are disjoint."""
        return Union(disjoint(self._pieces))

    def volume(self) -> float:
        """n-dimensional volume: the sum over `disjoint` pieces; each as `HPolytope.volume`."""
        return float(sum(volume(P) for P in disjoint(self._pieces)))

    def is_convex(self) -> bool:
        """Whether the union is convex, decided exactly (Bemporad, Fukuda and Torrisi 2001)."""
        return convex_union(self._pieces) is not None

    def merge(self) -> Union:
        """The same union by fewer pieces: pairs whose union is convex become one (greedily); exact."""
        return Union(merged(self._pieces))

    def bounding_box(self) -> tuple[Floats, Floats]:
        """Smallest box that contains it: lower (n,) and upper (n,); rounded outward, as of sets.

        Raises
        ------
        EmptySetError
            If it is empty.
        """
        if self.is_empty():
            raise EmptySetError("the empty union has no bounding box; ask is_empty() first.")
        lower, upper = zip(*map(bounding_box, self._pieces), strict=True)
        return np.min(lower, axis=0), np.max(upper, axis=0)

    @options_by_name
    def plot(self, ax: Any = None, *, dims: Sequence[int] = (0, 1), **style: Any) -> list[Any]:
        """Draw the projections of all pieces in one colour; returns the matplotlib artists.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            New axes if absent.
        dims : two or three ints
            The coordinates on the axes.
        **style
            Passed to the matplotlib patches.
        """
        axes = tuple(different_coordinates("dims", dims, self.dim))
        if len(axes) not in (2, 3):
            raise ValueError(f"dims is {axes}; expected two or three coordinates.")
        return plotting.plot_all(self._pieces, ax, axes, style)

    def _same_space(self, other: Constructions | Union) -> Sequence[Constructions]:
        """The pieces of another set or union of this dimension."""
        if not isinstance(other, Constructions | Union):
            raise TypeError(f"Q is a {type(other).__name__}; expected an HPolytope or a Union.")
        if other.dim != self.dim:
            raise ValueError(f"Q has dimension {other.dim}; expected {self.dim}, the dimension of this union.")
        return other.pieces if isinstance(other, Union) else (other,)
