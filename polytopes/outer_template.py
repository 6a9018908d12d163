"""The template ``{x : T x <= h_P(T)}``: the smallest set with given normals that contains P."""

import numpy as np

from polytopes.checks import Floats
from polytopes.outer_supports import upper_supports
from polytopes.rows import Rows


def outer_template(P: Rows, directions: Floats) -> tuple[Floats, Floats]:
    """Rows T (k, n) and h (k,) around the nonempty P, h rounded up; directions in which P is unbounded give no row."""
    offsets = upper_supports(P, directions)
    finite = np.isfinite(offsets)
    return directions[finite], offsets[finite]
