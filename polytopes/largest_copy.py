"""The largest copy ``centre + scale Q`` of one set inside another, by one linear program.

``centre + scale Q`` lies in ``{a'x <= b}`` if and only if ``a'centre + scale h_Q(a) <= b``: a linear row in both.
"""

import numpy as np

from polytopes.checks import Floats
from polytopes.errors import EmptySetError, UnboundedError
from polytopes.inclusion import half_spaces
from polytopes.rows import Rows
from polytopes.support import known_nonempty, maxima


def largest_copy(P: Rows, Q: Rows) -> tuple[Floats, float]:
    """Centre (n,) and scale of the largest copy of a bounded Q in P.

    Raises
    ------
    EmptySetError
        If P or Q is empty.
    UnboundedError
        If Q is unbounded along a row of P, or copies of any size fit in.
    """
    if not (known_nonempty(P) and known_nonempty(Q)):
        raise EmptySetError("there is no copy of, or in, the empty set; ask is_empty() first.")
    normals, sides = half_spaces(P)
    reach = maxima(Q, normals)
    assert reach is not None
    if not np.isfinite(reach.values).all():
        raise UnboundedError("Q is unbounded along a row of P, so that no copy fits in; intersect it with a box first.")
    scale = np.append(np.zeros(P.dim), 1.0)
    lifted = Rows(np.vstack([np.hstack([normals, reach.values[:, None]]), -scale]), np.append(sides, 0.0))
    best = maxima(lifted, scale[None])
    assert best is not None  # P has a point, and scale 0 fits there
    if np.isinf(best.values[0]):
        raise UnboundedError("copies of any size fit in; intersect P with a box first.")
    return best.points[0, :-1], float(max(best.points[0, -1], 0.0))
