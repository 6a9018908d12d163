"""Pictures of sets: the shadow of a set on two coordinates."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes.rows import Rows
from polytopes.support import bounding_box, known_nonempty, support_points

Floats = NDArray[np.float64]


def shadow(P: Rows, dims: tuple[int, int]) -> Floats:
    """Vertices (k, 2) of the projection of a bounded set on two coordinates, counter-clockwise.

    Support points along the four axes, then along the normal of each chord as long as that finds a point beyond it.
    """
    frame = np.zeros((2, P.dim))
    frame[[0, 1], dims] = 1.0
    start = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    corners = support_points(P, start @ frame).points[:, dims]
    size = max(1e-300, float(np.ptp(corners, axis=0).max()))
    outline: list[Floats] = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        outline += _between(P, frame, dims, p, q, 1e-9 * size)
    return _without_repeats(np.array(outline or corners[:1]), 1e-9 * size)


def _between(P: Rows, frame: Floats, dims: tuple[int, int], p: Floats, q: Floats, reach: float) -> list[Floats]:
    """Vertices from p (included) to q (excluded)."""
    pending, found = [(p, q)], []
    while pending:
        p, q = pending.pop()
        chord = q - p
        length = float(np.hypot(*chord))
        if length <= reach:
            continue
        normal = np.array([chord[1], -chord[0]]) / length
        best = support_points(P, normal @ frame)
        corner = best.points[0, list(dims)]
        if best.values[0] <= normal @ p + reach or min(np.hypot(*(corner - p)), np.hypot(*(corner - q))) <= reach:
            found.append(p)
        else:
            pending += [(corner, q), (p, corner)]
    return found


def _without_repeats(points: Floats, reach: float) -> Floats:
    keep = [k for k in range(len(points)) if np.abs(points[k] - points[k - 1]).max() > reach]
    return points[keep] if keep else points[:1]


def plot(P: Rows, ax: Any, dims: tuple[int, int], style: dict[str, Any]) -> list[Any]:
    """Draw the shadow of P on two coordinates; returns the artists.

    An unbounded set is cut at a box around what the axes show (or around its largest ball), a flat one is a line or a
    point, and the empty set draws nothing.
    """
    import matplotlib.pyplot as plt  # imported here: not every user draws
    from matplotlib.patches import Polygon

    if ax is None:
        ax = plt.subplots()[1]
    if not known_nonempty(P):
        return []
    outline = shadow(_cut(P, ax, dims), dims)
    if len(outline) == 1:
        style = {key: value for key, value in style.items() if key != "facecolor"}
        return list(ax.plot(*outline.T, marker="o", **style))
    edge = {} if "color" in style else {"edgecolor": "black"}
    patch = Polygon(outline, closed=True, **{"alpha": 0.4, **edge, **style})
    ax.add_patch(patch)
    ax.autoscale_view()
    return [patch]


def _cut(P: Rows, ax: Any, dims: tuple[int, int]) -> Rows:
    """P itself, or P within a box in the two coordinates if its shadow is unbounded."""
    lower, upper = bounding_box(P)
    lower, upper = lower[list(dims)], upper[list(dims)]
    if np.isfinite(lower).all() and np.isfinite(upper).all():
        return P
    centre = P.program.interior.point[list(dims)]
    known = np.concatenate([[1.0], np.abs(np.concatenate([lower, upper]) - np.tile(centre, 2))])
    room = 3.0 * float(known[np.isfinite(known)].max())
    if ax.has_data():
        limits = np.array([ax.get_xlim(), ax.get_ylim()])
        room = max(room, float(np.abs(limits - centre[:, None]).max()))
    frame = np.zeros((2, P.dim))
    frame[[0, 1], dims] = 1.0
    return P.with_rows(
        np.vstack([P.A, frame, -frame]), np.concatenate([P.b, centre + room, room - centre])
    )
