"""`HPolytope`: the set ``{x : A x <= b, C x = d}`` as an immutable value; a thin face over the operations."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from polytopes import exchange, plotting
from polytopes.checks import different_coordinates, real_array, whole_number
from polytopes.constructions import Constructions
from polytopes.fractions_given import box_of_fractions, hold_fractions
from polytopes.generators import hull_and_vertices, rows_of_fractions
from polytopes.kept_vertices import keeping, of_box, of_points
from polytopes.operators import Operators
from polytopes.piecewise import Union
from polytopes.shown import Picture, Shown
from polytopes.signatures import options_by_name
from polytopes.support import known_nonempty
from polytopes.zonotopes import ConstrainedZonotope, rows_of_zonotope


class HPolytope(Shown, Operators):
    """The polyhedron ``{x in R^n : A x <= b, C x = d}``.

    A value: its arrays are read-only copies of what was given, and every operation returns a new set.  Equalities are
    explicit, so a flat set is no special case.  Rows of zeros are allowed (``0'x <= -1`` is empty).

    Parameters
    ----------
    A, b : array_like (m, n) and (m,)
        Inequalities; m may be 0.  A and C may be sparse (SciPy).  A row whose b is +inf bounds nothing and is left out.
        Rows with a `fractions.Fraction` are multiplied by what makes integers of them, and so taken exactly.
    C, d : array_like (q, n) and (q,), optional
        Equalities.

    Raises
    ------
    TypeError, ValueError
        If an array is not numeric and finite, or a shape does not fit.

    Notes
    -----
    Whether the set is empty is decided about exactly the floats that were given (see `emptiness`).  Supports
    and boxes are rounded outward, and every other number is computed in floats from true vertices.  Coordinates and
    rows are put into even units inside, so powers of two on them change nothing (see *Units* in the guide).

    Operators, all exact or outward as the methods are: ``P & Q`` (intersection), ``P | Q`` (a `Union`), ``P + Q`` and
    ``P + t`` (Minkowski sum, translation), ``P - Q`` (Pontryagin difference), ``M @ P`` (image), ``-P``, ``s * P``,
    ``P ** k`` (product with itself).  Decided about the floats as they are, without a tolerance: ``x in P``, ``P <= Q``
    (P lies in Q) and ``P == Q`` (the same set); they raise `UndecidedError` where that cannot be decided.  Sets have no
    hash.
    """

    @classmethod
    def box(cls, lower: ArrayLike, upper: ArrayLike) -> Self:
        """``{x : lower <= x <= upper}``; infinite bounds give no row.

        Parameters
        ----------
        lower, upper : array_like (n,)
            A lower bound above its upper bound gives the empty set.  Fractions are taken exactly.
        """
        if hold_fractions(lower, upper):
            return cls(*box_of_fractions(lower, upper))
        low = real_array("lower", lower, ("n",), finite=False)
        high = real_array("upper", upper, low.shape, meaning="the shape of lower", finite=False)
        if np.isposinf(low).any() or np.isneginf(high).any():
            raise ValueError("lower is +inf or upper is -inf somewhere; expected -inf, +inf or a finite bound.")
        axes = np.eye(low.size)
        above, below = np.isfinite(high), np.isfinite(low)
        box = cls(np.vstack([axes[above], 0.0 - axes[below]]), np.concatenate([high[above], 0.0 - low[below]]))
        _ = box.as_box  # at once: no question to it then has to look at its rows
        return keeping(box, partial(of_box, low, high))

    @classmethod
    def from_vertices(cls, V: ArrayLike, rays: ArrayLike | None = None) -> Self:
        """Convex hull of points V (k, n), k >= 1, plus the cone of the rays (r, n) if there are any.

        In integers where the numbers are short (multiples of one power of two, up to 2^32 times), where there are rays
        and where the points are flat: the rows are exact where they are floats.  Else by Qhull, in scaled coordinates.
        Rows that had to be rounded are rounded outward, so that every point satisfies them; points that are flat only
        to rounding are held in a slab.  Points with a `fractions.Fraction` are taken exactly, in integers.

        Raises
        ------
        UndecidedError
            If there are rays, and the double description passes 10 000 rows.
        """
        if hold_fractions(V, rays):
            return cls(*rows_of_fractions(V, rays))
        points = real_array("V", V, ("k", "n"))
        if 0 in points.shape:
            raise ValueError(f"V has shape {points.shape}; expected one or more points (none: HPolytope.empty).")
        n = points.shape[1]
        cone = np.empty((0, n)) if rays is None else real_array("rays", rays, ("r", n), meaning="as many columns as V")
        rows, find = hull_and_vertices(points, cone)
        return cls(*rows) if find is None else keeping(cls(*rows), find)

    @classmethod
    def from_zonotope(cls, Z: ConstrainedZonotope) -> Self:
        """The set of a zonotope or a constrained zonotope Z: an image of a cut cube, exact or outward as images are."""
        if not isinstance(Z, ConstrainedZonotope):
            raise TypeError(f"Z is a {type(Z).__name__}; expected a ConstrainedZonotope.")
        return cls(*rows_of_zonotope(Z))

    @classmethod
    def empty(cls, n: int) -> Self:
        """The empty set of R^n, as ``0'x <= -1``."""
        return cls(np.zeros((1, whole_number("n", n, least=1))), [-1.0])

    @classmethod
    def whole_space(cls, n: int) -> Self:
        """R^n: no rows."""
        return cls(np.empty((0, whole_number("n", n, least=1))), np.empty(0))

    @classmethod
    def simplex(cls, n: int) -> Self:
        """``{x >= 0, x_1 + ... + x_n <= 1}`` in n dimensions."""
        n = whole_number("n", n, least=1)
        simplex = cls(np.vstack([0.0 - np.eye(n), np.ones((1, n))]), np.append(np.zeros(n), 1.0))
        return keeping(simplex, lambda: of_points(np.vstack([np.zeros(n), np.eye(n)])))

    @classmethod
    def cross_polytope(cls, n: int) -> Self:
        """``{|x_1| + ... + |x_n| <= 1}``, 2^n rows; n at most 20."""
        if whole_number("n", n, least=1) > 20:
            raise ValueError(f"n is {n}; expected at most 20: a cross-polytope has 2^n rows.")
        signs = np.array(list(itertools.product([1.0, -1.0], repeat=n)))
        return keeping(cls(signs, np.ones(len(signs))), lambda: of_points(np.vstack([np.eye(n), -np.eye(n)])))

    def __repr__(self) -> str:
        equalities = f", {self.d.size} equalities" if self.d.size else ""
        return f"HPolytope(dim={self.dim}, {self.b.size} inequalities{equalities})"

    def _picture(self) -> Picture | None:
        if not known_nonempty(self):
            return None
        return Picture(lambda ax: plotting.draw_shadow(self, ax))

    def difference(self, Q: Constructions | Union) -> Union:
        """The closure of ``{x in P : x not in Q}`` as a union of sets whose interiors are disjoint.  Exact.

        Parameters
        ----------
        Q : HPolytope or Union
        """
        return Union([self]).difference(Q)

    def __or__(self, Q: Constructions | Union) -> Union:
        return Union([self]) | Q if isinstance(Q, Constructions | Union) else NotImplemented

    def to_dict(self) -> dict[str, Any]:
        """The dimension and the rows, each number exactly as ``"numerator/denominator"``, as JSON can hold it."""
        return exchange.as_dict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """The set of ``data``, what `to_dict` wrote; numbers may stand for themselves too.

        Raises
        ------
        ValueError
            If a part is missing, or an entry is no number, or one that no float equals.
        """
        return cls(*exchange.table_from_dict(data))

    def to_cvxpy(self, x: Any) -> list[Any]:
        """Constraints ``A x <= b`` and ``C x == d`` on a cvxpy expression x of shape (n,).

        Raises
        ------
        ValueError
            If x has another shape.
        """
        return exchange.cvxpy_constraints(self, x)

    def to_linear_constraint(self) -> Any:
        """A `scipy.optimize.LinearConstraint`, an equality with both bounds alike."""
        return exchange.linear_constraint(self)

    @options_by_name
    def plot(self, ax: Any = None, *, dims: Sequence[int] = (0, 1), **style: Any) -> list[Any]:
        """Draw the projection on two or three coordinates; returns the matplotlib artists.

        An unbounded set is cut at a box, a flat one is a face, a line or a point, and the empty set draws nothing.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            New axes if absent; for three coordinates they must be 3-D.
        dims : two or three ints
            The coordinates on the axes.
        **style
            Passed to the matplotlib patch.
        """
        axes = tuple(different_coordinates("dims", dims, self.dim))
        if len(axes) not in (2, 3):
            raise ValueError(f"dims is {axes}; expected two or three coordinates.")
        return plotting.plot(self, ax, axes, style)
