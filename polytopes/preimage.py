"""The preimage ``{x : M x + t in P}`` of a set under an affine map: ``A M x <= b - A t``, ``C M x = d - C t``."""

import numpy as np

from polytopes.checks import Floats
from polytopes.double_description import primitive
from polytopes.errors import UndecidedError
from polytopes.exact_generators import LONG_RAYS, integer_form
from polytopes.integers import are_floats, exact_product, integer_rows
from polytopes.minkowski_weyl import ExactRows, generators_of
from polytopes.outer_supports import reach
from polytopes.outward import float_rows, nearest_floats
from polytopes.rows import Rows, Table, nothing

_EPS = float(np.finfo(np.float64).eps)


def preimage(P: Rows, M: Floats, t: Floats) -> Table:
    """Rows A, b, C, d of the preimage, for any matrix M (n, k) and shift t (n,).

    The rows multiplied out, where that needs no rounding.  Else a set that contains the preimage: each row moved out
    by its rounding over the reach of a bounded preimage; of any other the hull of its generators in integers, if they
    are not too many.
    """
    table = np.vstack([np.hstack([P.A, P.b[:, None]]), np.hstack([P.C, P.d[:, None]])])
    shifted = np.vstack([np.hstack([M, -t[:, None]]), np.append(np.zeros(M.shape[1]), 1.0)])
    rows, certain = exact_product(table, shifted)
    if certain.all():
        k = P.b.size
        return rows[:k, :-1], rows[:k, -1], rows[k:, :-1], rows[k:, -1]
    exact = _multiplied(integer_form(P.A, P.b, P.C, P.d), shifted)
    near = nearest_floats(exact)
    if all(map(are_floats, [*exact.inequalities.tolist(), *exact.equalities.tolist()])):
        return near
    return _moved_out(exact, near) or _hull(exact) or near


def _multiplied(rows: ExactRows, shifted: Floats) -> ExactRows:
    """The rows of the preimage in integers, up to positive factors."""
    whole = integer_rows(shifted.ravel()[None])[0].astype(object).reshape(shifted.shape)
    return ExactRows(*(primitive(part.astype(object) @ whole) for part in (rows.inequalities, rows.equalities)))


def _moved_out(exact: ExactRows, near: Table) -> Table | None:
    """The nearest rows, moved out by their rounding over the reach of the set; None if no reach is proved.

    An equality that is rounded becomes two rows.
    """
    body = Rows(*near)
    if body.decided.status != "nonempty":
        return None
    table, fixed = np.hstack([body.A, body.b[:, None]]), np.hstack([body.C, body.d[:, None]])
    most = reach(body, _EPS * np.abs(np.vstack([table, fixed])))
    if most is None:
        return None
    sound = np.array([are_floats(row) for row in exact.equalities.tolist()], dtype=bool)
    rounded = np.array([not are_floats(row) for row in exact.inequalities.tolist()], dtype=bool)
    pairs = np.vstack([fixed[~sound], -fixed[~sound]])
    rows, moves = np.vstack([table, pairs]), np.append(rounded, np.ones(len(pairs)))
    room = 2.0 * _EPS * (np.abs(rows[:, :-1]) @ most + np.abs(rows[:, -1]))
    return rows[:, :-1], rows[:, -1] + moves * room, body.C[sound], body.d[sound]


def _hull(exact: ExactRows) -> Table | None:
    """The rows of the hull of the generators; None if they are too many."""
    try:
        found = generators_of(exact, LONG_RAYS)
        return float_rows(found) if len(found.vertices) else nothing(found.dim)
    except UndecidedError:
        return None
