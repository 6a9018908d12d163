"""Constrained zonotopes whose every operation is an outer approximation, the rounding of floats included.

Scott, Raimondo, Marseglia and Braatz (Automatica 69, 2016): {c + G xi : |xi| <= 1, A xi = b}. Here two diagonal blocks
of generators are kept apart, ``room`` in the space of the set and ``slack`` in the constraints. They absorb what an
operation rounds, and what a reduction gives away.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from polytopes.shown import Shown
from svo.checks import Array

EPS = float(np.finfo(np.float64).eps)
TINY = float(np.finfo(np.float64).tiny)  # covers what underflow takes from a sum
FAR = 2.0**100
_PIVOT = 1e-12  # of a constraint's terms: smaller coefficients imply nothing of use about their xi


def unit(terms: int) -> float:
    """Relative to the sum of magnitudes, an upper bound of the rounding of a sum of so many products (doubled)."""
    return 2.0 * (terms + 8) * EPS


@dataclass(frozen=True, eq=False)
class ConstrainedZonotope(Shown):
    """{c + G xi + v : |xi| <= 1, |v| <= room, |A xi - b| <= slack}.

    In the form of Scott et al. (2016) the generators are [G diag(room) 0] and the constraints [A 0 diag(slack)].

    Attributes
    ----------
    center, room : (n,) arrays
    generators : (n, ng) array
    constraints : (nc, ng) array
    offset, slack : (nc,) arrays
    """

    center: Array
    generators: Array
    room: Array
    constraints: Array
    offset: Array
    slack: Array

    @classmethod
    def box(cls, lower: Array, upper: Array) -> ConstrainedZonotope:
        """The smallest one around a finite box."""
        n = len(lower)
        center = 0.5 * lower + 0.5 * upper
        half = np.maximum(upper - center, center - lower)
        room = unit(1) * (np.abs(center) + half) * (upper > lower)
        return cls(center, np.diag(half), room, np.zeros((0, n)), np.zeros(0), np.zeros(0))

    @property
    def dim(self) -> int:
        return self.center.size

    def interval_hull(self) -> tuple[Array, Array]:
        """Bounds (lower, upper) of every coordinate, constraints left out."""
        return _rounded_ball(self.center, np.abs(self.generators).sum(axis=1) + self.room, self.generators.shape[1])

    def affine_map(self, M: Array, t: Array) -> ConstrainedZonotope:
        """{M x + t}.

        Parameters
        ----------
        M, t : (m, n), (m,) arrays
        """
        size = np.abs(M)
        reach = np.abs(self.center) + np.abs(self.generators).sum(axis=1)
        rounding = unit(self.dim + self.generators.shape[1]) * (size @ (reach + self.room) + np.abs(t)) + TINY
        return replace(
            self,
            center=M @ self.center + t,
            generators=M @ self.generators,
            room=size @ self.room + rounding,
        )

    def cut(self, rows: Array, lower: Array, upper: Array) -> ConstrainedZonotope:
        """Points with lower <= rows x <= upper; the new constraints come last.

        Parameters
        ----------
        rows : (k, n) array
        lower, upper : (k,) arrays
            An infinite one is replaced by the bound of the row over the interval hull.
        """
        size = np.abs(rows)
        reach = np.abs(self.center) + np.abs(self.generators).sum(axis=1) + self.room
        known, terms = rows @ self.center, size @ reach
        spread = np.abs(rows @ self.generators).sum(axis=1) + size @ self.room
        rounding = unit(self.dim + self.generators.shape[1]) * terms + TINY
        room = spread + 2.0 * rounding
        far = FAR * (1.0 + room)  # beyond it a bound that nothing satisfies excludes no less, and overflows nothing
        low = np.clip(np.where(np.isfinite(lower), lower - known, -room), -far, far)
        high = np.clip(np.where(np.isfinite(upper), upper - known, room), -far, far)
        half = 0.5 * (high - low) + size @ self.room + rounding + 4.0 * EPS * (np.abs(low) + np.abs(high))
        return replace(
            self,
            constraints=np.vstack([self.constraints, rows @ self.generators]),
            offset=np.concatenate([self.offset, 0.5 * (low + high)]),
            slack=np.concatenate([self.slack, half]),
        )

    def product_box(self, lower: Array, upper: Array) -> ConstrainedZonotope:
        """{(x, w) : lower <= w <= upper}; the new generators come last."""
        other = ConstrainedZonotope.box(lower, upper)
        return self.extended(np.zeros((other.dim, self.dim)), other)

    def extended(self, M: Array, other: ConstrainedZonotope) -> ConstrainedZonotope:
        """{(x, M x + v) : v in another zonotope without constraints}; its generators come last."""
        image = self.affine_map(M, other.center)
        k = other.generators.shape[1]
        return ConstrainedZonotope(
            center=np.concatenate([self.center, image.center]),
            generators=np.block(
                [[self.generators, np.zeros((self.dim, k))], [image.generators, other.generators]]
            ),
            room=np.concatenate([self.room, image.room + other.room]),
            constraints=np.hstack([self.constraints, np.zeros((len(self.offset), k))]),
            offset=self.offset,
            slack=self.slack,
        )  # fmt: skip

    def grown(self, room: Array) -> ConstrainedZonotope:
        """With so much more room (n,) in every coordinate."""
        return replace(self, room=self.room + room)

    def implied(self) -> tuple[Array, Array]:
        """Bounds (lower, upper), each (ng,), of xi that the constraints imply, by two rounds of interval arithmetic.

        Scott et al. (2016), section 4.2. Where they contradict each other the bounds are -1 and 1.
        """
        lower, upper = -np.ones(self.generators.shape[1]), np.ones(self.generators.shape[1])
        A = self.constraints
        terms = np.abs(self.offset) + self.slack + np.abs(A).sum(axis=1)
        used = np.abs(A) > _PIVOT * terms[:, None]
        if not used.any():
            return lower, upper
        inverse = np.divide(1.0, A, out=np.zeros_like(A), where=used)
        for _ in range(2):
            center, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
            size = np.abs(A) * half
            total = size.sum(axis=1)
            others = self.slack[:, None] + (total[:, None] - size) + (unit(A.shape[1]) * terms)[:, None]
            middle = (self.offset - A @ center)[:, None] * inverse + center
            reach = others * np.abs(inverse)
            rounding = 8.0 * EPS * (np.abs(middle) + reach + 1.0)
            low = np.where(used, middle - reach - rounding, -np.inf).max(axis=0)
            high = np.where(used, middle + reach + rounding, np.inf).min(axis=0)
            lower, upper = np.maximum(lower, low), np.minimum(upper, high)
            if (lower > upper).any():
                return -np.ones(lower.size), np.ones(lower.size)
        return lower, upper

    def range_of(self, rows: Array, known: Array) -> tuple[Array, Array]:
        """Bounds (lower, upper), each (k,), of rows x + known, with the constraints as far as `implied` goes."""
        lower, upper = self.implied()
        image = self.affine_map(rows, known)
        center, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
        middle = image.center + image.generators @ center
        terms = np.abs(image.center) + np.abs(image.generators).sum(axis=1)
        radius = np.abs(image.generators) @ half + image.room + unit(lower.size) * terms
        return middle - radius, middle + radius

    def within(self, limit: float) -> bool:
        """Whether every coordinate is below a limit in size, constraints left out, and every number finite."""
        parts = self.center, self.generators, self.room, self.constraints, self.offset, self.slack
        if not all(np.isfinite(part).all() for part in parts):
            return False
        return bool(np.abs(self.interval_hull()).max(initial=0.0) < limit)

    def cut_to(self, lower: Array, upper: Array) -> ConstrainedZonotope:
        """Points within a box whose bounds may be infinite; those that the interval hull crosses become constraints."""
        low, high = self.interval_hull()
        crossed = np.flatnonzero((low < lower) | (high > upper))
        return self.cut(np.eye(self.dim)[crossed], lower[crossed], upper[crossed]) if crossed.size else self


def _rounded_ball(center: Array, radius: Array, terms: int) -> tuple[Array, Array]:
    radius = radius * (1.0 + unit(terms)) + 4.0 * EPS * np.abs(center)
    return center - radius, center + radius
