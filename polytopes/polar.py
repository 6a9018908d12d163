"""The polar ``{y : x'y <= 1 for all x in P}`` of a set (Rockafellar 1970, section 14).

Of a set with the origin inside, ``{a'x <= b, c'x = 0}`` with b >= 0, it is the hull of 0 and the points a / b, plus the
rays a of rows with b = 0 and the lines c.  A set without the origin has the polar of its hull with it.
"""

import numpy as np

from polytopes.double_description import Integers
from polytopes.exact_generators import integer_form
from polytopes.generators import in_integers
from polytopes.inclusion import has_point
from polytopes.minkowski_weyl import ExactGenerators, ExactRows, distinct, rows_of, stacked, union
from polytopes.outward import float_rows
from polytopes.rows import Rows, Table, everything
from polytopes.support import known_nonempty


def polar(P: Rows) -> Table:
    """Rows A, b, C, d of the polar: exact where they are floats, else outward; R^n if P is empty.

    Raises
    ------
    UndecidedError
        At the limit of the double description.
    """
    n = P.dim
    if not known_nonempty(P):
        return everything(n)
    rows = integer_form(P.A, P.b, P.C, P.d)
    if not has_point(P, np.zeros(n)):
        rows = rows_of(union([in_integers(P), _origin(n)]))
    return float_rows(_generators(rows, n))


def _generators(rows: ExactRows, n: int) -> ExactGenerators:
    """Those of the polar of a set with the origin."""
    table = rows.inequalities[rows.inequalities[:, :-1].any(axis=1)]
    points, rays = table[table[:, -1] > 0], table[table[:, -1] == 0]
    lines = rows.equalities[rows.equalities.any(axis=1)]
    return ExactGenerators(distinct(stacked(_origin(n).vertices, points)), distinct(rays[:, :-1]), lines[:, :-1])


def _origin(n: int) -> ExactGenerators:
    nothing: Integers = np.zeros((0, n), dtype=np.int64)
    return ExactGenerators(np.append(np.zeros(n, dtype=np.int64), 1)[None], nothing, nothing)
