"""Whether a claim "nothing explains these readings" is false: a trajectory that does, checked in fractions.

Shares nothing with what proves or checks: the state is carried on from the first sample, Delta is one of many
sequences, and a linear program proposes first state and disturbances; only what every bound holds for exactly counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import linprog

Array = np.ndarray[Any, np.dtype[Any]]
SEQUENCES = 6  # at random, besides corners and middles of the bounds of Delta


@dataclass(frozen=True)
class Instant:
    """One sample: [x+; y - v] = (stack_0 + sum Delta_i stack_i) z, z = (x, u, 1, w), and rows ``more`` on z."""

    stack: Array
    u: Array
    y: Array
    width: Array
    w_lower: Array
    w_upper: Array
    more: Sequence[tuple[Array, float, float]] = ()
    sums_width: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Start:
    """The first state is in a box, and ``rows`` of it are between ``lower`` and ``upper``."""

    box: tuple[Array, Array]
    rows: Array
    lower: Array
    upper: Array


Sum = tuple[int, int, int, float, float]  # of a column (ny on: w), from and to a sample, within


def witness(samples: Sequence[Instant], start: Start, delta: Array, sums: Sequence[Sum] = (), seed: int = 0) -> bool:
    """Whether some first state, disturbances and Delta explain every reading within its bounds.

    Exactly so if True; False only says that none was found.
    """
    return any(_explains(samples, start, values, sums) for values in _deltas(len(samples), delta, seed))


def _deltas(count: int, delta: Array, seed: int) -> Iterator[Array]:
    items = len(delta)
    if not items:
        yield np.zeros((count, 0))
        return
    middle = delta.mean(axis=1)
    yield np.tile(middle, (count, 1))
    for corner in product(*delta.tolist()):
        yield np.tile(corner, (count, 1))
    rng = np.random.default_rng(seed)
    for _ in range(SEQUENCES):
        yield rng.choice([0.0, 0.5, 1.0], (count, items)) * (delta[:, 1] - delta[:, 0]) + delta[:, 0]


def _explains(samples: Sequence[Instant], start: Start, values: Array, sums: Sequence[Sum]) -> bool:
    matrices = [s.stack[0] + np.tensordot(d, s.stack[1:], 1) for s, d in zip(samples, values, strict=True)]
    point = _proposed(samples, matrices, start, sums)
    return point is not None and _holds(samples, values, start, sums, *point)


def _proposed(
    samples: Sequence[Instant], matrices: list[Array], start: Start, sums: Sequence[Sum]
) -> tuple[Array, Array] | None:
    """First state and disturbances that keep as far from every bound as they can."""
    n, nw, count = len(start.box[0]), len(samples[0].w_lower), len(samples)
    width = n + count * nw
    on_x, constant = np.zeros((n, width)), np.zeros(n)
    on_x[:, :n] = np.eye(n)
    rows: list[tuple[Array, float, float, float]] = []  # coefficients, ends, how much a margin takes

    def bounded(g: Array, low: float, high: float) -> None:
        size = high - low
        rows.append((g, low, high, size if np.isfinite(size) else 0.0))

    noises: dict[tuple[int, int], tuple[Array, float]] = {}
    for k, (s, M) in enumerate(zip(samples, matrices, strict=True)):
        nu, on_w = len(s.u), np.zeros((nw, width))
        on_w[:, n + k * nw : n + (k + 1) * nw] = np.eye(nw)
        z = np.vstack([on_x, np.zeros((nu + 1, width)), on_w])
        at = np.concatenate([constant, s.u, [1.0], np.zeros(nw)])
        image, known = M @ z, M @ at
        for j, (y, within) in enumerate(zip(s.y, s.width, strict=True)):
            if np.isfinite(y):
                bounded(image[n + j], y - known[n + j] - within, y - known[n + j] + within)
                noises[k, j] = -image[n + j], y - known[n + j]
        for g, low, high in s.more:
            bounded(g @ z, low - g @ at, high - g @ at)
        on_x, constant = image[:n], known[:n]
    for g, low, high in zip(start.rows, start.lower, start.upper, strict=True):
        bounded(np.concatenate([g, np.zeros(width - n)]), low, high)
    for column, first, last, low, high in sums:
        g, known, missing = np.zeros(width), 0.0, 0.0
        for k in range(first, last + 1):
            ny = len(samples[k].y)
            if column >= ny:
                g[n + k * nw + column - ny] += 1.0
            elif (k, column) in noises:
                g, known = g + noises[k, column][0], known + noises[k, column][1]
                missing += samples[k].sums_width[column]
            else:
                missing += samples[k].width[column]
        bounded(g, low - known - missing, high - known + missing)
    ends = [start.box[0], *(s.w_lower for s in samples)], [start.box[1], *(s.w_upper for s in samples)]
    low, high = np.concatenate(ends[0]), np.concatenate(ends[1])
    if not (low <= high).all():
        return None
    A = [np.append(sign * g, size) for g, _, _, size in rows for sign in (1.0, -1.0)]
    b = [end for _, low_end, high_end, _ in rows for end in (high_end, -low_end)]
    finite = np.isfinite(b)
    if np.isnan(b).any():
        return None
    objective = np.append(np.zeros(width), -1.0)
    box = [(None if v == -np.inf else v, None if w == np.inf else w) for v, w in zip(low, high, strict=True)]
    found = linprog(
        objective,
        np.array(A)[finite] if finite.any() else None,
        np.array(b)[finite] if finite.any() else None,
        bounds=[*box, (0.0, 0.45)],
        method="highs",
    )
    if found.x is None:
        return None
    inside = np.clip(found.x[:-1], low, high)
    return inside[:n], inside[n:].reshape(count, nw)


def _holds(samples: Sequence[Instant], values: Array, start: Start, sums: Sequence[Sum], x0: Array, w: Array) -> bool:
    """Whether the trajectory from there is within every bound, in fractions."""
    exact = lambda v: [Fraction(float(e)) for e in v]  # noqa: E731
    x = exact(x0)
    for g, low, high in zip(start.rows, start.lower, start.upper, strict=True):
        if not _within(_dot(exact(g), x), low, high):
            return False
    if not all(_within(v, a, b) for v, a, b in zip(x, *start.box, strict=True)):
        return False
    noises: list[list[Fraction | None]] = []
    for s, d, at in zip(samples, values, w, strict=True):
        z = [*x, *exact(s.u), Fraction(1), *exact(at)]
        if not all(_within(v, a, b) for v, a, b in zip(exact(at), s.w_lower, s.w_upper, strict=True)):
            return False
        if not all(_within(_dot(exact(g), z), low, high) for g, low, high in s.more):
            return False
        rows = [
            sum(
                (Fraction(float(f)) * _dot(exact(row), z) for f, row in zip((1.0, *d), per_item, strict=True)),
                Fraction(0),
            )
            for per_item in np.swapaxes(s.stack, 0, 1)
        ]
        n = len(x)
        left = [None if np.isnan(y) else Fraction(float(y)) - r for y, r in zip(s.y, rows[n:], strict=True)]
        if any(v is not None and abs(v) > Fraction(float(b)) for v, b in zip(left, s.width, strict=True)):
            return False
        noises.append(left)
        x = rows[:n]
    return all(_sum_holds(samples, noises, w, one) for one in sums)


def _sum_holds(samples: Sequence[Instant], noises: list[list[Fraction | None]], w: Array, one: Sum) -> bool:
    column, first, last, low, high = one
    ny, total, missing = len(samples[0].y), Fraction(0), Fraction(0)
    for k in range(first, last + 1):
        if column >= ny:
            total += Fraction(float(w[k, column - ny]))
        elif (v := noises[k][column]) is None:
            missing += Fraction(float(samples[k].width[column]))
        else:
            total, missing = total + v, missing + Fraction(float(samples[k].sums_width[column]))
    return _within(total + missing, low, np.inf) and _within(total - missing, -np.inf, high)


def _dot(g: list[Fraction], z: list[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(g, z, strict=True) if a), Fraction(0))


def _within(value: Fraction, low: float, high: float) -> bool:
    return (low == -np.inf or Fraction(float(low)) <= value) and (high == np.inf or value <= Fraction(float(high)))
