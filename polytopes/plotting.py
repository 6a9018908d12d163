"""Pictures of sets: the shadow of a set on two or three coordinates."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from polytopes.checks import Floats
from polytopes.projection import project
from polytopes.rows import Rows
from polytopes.support import bounding_box, known_nonempty, support_points
from polytopes.vertices import vertices

_MAX_ROWS = 20_000
_REACH = 1e-9  # of a set's extent, within which points are one in a picture


def shadow(P: Rows, dims: tuple[int, int]) -> Floats:
    """Vertices (k, 2) of the projection of a bounded set on two coordinates, counter-clockwise.

    Support points along the four axes, then along the normal of each chord as long as that finds a point beyond it.
    """
    frame = np.zeros((2, P.dim))
    frame[[0, 1], dims] = 1.0
    start = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    corners = support_points(P, start @ frame).points[:, dims]
    units = _units(corners)
    frame /= units[:, None]
    corners = corners / units
    outline: list[Floats] = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        outline += _between(P, frame, dims, p, q, units)
    return _without_repeats(np.array(outline or corners[:1])) * units


def _units(corners: Floats) -> Floats:
    """Powers of two (d,) near the extents of a set, in which it is about as wide as high; flat is flat in them too."""
    spans = np.ptp(corners, axis=0)
    known = np.maximum(_REACH * np.abs(corners).max(axis=0), 1e-14 * spans.max())  # what a solver may leave of nothing
    return np.asarray(2.0 ** np.ceil(np.log2(np.maximum(np.maximum(spans, known), 1e-300))))


def _between(P: Rows, frame: Floats, dims: tuple[int, int], p: Floats, q: Floats, units: Floats) -> list[Floats]:
    """Vertices from p (included) to q (excluded), in units of the coordinates."""
    pending, found = [(p, q)], []
    while pending:
        p, q = pending.pop()
        chord = q - p
        length = float(np.hypot(*chord))
        if length <= _REACH:
            continue
        normal = np.array([chord[1], -chord[0]]) / length
        best = support_points(P, normal @ frame)
        corner = best.points[0, list(dims)] / units
        if best.values[0] <= normal @ p + _REACH or min(np.hypot(*(corner - p)), np.hypot(*(corner - q))) <= _REACH:
            found.append(p)
        else:
            pending += [(corner, q), (p, corner)]
    return found


def _without_repeats(points: Floats) -> Floats:
    keep = [k for k in range(len(points)) if np.abs(points[k] - points[k - 1]).max() > _REACH]
    return points[keep] if keep else points[:1]


def plot(P: Rows, ax: Any, dims: tuple[int, ...], style: dict[str, Any]) -> list[Any]:
    """Draw the shadow of P on two or three coordinates; returns the artists.

    An unbounded set is cut at a box around what the axes show (or around its largest ball), a flat one is a face, a
    line or a point, and the empty set draws nothing.
    """
    ax = _axes(ax, len(dims))
    if not known_nonempty(P):
        return []
    body = _cut(P, ax, dims)
    edge = {} if "color" in style else {"edgecolor": "black"}
    if len(dims) == 2:
        return _draw_polygon(ax, shadow(body, (dims[0], dims[1])), {"alpha": 0.4, **edge, **style})
    return _draw_faces(ax, Rows(*project(body, dims, "auto", _MAX_ROWS, False)), {"alpha": 0.4, **edge, **style})


def _axes(ax: Any, d: int) -> Any:
    """Axes of two or three dimensions, new ones if none are given."""
    if ax is None:
        import matplotlib.pyplot as plt  # imported here: not every user draws

        return plt.figure().add_subplot(projection="3d" if d == 3 else None)
    if not hasattr(ax, "add_patch"):
        raise TypeError(f"ax is a {type(ax).__name__}; expected axes of matplotlib.")
    if hasattr(ax, "get_zlim") != (d == 3):
        raise ValueError(f"ax has {2 if d == 3 else 3} dimensions; expected {d}, as many as dims has coordinates.")
    return ax


def plot_all(sets: Sequence[Rows], ax: Any, dims: tuple[int, ...], style: dict[str, Any]) -> list[Any]:
    """Draw the shadows of some sets on the same axes, in one colour; returns the artists."""
    drawn: list[Any] = []
    ax = _axes(ax, len(dims))
    shared = style if "color" in style else {"facecolor": "C0", **style}
    for P in sets:
        drawn += plot(P, ax, dims, shared)
        if drawn:
            shared = {key: value for key, value in shared.items() if key != "label"}  # one entry of a legend
    return drawn


def draw_shadow(P: Rows, ax: Any, **style: Any) -> list[Any]:
    """Draw the shadow of P on its first two coordinates, or P itself on a line; returns the artists."""
    if P.dim > 1:
        ax.set(xlabel="x[0]", ylabel="x[1]")
        return plot(P, ax, (0, 1), style)
    ax.set(xlabel="x[0]", yticks=[])
    if not known_nonempty(P):
        return []
    (lower,), (upper,) = bounding_box(_cut(P, ax, (0,)))
    return list(ax.plot([lower, upper], [0.0, 0.0], marker="|", linewidth=4.0, **{"alpha": 0.5, **style}))


def _draw_polygon(ax: Any, outline: Floats, style: dict[str, Any]) -> list[Any]:
    from matplotlib.patches import Polygon

    if len(outline) == 1:
        return _draw_stick(ax, outline, style)
    patch = Polygon(outline, closed=True, **style)
    ax.add_patch(patch)
    ax.autoscale_view()
    return [patch]


def _draw_faces(ax: Any, P: Rows, style: dict[str, Any]) -> list[Any]:
    """Faces of a bounded set in three dimensions."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    corners = vertices(P)
    if len(corners) < 3:
        return _draw_stick(ax, corners, style)
    units = _units(corners)
    scaled, normals = corners / units, P.A * units
    lengths = np.linalg.norm(normals, axis=1)
    faces = [scaled[np.abs(scaled @ a - b) <= _REACH * size] for a, b, size in zip(normals, P.b, lengths, strict=True)]
    faces = [scaled] if P.d.size else [face for face in faces if len(face) >= 3]
    solid = Poly3DCollection([_around(face) * units for face in faces], **style)
    ax.add_collection(solid, autolim=False)  # its own limits would count the padding of faces with few corners
    ax.auto_scale_xyz(*corners.T)
    return [solid]


