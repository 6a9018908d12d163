"""Every state that a small model and the data allow, in fractions: the oracle of the observers' rules.

A set is its vertices. For one state, or for a certain A, the set of the next sample is the hull of its images under the
vertices of w and Delta, so it is exact: no state less, and none more.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

from svo.models import UncertainModel

Point = tuple[Fraction, ...]


def exact_states(
    model: UncertainModel, first: Sequence[tuple[float, float]], u: Any, y: Any
) -> list[tuple[Point, ...]]:
    """Vertices of the set of states after each sample; no vertices where nothing explains the data.

    Parameters
    ----------
    model : UncertainModel
        Without schedule and F, with one or two states and a certain output; with two states A is certain.
    first : sequence of (lower, upper)
        Bounds of each state at the first sample.
    u, y : (K, nu), (K, ny) arrays
        NaN in y = missing.
    """
    stack = [[exactly(row) for row in item] for item in model.stack().tolist()]
    found, points = [], [tuple(corner) for corner in itertools.product(*map(exactly, first))]
    for k, reading in enumerate(y.tolist()):
        if k:
            points = _moved(model, stack, points, exactly(u[k - 1].tolist()))
        points = _measured(model, stack[0], points, exactly(u[k].tolist()), reading)
        found.append(tuple(points))
    return found


def exactly(values: Iterable[float]) -> list[Fraction]:
    """Floats as the fractions that they are."""
    return [Fraction(value) for value in values]


def product(row: Iterable[Fraction], point: Iterable[Fraction]) -> Fraction:
    """The product of two vectors."""
    return sum((a * b for a, b in zip(row, point, strict=True) if a and b), Fraction(0))


def _moved(model: UncertainModel, stack: Any, points: list[Point], u: list[Fraction]) -> list[Point]:
    """Images of the vertices under every corner of w and Delta."""
    lower, upper, _ = model.bounds()
    bounds = zip(lower.tolist(), upper.tolist(), strict=True)
    disturbances = list(itertools.product(*map(exactly, bounds)))
    deltas = list(itertools.product(*(exactly(q.bounds) for q in model.uncertainties)))
    images = []
    for x, w, delta in itertools.product(points, disturbances, deltas):
        known = [*x, *u, Fraction(1), *w]
        parts = [[product(row, known) for row in item[: model.n_states]] for item in stack]
        images.append(tuple(product((Fraction(1), *delta), column) for column in zip(*parts, strict=True)))
    return _hull(images)


def _measured(model: UncertainModel, stack: Any, points: list[Point], u: list[Fraction], y: list[float]) -> list[Point]:
    """The part that every reading allows."""
    n, noise = model.n_states, model.bounds()[2].tolist()
    for row, value, half in zip(stack[n:], y, noise, strict=True):
        if value == value:  # no NaN
            known = product(row[n:], [*u, Fraction(1), *[Fraction(0)] * model.n_disturbances])
            middle = Fraction(value) - known
            points = _cut(points, row[:n], middle + Fraction(half))
            points = _cut(points, [-c for c in row[:n]], Fraction(half) - middle)
    return points


def _cut(points: list[Point], normal: Sequence[Fraction], bound: Fraction) -> list[Point]:
    """Vertices of the part in which normal'x <= bound: those inside, and where a segment leaves."""
    inside = [p for p in points if product(normal, p) <= bound]
    outside = [p for p in points if product(normal, p) > bound]
    crossing = []
    for p, q in itertools.product(inside, outside):
        low, high = product(normal, p), product(normal, q)
        share = (bound - low) / (high - low)
        crossing.append(tuple(a + share * (b - a) for a, b in zip(p, q, strict=True)))
    return _hull([*inside, *crossing])


def _hull(points: Iterable[Point]) -> list[Point]:
    """Vertices of the hull of points on a line or in the plane (monotone chain)."""
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered
    if len(ordered[0]) == 1:
        return [ordered[0], ordered[-1]]
    return [*_chain(ordered), *_chain(ordered[::-1])]


def _chain(ordered: Iterable[Point]) -> list[Point]:
    """One side of the hull, without its last point."""
    side: list[Point] = []
    for p in ordered:
        while len(side) > 1 and not _turns_left(side[-2], side[-1], p):
            side.pop()
        side.append(p)
    return side[:-1]


def _turns_left(a: Point, b: Point, c: Point) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])
