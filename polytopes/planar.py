"""Polygons in the plane: which way three points turn is decided in rationals."""

from fractions import Fraction
from itertools import pairwise

import numpy as np

from polytopes.checks import Floats

Point = tuple[Fraction, Fraction]


def outline(points: Floats) -> Floats:
    """Corners (c, 2) of the hull of points (k, 2), counter-clockwise (Andrew 1979); one or two if they are flat."""
    ordered = sorted({(Fraction(x), Fraction(y)) for x, y in points.tolist()})
    if len(ordered) < 3:
        return np.array([[float(v) for v in point] for point in ordered])
    half = [_chain(ordered)[:-1], _chain(ordered[::-1])[:-1]]
    return np.array([[float(v) for v in point] for chain in half for point in chain])


def is_convex_ring(points: Floats) -> bool:
    """Whether a closed ring (k, 2) goes once around a convex polygon; corners may repeat, and lie on sides."""
    ring = [(Fraction(x), Fraction(y)) for x, y in points.tolist()]
    edges = [(q[0] - p[0], q[1] - p[1]) for p, q in pairwise(ring) if p != q]
    following = edges[1:] + edges[:1]
    turns = [u[0] * v[1] - u[1] * v[0] for u, v in zip(edges, following, strict=True)]
    back = any(t == 0 and u[0] * v[0] + u[1] * v[1] < 0 for t, u, v in zip(turns, edges, following, strict=True))
    if back or (min(turns, default=Fraction(0)) < 0 < max(turns, default=Fraction(0))):
        return False
    ahead = [y > 0 or (y == 0 and x > 0) for x, y in edges]
    return sum(u != v for u, v in zip(ahead, ahead[1:] + ahead[:1], strict=True)) == 2


def are_collinear(points: Floats) -> bool:
    """Whether points (k, 2) lie on one line."""
    return len(outline(points)) < 3


def _chain(ordered: list[Point]) -> list[Point]:
    """The lower half of the hull of points in their order."""
    chain: list[Point] = []
    for point in ordered:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
            chain.pop()
        chain.append(point)
    return chain


def _turn(p: Point, q: Point, r: Point) -> Fraction:
    """Positive where p, q, r turn left."""
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
