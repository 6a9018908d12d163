"""Sets moved and scaled: their normals stay, and their right-hand sides change by exact amounts."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from polytopes.checks import Floats
from polytopes.exact_sides import exact_forms, with_sides
from polytopes.rows import Rows, Table, nothing
from polytopes.support import known_nonempty


def translation(P: Rows, t: Floats | Sequence[Fraction]) -> Table:
    """Rows of ``{x + t : x in P}``: ``A x <= b + A t``, ``C x = d + C t``; rounded up where they are no floats."""
    moved = exact_forms(np.vstack([P.A, P.C]), t)
    sides = [Fraction(v) + shift for v, shift in zip([*P.b.tolist(), *P.d.tolist()], moved, strict=True)]
    return with_sides(P.A, sides[: P.b.size], P.C, sides[P.b.size :])


def scaled(P: Rows, s: float | Fraction) -> Table:
    """Rows of ``{s x : x in P}``: ``sign(s) A x <= |s| b``, ``C x = s d``; the origin for s = 0 and a nonempty P."""
    if s == 0:
        origin = np.empty((0, P.dim)), np.empty(0), np.eye(P.dim), np.zeros(P.dim)
        return origin if known_nonempty(P) else nothing(P.dim)
    A, factor = P.A if s > 0 else 0.0 - P.A, Fraction(s)
    sides = [abs(factor) * Fraction(v) for v in P.b.tolist()]
    return with_sides(A, sides, P.C, [factor * Fraction(v) for v in P.d.tolist()])
