"""Questions about the shape of a set: faces, moments, ellipsoids, rays; a thin face over the operations."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import ellipsoids, incidence, moments, rays
from polytopes.checks import Floats, real_array
from polytopes.ellipsoids import Ellipsoid
from polytopes.incidence import Incidence
from polytopes.questions import Questions
from polytopes.rays import Chord
from polytopes.signatures import options_by_name
from polytopes.volume import volume


class Shape(Questions):
    """What shape a set has."""

    def incidence(self) -> Incidence:
        """Vertices and facets of a bounded set, which of them meet, and the faces that follow; exact.

        By the double description in integers, whatever the numbers are: for decimals it takes longer than `vertices`.

        Raises
        ------
        EmptySetError, UnboundedError
            If there are no vertices that describe the set.
        UndecidedError
            If the double description passes 10 000 rays.
        """
        return incidence.incidence(self)

    def adjacency(self) -> NDArray[np.bool_]:
        """Which vertices of a bounded set are joined by an edge: array (k, k), in the order of `incidence().vertices`.

        Exact; errors as of `incidence`.
        """
        return self.incidence().vertex_adjacency()

    def triangulate(self) -> list[Floats]:
        """Simplices whose union is the bounded set and whose interiors are disjoint: arrays (d + 1, n) of vertices.

        Without new points; d is the dimension of the set itself.  Errors as of `incidence`.
        """
        found = self.incidence()
        return [found.vertices[numbers] for numbers in found.simplices()]

    @overload
    def volume(self, *, relative: bool = False, exact: Literal[False] = False) -> float: ...

    @overload
    def volume(self, *, relative: Literal[False] = False, exact: Literal[True]) -> Fraction | float: ...

    @options_by_name
    def volume(self, *, relative: bool = False, exact: bool = False) -> Fraction | float:
        """n-dimensional volume: 0 for flat and empty sets, inf for unbounded full-dimensional ones (as `vertices`).

        Parameters
        ----------
        relative : bool
            Measure a flat set in its own dimension: the length of a segment, the area of a polygon in space; 1 for a
            point, inf for unbounded sets.
        exact : bool
            Return a `fractions.Fraction`, by a triangulation in rationals; not together with `relative`.
        """
        if relative and exact:
            raise ValueError("relative and exact are both true; expected one: lengths of flat sets are no fractions.")
        if exact:
            return moments.exact_volume(self)
        return moments.relative_volume(self) if relative else volume(self)

    def centroid(self) -> Floats:
        """The centre of mass (n,) of a bounded set, of a flat one in its own dimension; errors as of `incidence`."""
        return moments.centroid(self)

    def covariance(self) -> Floats:
        """The covariance (n, n) of the uniform distribution on a bounded set; errors as of `incidence`."""
        return moments.covariance(self)

    def inscribed_ellipsoid(self) -> Ellipsoid:
        """The ellipsoid of largest volume in a bounded set, of a flat one within its affine hull (cvxpy).

        It keeps the rows to rounding; its volume is largest to some 1e-6.

        Raises
        ------
        EmptySetError, UnboundedError
            If there is none.
        UndecidedError
            If the set is too thin for floats, or the solver did not end.
        """
        return ellipsoids.inscribed_ellipsoid(self)

    def enclosing_ellipsoid(self) -> Ellipsoid:
        """The ellipsoid of least volume around a bounded set, around a flat one within its affine hull.

        Every vertex is inside to rounding; the volume is least to 1e-9.  Errors as of `incidence`.
        """
        return ellipsoids.enclosing_ellipsoid(self)

    def ray_shoot(self, x: ArrayLike, v: ArrayLike) -> Chord | None:
        """Where the ray ``{x + t v : t >= 0}`` enters and leaves the set, and through which rows; None if it misses it.

        Decided in rationals, of any set.

        Parameters
        ----------
        x, v : array_like (n,)
            Where it begins, and its direction, not zero.
        """
        start, direction = real_array("x", x, (self.dim,)), real_array("v", v, (self.dim,))
        if not direction.any():
            raise ValueError("v is zero; expected a direction.")
        return rays.chord(self, start, direction)

    def gauge(self, x: ArrayLike) -> float | Floats:
        """Minkowski's gauge ``inf {s >= 0 : x in s P}`` of a point (n,) or of each of k points (k, n).

        At most 1 in a set with the origin inside, and exact up to the last rounding; inf where no multiple holds x.

        Parameters
        ----------
        x : array_like (n,) or (k, n)
        """
        points = real_array("x", x, (self.dim,), ("k", self.dim))
        values = rays.gauges(self, np.atleast_2d(points))
        return float(values[0]) if points.ndim == 1 else values
