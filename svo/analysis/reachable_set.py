"""Outer bounds of what an uncertain model can reach, without measurements: a zonotope, so nothing wraps."""

from __future__ import annotations

import numpy as np

from svo.analysis.lifted_rows import Channel
from svo.checks import Array

Box = tuple[Array, Array]
_ROUNDING = 1e-9  # relative; far above what a few thousand products in double precision can lose


class ReachableSet:
    """{centre + generators g : |g| <= 1}, a set that contains every state of the model at a sample."""

    def __init__(self, lower: Array, upper: Array) -> None:
        self._centre = (lower + upper) / 2
        self._generators = np.diag((upper - lower) / 2)

    def box(self) -> Box:
        """Bounds (n,) of the state."""
        return _around(self._centre, np.abs(self._generators).sum(axis=1))

    def bounds(self, functional: Array, others: Box) -> tuple[float, float]:
        """Bounds of functional'(x, others), where ``others`` is the box of (u, 1, w)."""
        n = len(self._centre)
        middle, half = _middle(others)
        centre = functional[:n] @ self._centre + functional[n:] @ middle
        radius = np.abs(functional[:n] @ self._generators).sum() + np.abs(functional[n:]) @ half
        lower, upper = _around(np.array([centre]), np.array([radius]))
        return (float(centre), float(centre)) if radius == 0.0 else (float(lower[0]), float(upper[0]))

    def move(self, stack: Array, channels: tuple[Channel, ...], others: Box, p: Box, rest: Array | None = None) -> None:
        """To the next sample: x+ = [A B a E](x, u, 1, w) + sum of gain p + r, p in its box and |r| <= rest (n,)."""
        n = len(self._centre)
        middle, half = _middle(others)
        p_middle, p_half = _middle(p)
        gains = np.array([c.gain[:n] for c in channels]).reshape(-1, n).T
        self._centre = stack[:n, :n] @ self._centre + stack[:n, n:] @ middle + gains @ p_middle
        parts = [stack[:n, :n] @ self._generators, stack[:n, n:] * half, gains * p_half]
        if rest is not None:
            parts.append(np.diag(rest))
        generators = np.hstack(parts)
        self._generators = generators[:, np.abs(generators).max(axis=0) > 0.0]


def product_bounds(channel: Channel, low: float, high: float) -> tuple[float, float]:
    """Bounds of Delta s for s in [low, high]."""
    corners = [delta * s for delta in (channel.lo, channel.hi) for s in (low, high)]
    return min(corners), max(corners)


def _middle(box: Box) -> Box:
    return (box[0] + box[1]) / 2, (box[1] - box[0]) / 2


def _around(centre: Array, radius: Array) -> Box:
    outer = radius + _ROUNDING * (np.abs(centre) + radius)
    return centre - outer, centre + outer
