"""What a measurement says about (x, w): two rows a sensor, also where the output matrices are uncertain."""

from __future__ import annotations

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.models import UncertainModel
from svo.observers.polytope.vertex_images import outer_support, reach_of

_ROUNDING = 2.0**-51  # of the terms of a row, for each of them


def output_rows(
    model: UncertainModel, stack: Array, joint: HPolytope, u: Array, y: Array, noise: Array, eps: float
) -> HPolytope:
    """Rows over (x, w) of y = C x + D u + c + F w + v + sum_i Delta_i s_i within the noise.

    Each product p = Delta_i s_i, one a sensor, lies between the chords of max and min over Delta of Delta s on the
    interval of s_i over ``joint``: the convex hull of all (s, p). A Delta shared by several sensors, or by state and
    output, is taken as free in each. Rows are widened by eps times the magnitude of all terms, and by their own
    rounding. No hull over the vertices of Delta would do: y = Delta x, Delta in [-1, 1], leaves out x = 100 y.

    Parameters
    ----------
    model : UncertainModel
    stack : (1 + n_uncertainties, n + ny, n + nu + 1 + nw) array
    joint : HPolytope
        Bounded set of (x, w) before the measurement.
    u, y, noise : (nu,), (ny,), (ny,) arrays
        NaN in y = no row.
    eps : float
    """
    layout = model.layout
    states = list(range(layout.n)) + list(range(layout.n + layout.nu + 1, layout.shape[1]))
    known = np.concatenate([u, [1.0]])
    reach = reach_of(joint)
    slack = eps + _ROUNDING * (stack[0].shape[1] + 1 + 4 * len(model.uncertainties))
    A, b = [], []
    for o in np.flatnonzero(~np.isnan(y)):
        rows = stack[:, layout.n + o]
        free, fixed = rows[:, states], rows[:, layout.n : layout.n + layout.nu + 1]
        sizes = np.abs(free) @ reach + np.abs(fixed) @ np.abs(known)
        above, below = np.append(free[0], fixed[0] @ known), np.append(free[0], fixed[0] @ known)
        magnitude = abs(y[o]) + sizes[0] + noise[o]
        for i, uncertainty in enumerate(model.uncertainties, start=1):
            if rows[i].any():
                s = np.append(free[i], fixed[i] @ known)
                up, down = _chords(s, joint, uncertainty.bounds)
                above, below = above + up, below + down
                magnitude += np.abs(uncertainty.bounds).max() * sizes[i]
        width = noise[o] + slack * magnitude
        A += [below[:-1], -above[:-1]]
        b += [y[o] + width - below[-1], above[-1] - y[o] + width]
    return HPolytope(np.reshape(A, (-1, joint.dim)), np.array(b))


def _chords(s: Array, joint: HPolytope, bounds: tuple[float, float]) -> tuple[Array, Array]:
    """Affine functions (coefficients, constant) above and below Delta s, for s = (f, s0) over the set."""
    right, left = np.array([1.0, -1.0]) * outer_support(joint, np.vstack([s[:-1], -s[:-1]])) + s[-1]
    lines = []
    for choose in (max, min):
        ends = [choose(delta * end for delta in bounds) for end in (left, right)]
        slope = (ends[1] - ends[0]) / (right - left) if right > left else 0.0
        line = slope * s
        line[-1] += ends[0] - slope * left
        lines.append(line)
    return lines[0], lines[1]
