"""Random points of bounded sets."""

from __future__ import annotations

import numpy as np

from polytopes.affine_hull import explicit
from polytopes.checks import Floats
from polytopes.errors import EmptySetError, UnboundedError
from polytopes.frame import unit_frame
from polytopes.preparation import prepare_as_given
from polytopes.rows import Rows
from polytopes.support import is_bounded, known_nonempty

_STEPS = 20  # steps per coordinate between two points that are kept


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
    z = program.centre
    if not free:
        return np.tile(program.flat.point, (count, 1))
    rows = program.AT.T
    body = prepare_as_given(rows, program.rhs)
    frame = unit_frame(lambda directions: body.maximise(directions).points, z)
    walk = np.empty((count, len(free)))
    for k in range(count):
        for _ in range(_STEPS * len(free)):
            z = _step(rows, program.rhs, z, frame @ rng.standard_normal(len(free)), rng)
        walk[k] = z
    return program.lift(walk)


def _step(rows: Floats, rhs: Floats, z: Floats, direction: Floats, rng: np.random.Generator) -> Floats:
    """A uniform point on the chord through z."""
    rate, slack = rows @ direction, np.maximum(rhs - rows @ z, 0.0)
    ahead, behind = rate > 0.0, rate < 0.0
    far, near = (slack[ahead] / rate[ahead]).min(), (slack[behind] / rate[behind]).max()
    moved: Floats = z + rng.uniform(near, far) * direction
    return moved