def _draw_stick(ax: Any, corners: Floats, style: dict[str, Any]) -> list[Any]:
    """A segment or a point."""
    line = {"color": style.get("color", style.get("facecolor", "black")), "alpha": style["alpha"]}
    return list(ax.plot(*corners.T, marker="o" if len(corners) == 1 else None, **line))


def _around(face: Floats) -> Floats:
    """Corners of a planar face in the order of their angle."""
    offsets = face - face.mean(axis=0)
    _, _, axes = np.linalg.svd(offsets)
    flat = offsets @ axes[:2].T
    return face[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))]


def _cut(P: Rows, ax: Any, dims: tuple[int, ...]) -> Rows:
    """P itself, or P within a box in the given coordinates if its shadow is unbounded."""
    kept = list(dims)
    lower, upper = (bound[kept] for bound in bounding_box(P))
    if np.isfinite(lower).all() and np.isfinite(upper).all():
        return P
    centre = P.program.interior.point[kept]
    known = np.abs(np.concatenate([[1.0], lower - centre, upper - centre]))
    room = 3.0 * float(known[np.isfinite(known)].max())
    if ax.has_data():
        limits = np.array([getattr(ax, f"get_{name}lim")() for name in "xyz"[: len(kept)]])
        room = max(room, float(np.abs(limits - centre[:, None]).max()))
    frame = np.eye(P.dim)[kept]
    return P.with_rows(np.vstack([P.A, frame, -frame]), np.concatenate([P.b, centre + room, room - centre]))
