"""Coordinates in which a set is about as wide in every direction, found by asking for support points."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from polytopes.checks import Floats
from polytopes.errors import UndecidedError
from polytopes.exact import substituted
from polytopes.linear_program import OPTIMAL
from polytopes.preparation import prepare_as_given

Oracle = Callable[[Floats], Floats]  # directions (k, n) -> a maximiser for each, (k, n)
_EVEN = 0.05  # smallest spread of the support points at which the axes are good enough
_NOISE = 1e-15  # width, relative to the coordinates of the points, below which it is rounding
_HUGE = 1e100  # entries of rows from which, and from whose reciprocal, coordinates are not about the set
_ROUND = 0.02  # radius of a largest ball in coordinates that are good enough


def unit_frame(oracle: Oracle, centre: Floats) -> Floats:
    """Axes (columns) along which a bounded, full-dimensional set around `centre` has widths of about one.

    Widths along the current axes scale them; where the support points then lie near a subspace (a thin, skew set), the
    axes turn to the principal ones and the widths are taken again.

    Raises
    ------
    UndecidedError
        If rounding leaves no width, or no support point.
    """
    frame = _scaled(oracle, np.eye(centre.size))
    for _ in range(3):
        axes = inverted(frame)
        points = _told((oracle(np.vstack([axes, -axes])) - centre) @ axes.T)
        spread, principal = principal_axes(points)
        if spread[-1] > _EVEN:
            break
        frame = _scaled(oracle, frame @ principal.T)
    return _told(frame)


def inverted(frame: Floats) -> Floats:
    """The inverse of axes (columns); UndecidedError if rounding left one without a width."""
    try:
        return _told(np.asarray(np.linalg.inv(frame), dtype=np.float64))
    except np.linalg.LinAlgError:
        return _told(np.full_like(frame, np.nan))


def _told(values: Floats) -> Floats:
    """The values, if floats can tell them."""
    if not np.isfinite(values).all():
        raise UndecidedError("the set is too thin for coordinates in which it is about round.")
    return values


def principal_axes(points: Floats) -> tuple[Floats, Floats]:
    """Spread (n,) of points (k, n) along orthonormal axes (n, n), the rows; widest first, zero beyond the rank."""
    offsets = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(np.linalg.qr(offsets, mode="r"))
    spread = np.zeros(points.shape[1])
    spread[: sizes.size] = sizes
    return spread, np.asarray(axes, dtype=np.float64)


def _scaled(oracle: Oracle, frame: Floats) -> Floats:
    """The axes multiplied by the widths of the set along them."""
    axes = inverted(frame)
    above, below = oracle(axes), oracle(-axes)
    noise = _NOISE * (np.abs(np.vstack([above, below])).max(axis=0) * np.abs(axes)).sum(axis=1)
    scaled: Floats = frame * np.maximum(((above - below) * axes).sum(axis=1), np.maximum(noise, 1e-300))
    return scaled


@dataclass(frozen=True, eq=False)
class UnitBody:
    """A set in coordinates z, ``x = centre + axes z``, in which it is about a unit ball.

    Rows (m, n) and rhs (m,) are rounded once, whatever cancels on the way; `inner` (n,) is a point z strictly inside.
    """

    centre: Floats
    axes: Floats
    rows: Floats
    rhs: Floats
    inner: Floats

    def lift(self, z: Floats) -> Floats:
        """Points z (..., n) in the coordinates x."""
        x: Floats = self.centre + z @ self.axes.T
        return x


def unit_body(A: Floats, b: Floats, inner: Floats) -> UnitBody | None:
    """Coordinates for a full-dimensional set ``A x <= b``; None if it is unbounded, or rounding hides its shape.

    Each round measures the set in the coordinates of the round before, so that a width of 1e-12 of the others, of
    which floats see a few digits at first, comes out right in the end.
    """
    n = inner.size
    centre, axes = inner, np.eye(n)
    rows, rhs = substituted(A, b, centre, axes)
    for _ in range(6):
        sizes = np.abs(rows).max(axis=1)
        body = _measured(rows, rhs) if ((sizes > 1.0 / _HUGE) & (sizes < _HUGE)).all() else None
        if body is None:
            return None
        point, turn, radius = body
        if radius > _ROUND:
            return UnitBody(centre, axes, rows, rhs, point)
        centre, axes = centre + axes @ point, axes @ turn
        rows, rhs = substituted(A, b, centre, axes)
    return None


def _measured(rows: Floats, rhs: Floats) -> tuple[Floats, Floats, float] | None:
    """A centre of the set, axes of unit width and the radius of a largest ball over the distance of the far points."""
    n = rows.shape[1]
    program = prepare_as_given(rows, rhs)
    axes = np.eye(n)
    extremes = program.maximise(np.vstack([axes, -axes]))
    if any(name != OPTIMAL for name in extremes.status):
        return None
    point = program.balanced.interior.point
    reach = float(np.abs(extremes.points - point).max())
    radius = program.balanced.interior.radius / reach if program.balanced is program and reach > 0.0 else 0.0
    if radius > _ROUND and 0.1 < reach < 10.0:
        return point, axes, radius
    try:
        return point, unit_frame(lambda directions: program.maximise(directions).points, point), 0.0
    except UndecidedError:
        return None
