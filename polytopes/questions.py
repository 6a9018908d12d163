"""What can be asked of a set: methods that check their arguments and call the operation on rows."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import containment, sampling, separation
from polytopes import distance as distances
from polytopes import support as support_functions
from polytopes.affine_hull import affine_dim
from polytopes.checks import Floats, real_array, real_number, whole_number
from polytopes.containment import Containment
from polytopes.distance import Distance
from polytopes.emptiness import Emptiness
from polytopes.generators import Generators, exact_vertices, generators
from polytopes.inner_box import inner_box
from polytopes.outer_supports import exact_support
from polytopes.redundancy import KeptRows, kept_rows
from polytopes.rows import Rows, same_space
from polytopes.separation import Intersects
from polytopes.signatures import options_by_name
from polytopes.support import Ball, SupportResult
from polytopes.vertices import vertices


class Questions(Rows):
    """Questions to a set."""

    def emptiness(self) -> Emptiness:
        """Is the set empty?  "nonempty" with a witness, "empty" with an exact certificate, or "undecided".

        Decided about the floats as they are: rows that contradict each other only by rounding are empty, and a set of
        width 1e-12 is not.  Microseconds where the set is fat or clearly empty, milliseconds of rational arithmetic
        where it is neither.
        """
        return self.decided

    def is_empty(self) -> bool:
        """Whether the set has no point, as `emptiness` decides it.

        Raises
        ------
        UndecidedError
            If that could be neither proved nor refuted.
        """
        return not support_functions.known_nonempty(self)

    @overload
    def support(self, directions: ArrayLike, *, exact: Literal[False] = False) -> float | Floats: ...

    @overload
    def support(self, directions: ArrayLike, *, exact: Literal[True]) -> Fraction | float | list[Fraction | float]: ...

    @options_by_name
    def support(
        self, directions: ArrayLike, *, exact: bool = False
    ) -> float | Floats | Fraction | list[Fraction | float]:
        """Support function ``h(c) = max {c'x : x in P}``; some microseconds a direction in a batch, 30 for a call.

        Of a box a sum, without a program.

        Parameters
        ----------
        directions : array_like (n,) or (k, n)
        exact : bool
            Return `fractions.Fraction`, or a list of k; milliseconds each.

        Returns
        -------
        float or array (k,)
            +inf where unbounded, -inf if the set is empty.  Never below the exact value, and above it by rounding only:
            some 1e-15 of the size of the set, up to 1e-11 where rows nearly repeat; equal to it where nothing is
            rounded, as of boxes (``exact=True``: always).

        Raises
        ------
        UndecidedError
            If a program could not be settled.
        """
        if not exact:
            return support_functions.support(self, directions)
        rows = real_array("directions", directions, (self.dim,), ("k", self.dim))
        values = [exact_support(self, row) for row in np.atleast_2d(rows)]
        return values[0] if rows.ndim == 1 else values

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

    @options_by_name
    def inner_box(self, *, by_volume: bool = False) -> tuple[Floats, Floats]:
        """A largest box inside a bounded set: lower (n,) and upper (n,); it lies in the set, decided exactly.

        First the largest one with the proportions of the bounding box (one linear program), or that of largest volume,
        then each face moved out as far as it goes, so that no larger box contains it.  In a set that is flat or thin
        askew, where no box of floats is, it satisfies the rows to rounding.

        Parameters
        ----------
        by_volume : bool
            The box of largest volume, to some 1e-6 of it, by a convex program (cvxpy); over the coordinates that a flat
            set leaves free.

        Raises
        ------
        EmptySetError, UnboundedError
            If there is no such box.
        UndecidedError
            If the convex program did not end.
        """
        return inner_box(self, by_volume)

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
    def contains(self, x: ArrayLike | Rows, *, tol: float = 1e-9) -> bool | NDArray[np.bool_] | Containment:
        """Whether a point (n,), each of k points (k, n), or a whole set lies inside.

        Parameters
        ----------
        x : array_like or HPolytope
        tol : float
            Nonnegative distance, in the units of x: every half-space and hyperplane may be missed by that much.  The
            test is in floats; with tol = 0 a point on the boundary may go either way (``x in P`` and ``Q <= P`` are
            decided exactly).  A set costs one program a row.

        Returns
        -------
        bool, array (k,) of bool, or Containment
            For a set, true or false in an ``if``, with a point of it outside and the row that this breaks.
        """
        slack = real_number("tol", tol, least=0.0)
        if isinstance(x, Rows):
            return containment.contains_set(self, same_space(self, x), slack)
        points = real_array("x", x, (self.dim,), ("k", self.dim))
        inside = containment.contains_points(self, np.atleast_2d(points), slack)
        return bool(inside[0]) if points.ndim == 1 else inside

    def intersects(self, Q: Rows) -> Intersects:
        """Whether this set and Q have a common point, decided exactly: true or false in an ``if``.

        With a common point, or a plane between the sets whose proof ``verify(P, Q)`` checks in rationals.

        Raises
        ------
        UndecidedError
            If that could not be decided.
        """
        return separation.intersects(self, same_space(self, Q))

    def closest_point(self, x: ArrayLike) -> Floats:
        """The point (n,) of the set with the least Euclidean distance from x (n,).

        By an active set; its rows are then solved for in rationals, so that the point is right to rounding.

        Raises
        ------
        EmptySetError
            If the set is empty.
        """
        return distances.closest_point(self, real_array("x", x, (self.dim,)))

    @options_by_name
    def distance(self, x: ArrayLike | Rows, *, norm: float = 2) -> Distance:
        """``min |y - x|`` over the points y of this set, from a point (n,) or from all points x of a set.

        Parameters
        ----------
        x : array_like (n,) or HPolytope
        norm : {2, 1, numpy.inf}
            2: a quadratic program by an active set; 1 and inf: a linear program.

        Returns
        -------
        Distance
            A float, 0 exactly if they meet and inf if a set is empty, with the points that it is between and bounds.
        """
        kind = _norm(norm)
        if isinstance(x, Rows):
            return distances.distance_to_set(self, same_space(self, x), kind)
        return distances.distance_to_point(self, real_array("x", x, (self.dim,)), kind)

    @options_by_name
    def hausdorff(self, Q: Rows, *, norm: float = 2) -> float:
        """The distance that no point of one set is farther from the other: ``max(max_P d(x, Q), max_Q d(x, P))``.

        One distance for each vertex of both.  Unbounded sets are at a finite distance if they have the same rays and
        lines, decided exactly; two empty sets are at distance 0, and one is at distance inf from any other set.

        Parameters
        ----------
        Q : HPolytope
        norm : {2, 1, numpy.inf}
        """
        return distances.hausdorff(self, same_space(self, Q), _norm(norm))

    @options_by_name
    def equals(self, Q: Rows, *, tol: float = 1e-9) -> bool:
        """Whether this set and Q contain each other within `tol` (see `contains`)."""
        return containment.equal_sets(self, same_space(self, Q), real_number("tol", tol, least=0.0))

    def minimal_rows(self) -> KeptRows:
        """Numbers of the rows that `remove_redundancy` keeps: facets, equalities, and inequalities that became such.

        Raises
        ------
        EmptySetError
            If the set is empty.
        """
        return kept_rows(self)

    @overload
    def vertices(self, *, exact: Literal[False] = False) -> Floats: ...

    @overload
    def vertices(self, *, exact: Literal[True]) -> list[tuple[Fraction, ...]]: ...

    @options_by_name
    def vertices(self, *, exact: bool = False) -> Floats | list[tuple[Fraction, ...]]:
        """Vertices of a bounded set, array (k, n); (0, n) if it is empty.

        In integers where the rows are short, or the set is flat or thin (and its vertices not too many), each rounded
        to the nearest floats.  Else along the edges from vertex to vertex, with a proof that all are found, where n
        rows meet in each and no other row is nearer than 1e-9 of the size.  Else by the double description in floats,
        every sign told by a bound, or Qhull on the dual of the minimal rows, then each vertex from its rows again;
        corners closer than 1e-9 of the size are one, and one that is so near to the hull of the others may be left out.
        The number of vertices, and the cost, grow as m^(n/2).

        Parameters
        ----------
        exact : bool
            Return k tuples of n `fractions.Fraction`, by the double description in integers, in the order of their
            numbers.

        Raises
        ------
        UnboundedError
            If the set is unbounded.
        UndecidedError
            If the set is too thin for vertices in floats (below 1e-14 of its size).
        """
        return exact_vertices(self) if exact else vertices(self)

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


def _norm(norm: float) -> float:
    """1, 2 or inf; ValueError otherwise."""
    kind = real_number("norm", norm, finite=False)
    if kind not in distances.NORMS:
        raise ValueError(f"norm is {norm!r}; expected 1, 2 or numpy.inf.")
    return kind
