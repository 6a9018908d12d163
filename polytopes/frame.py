"""Coordinates in which a set is about as wide in every direction, found by asking for support points."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Oracle = Callable[[Floats], Floats]  # directions (k, n) -> a maximiser for each, (k, n)
_EVEN = 0.05  # smallest spread of the support points at which the axes are good enough


def unit_frame(oracle: Oracle, centre: Floats) -> Floats:
    """Axes (columns) along which a bounded, full-dimensional set around `centre` has widths of about one.

    Widths along the current axes scale them; where the support points then lie near a subspace (a thin, skew set), the
    axes turn to the principal ones and the widths are taken again.
    """
    frame = _scaled(oracle, np.eye(centre.size))
    for _ in range(3):
        axes = np.linalg.inv(frame)
        points = (oracle(np.vstack([axes, -axes])) - centre) @ axes.T
        spread, principal = principal_axes(points)
        if spread[-1] > _EVEN:
            break
        frame = _scaled(oracle, frame @ principal.T)
    return frame


def principal_axes(points: Floats) -> tuple[Floats, Floats]:
    """Spread (n,) of points (k, n) along orthonormal axes (n, n), the rows; widest first, zero beyond the rank."""
    offsets = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(np.linalg.qr(offsets, mode="r"))
    spread = np.zeros(points.shape[1])
    spread[: sizes.size] = sizes
    return spread, np.asarray(axes, dtype=np.float64)


def _scaled(oracle: Oracle, frame: Floats) -> Floats:
    """The axes multiplied by the widths of the set along them."""
    axes = np.asarray(np.linalg.inv(frame), dtype=np.float64)
    upper = (oracle(axes) * axes).sum(axis=1)
    lower = (oracle(-axes) * axes).sum(axis=1)
    scaled: Floats = frame * (upper - lower)
    return scaled
