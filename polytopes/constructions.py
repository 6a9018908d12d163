"""Other sets from a set: methods that check their arguments and make a set of the rows that an operation gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from polytopes import motion, projection, reduction, slicing
from polytopes import support as support_functions
from polytopes.affine_hull import explicit, hull_of, made_explicit
from polytopes.affine_image import affine_image
from polytopes.approximation import Bracketed, Copy
from polytopes.checks import different_coordinates, real_array, real_number, whole_number
from polytopes.enclosing_zonotope import enclosing_zonotope, principal_axes
from polytopes.errors import EmptySetError, UnboundedError
from polytopes.fractions_given import exact_vector, hold_fractions
from polytopes.generators import rows_of_generators
from polytopes.inner_template import inner_template
from polytopes.intersection import rows_of_both
from polytopes.kept_vertices import moved, of_product
from polytopes.largest_copy import largest_copy
from polytopes.minkowski_sum import minkowski_sum
from polytopes.normalisation import normalised
from polytopes.outer_template import outer_template
from polytopes.polar import polar
from polytopes.pontryagin_difference import pontryagin_difference
from polytopes.preimage import preimage
from polytopes.product import product
from polytopes.redundancy import kept_rows, minimal_rows
from polytopes.rows import Rows, a_set, dense, nothing, same_space
from polytopes.shadow_within import bracket
from polytopes.shape import Shape
from polytopes.signatures import options_by_name
from polytopes.zonotopes import ConstrainedZonotope


class Constructions(Shape):
    """Sets made from a set."""

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
        return type(self)(*rows_of_both(self, same_space(self, Q)))

    def facets(self) -> list[Self]:
        """The facets, as sets: for each row of a minimal description, the set where it holds with equality.

        None of the empty set or an affine set; of a segment its ends.
        """
        if not support_functions.known_nonempty(self):
            return []
        return [type(self)(*made_explicit(self, [i]).table) for i in kept_rows(self).inequalities.tolist()]

    def polar(self) -> Self:
        """``{y : x'y <= 1 for all x in P}``: exact where its rows are floats, else outward.

        The whole space if P is empty.  Its own polar is the closure of the hull of P and the origin: P itself, if the
        origin is inside.

        Raises
        ------
        UndecidedError
            If the double description passes 10 000 rays.
        """
        return type(self)(*polar(self))

    def translate(self, t: ArrayLike | Sequence[Fraction]) -> Self:
        """``{x + t : x in P}``, t (n,): exact, right-hand sides that are no floats rounded up."""
        if hold_fractions(t):
            return type(self)(*motion.translation(self, exact_vector("t", t, self.dim)))
        shift = real_array("t", t, (self.dim,))
        return moved(self, type(self)(*motion.translation(self, shift)), np.eye(self.dim), shift)

    def scale(self, s: float | Fraction) -> Self:
        """``{s x : x in P}`` for any number s, exact or rounded up as `translate`; 0 gives the origin, or nothing."""
        if isinstance(s, Fraction):
            return type(self)(*motion.scaled(self, s))
        factor = real_number("s", s)
        made = type(self)(*motion.scaled(self, factor))
        return moved(self, made, factor * np.eye(self.dim), np.zeros(self.dim))

    def slice(self, fixed: Mapping[int, float | Fraction]) -> Self:
        """``{x_rest : x in P, x_j = v_j}``: the set where some coordinates are fixed, in the other coordinates.

        Exact; right-hand sides that are no floats are rounded up, and an equality then becomes two rows.

        Parameters
        ----------
        fixed : mapping of int to float
            Value of each fixed coordinate; at least one coordinate stays free.
        """
        if not isinstance(fixed, Mapping):
            raise TypeError(f"fixed is a {type(fixed).__name__}; expected a mapping: {{0: 0.5}} fixes coordinate 0.")
        coordinates = different_coordinates("fixed", list(fixed), self.dim) if fixed else []
        if len(coordinates) == self.dim:
            raise ValueError(f"fixed has all {self.dim} coordinates; expected one or more to stay free. Use `x in P`.")
        given = {j: fixed[j] for j in coordinates}
        values = {j: v if isinstance(v, Fraction) else real_number(f"fixed[{j}]", v) for j, v in given.items()}
        return type(self)(*slicing.slice_at(self, values))

    def lift(self, n: int, coordinates: Sequence[int] | None = None) -> Self:
        """The cylinder ``{x in R^n : x_coordinates in P}``: this set in a larger space, other coordinates free.

        Parameters
        ----------
        n : int
            Dimension of the larger space.
        coordinates : sequence of int, optional
            Where the coordinates of this set are in it; the first ones if absent.
        """
        wide = whole_number("n", n, least=self.dim)
        where = different_coordinates("coordinates", range(self.dim) if coordinates is None else coordinates, wide)
        if len(where) != self.dim:
            raise ValueError(f"coordinates is {where}; expected {self.dim}, one for each coordinate of this set.")
        return type(self)(*slicing.lifted(self, wide, where))

    def normalise(self) -> Self:
        """The same set by rows of length one, so that b and d are distances from the origin; no row of zeros.

        Numbers are rounded where they have to be: outward for a bounded set, which so lies in the result, and else to
        nearest.  An equality that is rounded outward becomes two rows, and a flat set so a slab of that width.
        """
        return type(self)(*normalised(self))

    def affine_hull(self) -> Self:
        """The smallest affine set that contains this one, by independent equalities; decided exactly (`affine_dim`).

        The whole space of a full-dimensional set; empty if this set is.
        """
        return type(self)(*hull_of(self))

    def product(self, Q: Rows) -> Self:
        """Cartesian product ``{(x, y) : x in P, y in Q}``."""
        return of_product(self, Q, type(self)(*product(self, a_set(Q))))

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
        matrix = real_array("M", dense(M), (self.dim, "k"), meaning="one row per coordinate of the set")
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
        matrix = real_array("M", dense(M), ("p", self.dim), meaning="one column per coordinate of the set")
        shift = (
            np.zeros(len(matrix)) if t is None else real_array("t", t, (len(matrix),), meaning="one entry per row of M")
        )
        return moved(self, type(self)(*affine_image(self, matrix, shift)), matrix, shift)

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

    def project_within(self, keep: Sequence[int], eps: float) -> Bracketed[Self]:
        """The projection on some coordinates between two sets: no facet of the inner one is off by more than `eps`.

        By supports, for bounded sets of many rows whose exact projection would have too many facets.  Flat sets, and
        shadows of one dimension, are projected exactly.

        Parameters
        ----------
        keep : sequence of int
            Different coordinates, at least one.
        eps : float
            A distance, in the units of x.

        Raises
        ------
        UnboundedError
            If the projection is unbounded.
        UndecidedError
            If the inner set is too thin for a hull in floats.
        """
        kept = different_coordinates("keep", keep, self.dim)
        found = bracket(self, kept, real_number("eps", eps, least=0.0))
        if found is None:
            exact = self.project(kept)
            return Bracketed(exact, exact, 0.0)
        nothing = np.empty((0, len(kept)))
        inner = type(self)(*rows_of_generators(found.points, nothing))
        return Bracketed(inner, type(self)(found.normals, found.offsets), found.gap)

    def largest_copy(self, Q: Rows) -> Copy[Self]:
        """The largest copy ``centre + scale Q`` in this set, to rounding; of a box, a template, any bounded set Q.

        One linear program; where several centres are as good, one of them.

        Raises
        ------
        EmptySetError
            If a set is empty.
        UnboundedError
            If Q is unbounded along a row of this set, or copies of any size fit in.
        """
        centre, scale = largest_copy(self, same_space(self, Q))
        copy = type(self)(*motion.scaled(Q, scale)).translate(centre)
        return Copy(copy, centre, scale)

    def inner_template(self, directions: ArrayLike) -> Self:
        """A set ``{x : T x <= h}`` in this bounded one, T being the directions (k, n): no larger h lies in it.

        Proved to lie inside, in rationals.  From the largest copy of ``{x : T x <= |T|}`` (one linear program) each
        face moves out as far as it goes, so that each alone is at its end to 1e-12 of the size; of all such sets it
        need not have the largest volume.  Of a flat set within its equalities, which the result then has too.

        Parameters
        ----------
        directions : array_like (k, n)
            Rows that hold a set: those of a box, an octagon, of another set.

        Raises
        ------
        ValueError
            If sets of such rows are unbounded.
        EmptySetError, UnboundedError
            If there is no such set.
        UndecidedError
            If the set is too thin for floats.
        """
        normals = real_array("directions", directions, ("k", self.dim))
        if not support_functions.known_nonempty(self):
            raise EmptySetError("the empty set has no set inside; ask is_empty() first.")
        if not self.is_bounded():
            raise UnboundedError("P is unbounded, so no set inside is largest; intersect it with a box first.")
        if self.affine_dim() == 0:
            return type(self)(*explicit(self).table)
        return type(self)(*inner_template(self, normals[normals.any(axis=1)]))

    def enclosing_zonotope(self, generators: ArrayLike | str = "box") -> ConstrainedZonotope:
        """A zonotope around a bounded set, its generators along those of a template; proved to contain it.

        Parameters
        ----------
        generators : {"box", "principal"} or array_like (n, g)
            "box": along the coordinates; "principal": along the principal axes of the vertices; or the columns of an
            array of rank n.  With g = n it is the smallest parallelotope along them, by supports; with g > n the sum of
            the lengths is least, by the vertices.  What has to be rounded is held by up to n more generators of the
            size of the rounding.

        Returns
        -------
        ConstrainedZonotope
            Without constraints.

        Raises
        ------
        EmptySetError, UnboundedError
            If there is none.
        ValueError
            If the generators do not span the space.
        UndecidedError
            If g > n and the set has too many vertices for rationals.
        """
        if isinstance(generators, str):
            if generators not in ("box", "principal"):
                raise ValueError(f"generators is {generators!r}; expected 'box', 'principal' or an array (n, g).")
            template = np.eye(self.dim) if generators == "box" else principal_axes(self)
        else:
            template = real_array("generators", generators, (self.dim, "g"), meaning="one row per coordinate")
        lengths = np.linalg.norm(template, axis=0)
        template, lengths = template[:, lengths > 0.0], lengths[lengths > 0.0]
        if np.linalg.matrix_rank(template / lengths) < self.dim:
            raise ValueError(f"generators span less than R^{self.dim}; expected columns that span it.")
        return ConstrainedZonotope(*enclosing_zonotope(self, template))

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
            return type(self)(*nothing(self.dim))
        return type(self)(*outer_template(self, normals))
