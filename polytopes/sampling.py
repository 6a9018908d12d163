"""Volume and random points of bounded sets."""

import numpy as np
from numpy.typing import NDArray

from polytopes.affine_hull import affine_dim, explicit
from polytopes.errors import EmptySetError, UnboundedError, UndecidedError
from polytopes.frame import unit_body, unit_frame
from polytopes.qhull import points_volume
from polytopes.rows import Rows
from polytopes.support import is_bounded, known_nonempty
from polytopes.vertices import listed, vertices

Floats = NDArray[np.float64]
_STEPS = 20  # steps per coordinate between two points that are kept


def volume(P: Rows) -> float:
    """n-dimensional volume: 0 for flat and empty sets, inf for unbounded full-dimensional ones.

    Qhull's volume of the vertices, in coordinates where the set is about as wide in every direction.
    """
    if affine_dim(P) < P.dim:
        return 0.0
    if not is_bounded(P):
        return np.inf
    if P.dim == 1:
        return float(np.ptp(vertices(P)))
    program = P.program.balanced
    body = unit_body(program.AT.T, program.rhs, program.centre)
    if body is None:
        raise UndecidedError("cannot measure the volume: the set is too thin for coordinates in which it is round.")
    size = np.prod(program.columns) * abs(np.linalg.det(body.axes))
    return float(points_volume(listed(body)) * size)


def random_points(P: Rows, count: int, rng: np.random.Generator) -> Floats:
    """`count` points of a bounded set, array (count, n), close to uniform (hit-and-run, Smith 1984).

    The walk starts at the centre of a largest ball and runs in coordinates where the set is about as wide in every
    direction, 20 steps per coordinate between two points; within the affine hull if the set is flat.

    Raises
    ------
    EmptySetError, UnboundedError
        If there are no points, or no uniform distribution on them.
    """
    if not known_nonempty(P):
        raise EmptySetError("the empty set has no points.")
    if not is_bounded(P):
        raise UnboundedError("P is unbounded: there is no uniform distribution on it; intersect it with a box first.")
    program = explicit(P).program
    free = program.flat.free
    z = program.interior.point[free]
    if not free:
        return np.tile(program.flat.point, (count, 1))
    rows = program.AT.T
    body = Rows(rows, program.rhs).program
    frame = unit_frame(lambda directions: body.maximise(directions).points, z)
    walk = np.empty((count, len(free)))
    for k in range(count):
        for _ in range(_STEPS * len(free)):
            z = _step(rows, program.rhs, z, frame @ rng.standard_normal(len(free)), rng)
        walk[k] = z
    points: Floats = program.flat.lift(walk)
    return points


def _step(rows: Floats, rhs: Floats, z: Floats, direction: Floats, rng: np.random.Generator) -> Floats:
    """A uniform point on the chord through z."""
    rate, slack = rows @ direction, np.maximum(rhs - rows @ z, 0.0)
    ahead, behind = rate > 0.0, rate < 0.0
    far, near = (slack[ahead] / rate[ahead]).min(), (slack[behind] / rate[behind]).max()
    moved: Floats = z + rng.uniform(near, far) * direction
    return moved
