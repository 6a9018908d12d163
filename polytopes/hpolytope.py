"""`HPolytope`: the set ``{x : A x <= b, C x = d}`` as an immutable value; a thin face over the operations."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import containment, plotting, projection, reduction, sampling
from polytopes import support as support_functions
from polytopes.affine_hull import affine_dim
from polytopes.affine_image import affine_image
from polytopes.checks import Floats, different_coordinates, real_array, real_number, whole_number
from polytopes.emptiness import Emptiness
from polytopes.generators import Generators, generators, rows_of_generators
from polytopes.inner_box import inner_box
from polytopes.minkowski_sum import minkowski_sum
from polytopes.outer_template import outer_template
from polytopes.pontryagin_difference import pontryagin_difference
from polytopes.preimage import preimage
from polytopes.product import product
from polytopes.redundancy import minimal_rows
from polytopes.rows import Rows, a_set, same_space
from polytopes.shown import Picture, Shown
from polytopes.signatures import options_by_name
from polytopes.support import Ball, SupportResult
from polytopes.vertices import vertices
from polytopes.volume import volume


class HPolytope(Shown, Rows):
    """The polyhedron ``{x in R^n : A x <= b, C x = d}``.

    A value: its arrays are read-only copies of what was given, and every operation returns a new set.  Equalities are
    explicit, so a flat set is no special case.  Rows of zeros are allowed (``0'x <= -1`` is empty).

    Parameters
    ----------
    A, b : array_like (m, n) and (m,)
        Inequalities; m may be 0.
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
    """

    @classmethod
    def box(cls, lower: ArrayLike, upper: ArrayLike) -> Self:
        """``{x : lower <= x <= upper}``; infinite bounds give no row.

        Parameters
        ----------
        lower, upper : array_like (n,)
            A lower bound above its upper bound gives the empty set.
        """
        low = real_array("lower", lower, ("n",), finite=False)
        high = real_array("upper", upper, low.shape, meaning="the shape of lower", finite=False)
        if np.isposinf(low).any() or np.isneginf(high).any():
            raise ValueError("lower is +inf or upper is -inf somewhere; expected -inf, +inf or a finite bound.")
        axes = np.eye(low.size)
        above, below = np.isfinite(high), np.isfinite(low)
        box = cls(np.vstack([axes[above], -axes[below]]), np.concatenate([high[above], -low[below]]))
        _ = box.as_box  # at once: no question to it then has to look at its rows
        return box

    @classmethod
    def from_vertices(cls, V: ArrayLike, rays: ArrayLike | None = None) -> Self:
        """Convex hull of points V (k, n), k >= 1, plus the cone of the rays (r, n) if there are any.

        In integers where the numbers are short (multiples of one power of two, up to 2^32 times), where there are rays
        and where the points are flat: the rows are exact where they are floats.  Else by Qhull, in scaled coordinates.
        Rows that had to be rounded are rounded outward, so that every point satisfies them; points that are flat only
        to rounding are held in a slab.

        Raises
        ------
        UndecidedError
            If there are rays, and the double description passes 10 000 rows.
        """
        points = real_array("V", V, ("k", "n"))
        if 0 in points.shape:
            raise ValueError(f"V has shape {points.shape}; expected one or more points (none: HPolytope.empty).")
        n = points.shape[1]
        cone = np.empty((0, n)) if rays is None else real_array("rays", rays, ("r", n), meaning="as many columns as V")
        return cls(*rows_of_generators(points, cone))

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
        return cls(np.vstack([-np.eye(n), np.ones((1, n))]), np.append(np.zeros(n), 1.0))

    @classmethod
    def cross_polytope(cls, n: int) -> Self:
        """``{|x_1| + ... + |x_n| <= 1}``, 2^n rows."""
        signs = np.array(list(itertools.product([1.0, -1.0], repeat=whole_number("n", n, least=1))))
        return cls(signs, np.ones(len(signs)))

    def __repr__(self) -> str:
        equalities = f", {self.d.size} equalities" if self.d.size else ""
        return f"HPolytope(dim={self.dim}, {self.b.size} inequalities{equalities})"

    def _picture(self) -> Picture | None:
        if not support_functions.known_nonempty(self):
            return None
        return Picture(lambda ax: plotting.draw_shadow(self, ax))

    # questions

    def emptiness(self) -> Emptiness:
        """Is the set empty?  "nonempty" with a witness, "empty" with an exact certificate, or "undecided".

        Decided about the floats as they are: rows that contradict each other only by rounding are empty, and a set of
        width 1e-12 is not.  Microseconds where the set is fat or clearly empty, milliseconds of rational arithmetic
        where it is neither.
        """
        return self.decided

    def support(self, directions: ArrayLike) -> float | Floats:
        """Support function ``h(c) = max {c'x : x in P}``; some microseconds a direction in a batch, 30 for a call.

        Of a box a sum, without a program.

        Parameters
        ----------
        directions : array_like (n,) or (k, n)

        Returns
        -------
        float or array (k,)
            +inf where unbounded, -inf if the set is empty.  Never below the exact value, and above it by rounding only
            (some 1e-13 of the size of the set); equal to it where nothing is rounded: integers and short fractions.

        Raises
        ------
        UndecidedError
            If a program could not be settled.
        """
        return support_functions.support(self, directions)

    def support_points(self, directions: ArrayLike) -> SupportResult:
        """Values, maximisers and multipliers in k directions; see `SupportResult` and `support`."""
        return support_functions.support_points(self, directions)

    def bounding_box(self) -> tuple[Floats, Floats]:
        """Smallest box that contains the set: lower (n,) and upper (n,), infinite where unbounded.

        Rounded outward, as `support` is: every point of the set is in it.  2 n programs; of a box none.

        Raises
        ------
        EmptySetError
            If the set is empty.
        """
        return support_functions.bounding_box(self)

    def inner_box(self) -> tuple[Floats, Floats]:
        """A largest box inside a bounded set: lower (n,) and upper (n,); it satisfies the rows to rounding.

        First the largest one with the proportions of the bounding box (one linear program), then each face moved out
        as far as it goes, so that no larger box contains it; of all boxes inside, it need not have the largest volume.

        Raises
        ------
        EmptySetError, UnboundedError
            If there is no such box.
        """
        return inner_box(self)

    def chebyshev(self) -> Ball:
        """A largest ball in the set (within the affine set of the equalities): centre and radius, inf if unlimited.

        One linear program in n + 1 variables.

        Raises
        ------
        EmptySetError
            If the set is empty.
        """
        return support_functions.chebyshev(self)

    def is_bounded(self) -> bool:
        """Whether the set lies in some ball; the empty set does.  2 n programs, of a box none."""
        return support_functions.is_bounded(self)

    def affine_dim(self) -> int:
        """Dimension of the affine hull, decided exactly: 0 for a point, -1 for the empty set.

        Free where a ball fits in; rational arithmetic (milliseconds) where the set is flat or thinner than 1e-9.
        """
        return affine_dim(self)

    @options_by_name
    def contains(self, x: ArrayLike | Rows, *, tol: float = 1e-9) -> bool | NDArray[np.bool_]:
        """Whether a point (n,), each of k points (k, n), or a whole set lies inside.

        Parameters
        ----------
        x : array_like or HPolytope
        tol : float
            Nonnegative distance, in the units of x: every half-space and hyperplane may be missed by that much.  The
            test is in floats; with tol = 0 a point on the boundary may go either way.  A set costs one program a row.
        """
        slack = real_number("tol", tol, least=0.0)
        if isinstance(x, Rows):
            return containment.contains_set(self, same_space(self, x), slack)
        points = real_array("x", x, (self.dim,), ("k", self.dim))
        inside = containment.contains_points(self, np.atleast_2d(points), slack)
        return bool(inside[0]) if points.ndim == 1 else inside

    @options_by_name
    def equals(self, Q: Rows, *, tol: float = 1e-9) -> bool:
        """Whether this set and Q contain each other within `tol` (see `contains`)."""
        return containment.equal_sets(self, same_space(self, Q), real_number("tol", tol, least=0.0))

    def vertices(self) -> Floats:
        """Vertices of a bounded set, array (k, n); (0, n) if it is empty.

        In integers where the rows are short, or the set is flat or thin (and its vertices not too many), each rounded
        to the nearest floats.  Else Qhull on the dual of the minimal rows, then each vertex from its rows again;
        corners closer than 1e-9 of the size are one.  The number of vertices, and the cost, grow as m^(n/2).

        Raises
        ------
        UnboundedError
            If the set is unbounded.
        UndecidedError
            If the set is too thin for vertices in floats (below 1e-14 of its size).
        """
        return vertices(self)

    def generators(self) -> Generators:
        """Vertices, rays and lines of a nonempty set, bounded or not; see `Generators`.

        Raises
        ------
        EmptySetError
            If the set is empty.
        UndecidedError
            If it is unbounded and the double description passes 10 000 rays.
        """
        return generators(self)

    def volume(self) -> float:
        """n-dimensional volume: 0 for flat and empty sets, inf for unbounded full-dimensional ones (as `vertices`)."""
        return volume(self)

    def random_points(self, count: int, rng: np.random.Generator) -> Floats:
        """Points (count, n) of a bounded set, close to uniform: hit-and-run, 20 n steps of O(m n) between two points.

        `rng` is a `numpy.random.Generator`.

        Raises
        ------
        EmptySetError, UnboundedError
            If there are no points, or no uniform distribution on them.
        """
        if not isinstance(rng, np.random.Generator):
            raise TypeError(f"rng is a {type(rng).__name__}; expected a numpy.random.Generator: default_rng(seed).")
        return sampling.random_points(self, whole_number("count", count, least=0), rng)

    # other sets from this one

    def remove_redundancy(self) -> Self:
        """The same set by a minimal description: independent equalities and one row per facet.

        A row is dropped if the others imply it to within 1e-12 of its slack at the centre of the set.  Outward: the
        result contains the set, and a bounded set is at most 1 + 1e-12 times as large about that centre, whatever the
        scales of the axes; an unbounded one may also lose rows whose normals are combinations of others to within
        rounding (1e-14), and then grows by that angle.  Implicit equalities become explicit, decided exactly.  One
        program a row, over the facets only (Clarkson); a row that rounding leaves open is decided in rationals
        (milliseconds).
        """
        return type(self)(*minimal_rows(self))

    def intersection(self, Q: Rows) -> Self:
        """Points in both this set and Q: the rows of both, redundant ones too."""
        same_space(self, Q)
        inequalities = np.vstack([self.A, Q.A]), np.concatenate([self.b, Q.b])
        return type(self)(*inequalities, np.vstack([self.C, Q.C]), np.concatenate([self.d, Q.d]))

    def product(self, Q: Rows) -> Self:
        """Cartesian product ``{(x, y) : x in P, y in Q}``."""
        return type(self)(*product(self, a_set(Q)))

    def preimage(self, M: ArrayLike, t: ArrayLike | None = None) -> Self:
        """``{x : M x + t in P}``: rows multiplied out, outward where they had to be rounded.

        An equality that is rounded becomes two rows.  Of an unbounded preimage that passes 500 rays in integers rows
        are rounded to nearest.

        Parameters
        ----------
        M : array_like (n, k)
            Any matrix; the result lives in R^k.
        t : array_like (n,), optional
            Zero if absent.
        """
        matrix = real_array("M", M, (self.dim, "k"), meaning="one row per coordinate of the set")
        shift = np.zeros(self.dim) if t is None else real_array("t", t, (self.dim,))
        return type(self)(*preimage(self, matrix, shift))

    def affine_map(self, M: ArrayLike, t: ArrayLike | None = None) -> Self:
        """Image ``{M x + t : x in P}``.

        Parameters
        ----------
        M : array_like (p, n)
            Any matrix; a singular or flat one gives a flat image: with explicit equalities, where they are floats, else
            in a slab.  The image is exact where the set is computed with in integers (see the page "Polytopes") and
            the result is floats, and contains the exact one elsewhere.
        t : array_like (p,), optional
            Zero if absent.
        """
        matrix = real_array("M", M, ("p", self.dim), meaning="one column per coordinate of the set")
        shift = (
            np.zeros(len(matrix)) if t is None else real_array("t", t, (len(matrix),), meaning="one entry per row of M")
        )
        return type(self)(*affine_image(self, matrix, shift))

    def minkowski_sum(self, Q: Rows) -> Self:
        """``{x + y : x in P, y in Q}``: exact where both are computed with in integers, else outward.

        In integers the hull of all sums of vertices; else normals by Fourier-Motzkin from 2 n coordinates while that is
        cheap, then by the hull of all sums of vertices, and the sum of the supports along them.
        """
        return type(self)(*minkowski_sum(self, same_space(self, Q)))

    def pontryagin_difference(self, Q: Rows) -> Self:
        """``{x : x + y in P for all y in Q}``: one linear program per row; the whole space if Q is empty.

        An equality of P survives only if it is constant over Q (to 1e-12 of its size, unless all numbers are short).
        Supports are exact, and what remains rounded up, where the numbers are short or the result is nearly flat.
        """
        return type(self)(*pontryagin_difference(self, same_space(self, Q)))

    @options_by_name
    def project(
        self, keep: Sequence[int], *, method: str = "auto", max_rows: int = 20_000, outer: bool = False
    ) -> Self:
        """Projection ``{x_keep : x in P}``, exact, on the coordinates `keep` in their order.

        Equalities are solved for the other coordinates first, in rationals.

        Parameters
        ----------
        keep : sequence of int
            Different coordinates, at least one.
        method : {"auto", "fourier-motzkin", "convex-hull", "vertices"}
            "fourier-motzkin" works for every set and is fastest on sparse rows; "convex-hull" (a bounded shadow) costs
            by the facets of the result; "vertices" (a bounded set) by the vertices of this one.  "auto" takes
            the hull of the projected generators in integers, exact or outward, where rows are short or the set flat or
            thin, and they are at most 200; else it eliminates while a step forms, and the next is foreseen to form, at
            most 3000 rows; then it takes the vertices (at most 5 coordinates, or 6 and 4 or more kept) or the convex
            hull, if the set or its shadow is bounded.
        max_rows : int
            Limit on the rows that one step of Fourier-Motzkin may form.
        outer : bool
            At that limit return a superset (supports along the normals at hand) instead of raising.

        Raises
        ------
        ProjectionLimitError
            At the limit, without `outer`; the message holds the numbers.
        UnboundedError
            If the method needs a bounded set.
        UndecidedError
            If a hull was asked for and the set is too thin for one in floats.
        """
        kept = different_coordinates("keep", keep, self.dim)
        if method not in projection.METHODS:
            raise ValueError(f"method is {method!r}; expected one of {', '.join(projection.METHODS)}.")
        limit = whole_number("max_rows", max_rows, least=1)
        return type(self)(*projection.project(self, kept, method, limit, outer))

    def outer_reduce(self, max_facets: int) -> Self:
        """A superset with at most `max_facets` inequalities, bounded if this set is.

        Greedy: of the minimal rows, the one goes whose removal lets its own support grow least.  Some programs each.

        Parameters
        ----------
        max_facets : int
            At least twice the dimension.
        """
        most = whole_number("max_facets", max_facets, least=2 * self.dim)
        minimal = self.remove_redundancy()
        return minimal.with_rows(*reduction.reduced_rows(minimal, most))

    def outer_template(self, directions: ArrayLike) -> Self:
        """Smallest set ``{x : T x <= h}`` that contains this one, T being the directions (k, n).

        Normals along which this set is unbounded are left out; offsets are exact or rounded outward (see
        `upper_supports`).  One program a normal.
        """
        normals = real_array("directions", directions, ("k", self.dim))
        if not support_functions.known_nonempty(self):
            return type(self).empty(self.dim)
        return type(self)(*outer_template(self, normals))

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
