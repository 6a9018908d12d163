"""Dense linear programs of few variables, and what is made of many of them: the face of `core/polytopes`.

Results and scratch are allocated here; the core writes them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes.native import Address, Entries, Given, Integer, Real, function, scratch

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

OPTIMAL, STOPPED, UNBOUNDED, AMBIGUOUS, LIMIT = range(5)
FINISHED, TOO_MANY, OPEN, PAUSED, _NO_ROOM = range(5)

_UNPROVEN = -1
_OVERFLOW, _MORE_RAYS, _MORE_ROOM = -1, -2, -3  # why a double description ends
_RAYS = 500  # of a cone, for which there is room from the start
_ROOM = 1000  # rows of an elimination for which there is room from the start


def _room(name: str, sizes: int) -> Any:
    """The function of the core that says how many doubles one of its functions works in."""
    return lru_cache(1024)(function(f"fdi_{name}_room", *[Integer] * sizes, returns=Integer))


_interior = function("fdi_interior", *[Integer] * 2, *[Given] * 4, Real, Entries, Address, returns=Integer)
_interior_room = _room("interior", 2)
_strictly_inside = function("fdi_strictly_inside", *[Integer] * 2, *[Given] * 3, *[Address] * 3, returns=Integer)
_supports = function("fdi_supports", *[Integer] * 3, *[Given] * 4, *[Entries] * 3, Address)
_supports_room = _room("supports", 3)
_gaps = function("fdi_gaps", *[Integer] * 2, *[Given] * 6, Entries)
_irredundant = function("fdi_irredundant", *[Integer] * 2, *[Given] * 3, *[Entries] * 2, Address, returns=Integer)
_irredundant_room = _room("irredundant", 2)
_eliminate = function("fdi_eliminate", *[Integer] * 3, *[Entries] * 10, returns=Integer)
_eliminate_room = _room("eliminate", 2)
_cone_rays = function(
    "fdi_cone_rays", *[Integer] * 2, *[Given] * 2, *[Integer] * 2, *[Entries] * 3, Address, returns=Integer
)
_cone_rays_room = _room("cone_rays", 3)
_pointed_cone = function("fdi_pointed_cone", *[Integer] * 2, Given, *[Integer] * 2, Entries, Address, returns=Integer)
_pointed_cone_room = _room("pointed_cone", 3)
_integer_rows = function("fdi_integer_rows", *[Integer] * 2, Given, Entries, returns=Integer)
_exponents = function("fdi_exponents", *[Integer] * 2, *[Given] * 2, *[Entries] * 2, Address)
_exponents_room = _room("exponents", 2)
_scaled = function("fdi_scaled", *[Integer] * 2, *[Given] * 2, *[Entries] * 2, Address, returns=Integer)
_scaled_room = _room("scaled", 2)


def interior(AT: Floats, b: Floats, norms: Floats, x0: Floats, times: float) -> tuple[Floats, float, int, Floats]:
    """Largest ball ``a_i'x + |a_i| r <= b_i``, up to a limit of its radius.

    Parameters
    ----------
    AT, b : arrays (d, m) and (m,)
        Scaled rows, transposed.
    norms : array (m,)
        Euclidean norms of the rows.
    x0 : array (d,)
        Any starting point; it need not be feasible.
    times : float
        The limit, in largest entries of b (in ones, if b is zero); keeps the program bounded on unbounded sets.

    Returns
    -------
    x, r, status, multipliers
        Centre (d,), radius (negative if the rows have no common point, inf about the limit), status, and multipliers of
        the rows (m,). With r < 0 they combine the rows to ``0'x <= r``: Farkas' multipliers.
    """
    d, m = AT.shape
    found = np.empty(d + 1 + m)
    status = _interior(d, m, AT, b, norms, x0, times, found, scratch(_interior_room(d, m)))
    return found[:d], found.item(d), status, found[d + 1 :]


def strictly_inside(AT: Floats, b: Floats, z: Floats, errors: tuple[Floats, Floats] | None) -> bool:
    """Whether every slack of a point exceeds what is rounded in it, and in its row.

    Parameters
    ----------
    AT, b : arrays (d, m) and (m,)
        Scaled rows, transposed.
    z : array (d,)
    errors : arrays (m, d) and (m,), optional
        Bounds of what was rounded in the entries of the rows and of b.
    """
    d, m = AT.shape
    of_rows, of_rhs = (None, None) if errors is None else (error.tobytes() for error in errors)
    return bool(_strictly_inside(d, m, AT, b, z, of_rows, of_rhs, scratch(2 * m)))


def supports(
    AT: Floats, b: Floats, x0: Floats, directions: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats, Indices, Indices]:
    """Support points in k directions, each program started from the vertex of its neighbour.

    Parameters
    ----------
    AT, b : arrays (d, m) and (m,)
        Scaled rows, transposed.
    x0 : array (d,)
        A feasible point.
    directions : array (k, d)

    Returns
    -------
    points, multipliers, bounds, spare, beside, active, status
        Arrays (k, d), (k, m), (k,), (k,), (k, d), (k, d), (k,).  All but the last mean something only where the status
        is `OPTIMAL`: then ``c'x <= bounds - spare + beside'|x|`` for all x of the set.
    """
    (d, m), k = AT.shape, len(directions)
    found, codes, weights = np.empty((3 * d + 2, k)), np.empty((d + 1, k), np.int64), np.zeros((k, m))
    _supports(
        d, m, k, AT, b, x0, directions, found, codes, weights,
        scratch(_supports_room(d, m, k)),
    )  # fmt: skip
    points, _, beside = found[: 3 * d].reshape(3, k, d)
    return points, weights, found[3 * d], found[3 * d + 1], beside, codes[:d].reshape(k, d), codes[d]


def gaps(
    forms: Floats, points: Floats, bounds: tuple[Floats, Floats, Floats], reach: Floats
) -> tuple[Floats, Floats, Floats]:
    """How near upper bounds of k forms over a set are to their values at points, where ``|x| <= reach`` all over it.

    Parameters
    ----------
    forms, points : arrays (k, d)
    bounds : arrays (k,), (k,) and (k, d)
        Values, spare and beside: ``c'x <= values - spare + beside'|x|`` for each form c.
    reach : array (d,)

    Returns
    -------
    values, gaps, terms : arrays (k,)
        Bounds of the forms; how far they are above the values at the points; the sizes of the terms of both.
    """
    (k, d), found = forms.shape, np.empty((3, len(forms)))
    _gaps(d, k, forms, points, *bounds, reach, found)
    values, above, terms = found
    return values, above, terms


def irredundant(AT: Floats, b: Floats, x0: Floats) -> tuple[Indices, Indices]:
    """Numbers of a minimal set of rows, and for each whether it is doubtful; Clarkson's method if there are many rows.

    Parameters
    ----------
    AT, b : arrays (d, m) and (m,)
        Rows without zero rows, transposed.
    x0 : array (d,)
        A point strictly inside; if rounding cannot tell that it is, every row is doubtful.

    Returns
    -------
    rows, doubtful : arrays (k,) and (k,) of int
        A doubtful row is kept, and may be redundant.
    """
    d, m = AT.shape
    rows, doubtful = np.empty((2, m), np.int64)
    k = _irredundant(d, m, AT, b, x0, rows, doubtful, scratch(_irredundant_room(d, m)))
    return rows[:k], doubtful[:k]


def eliminate(
    table: Floats, known: Indices, left: Indices, columns: Indices, inner: Floats, max_rows: int, cautious: bool
) -> tuple[Floats, Indices, Indices, Floats, Indices, Indices, int, int]:
    """Eliminate coordinates, the one that makes the fewest pairs first, until Python has to decide.

    Rows are pruned at the end, and before a step whenever it would form many more than the last pruning left.

    Parameters
    ----------
    table : array (m, d + 1)
        Rows ``[A, b]`` without zero rows.
    known : array (m,) of int
        1 for rows that are facets for sure.
    left : array (d,) of int
        Names of the columns of A.
    columns : array of int
        Those to eliminate.
    inner : array (d,)
        A point strictly inside.
    max_rows : int
        Limit on the rows that a step forms.
    cautious : bool
        Whether to stop already where the step after the next is foreseen to form more.

    Returns
    -------
    table, left, columns, inner
        What is left.
    doubtful : array of int
        Whether a row of the table may be redundant.
    trace : array (steps, 2) of int
        Rows formed and kept by each step that was done.
    formed : int
        Rows that the next step would form, if they are too many.
    state : int
        `FINISHED`, `TOO_MANY`, `OPEN` (rows are doubtful) or `PAUSED` (after a long step).
    """
    m, width = table.shape
    left, columns, inner = left.copy(), columns.copy(), inner.copy()
    trace = np.zeros((columns.size, 2), np.int64)
    progress = np.array([m, width - 1, columns.size, m, 0, 0, 0])  # rows, dim, columns, least, steps, long, formed
    state, needed = _NO_ROOM, max(m, _ROOM)
    while state == _NO_ROOM:
        room, rows, size = needed, int(progress[0]), int(progress[0]) * (int(progress[1]) + 1)
        tables, flags = np.empty((2, room * width)), np.zeros((2, room), np.int64)
        tables[0, :size], flags[0, :rows] = table.ravel()[:size], known[:rows]
        table, known = tables[0], flags[0]
        block = np.empty(_eliminate_room(width - 1, room))
        state = _eliminate(
            room, max_rows, cautious, table, tables[1], known, left,
            columns, inner, flags[1], trace, progress, block,
        )  # fmt: skip
        needed = int(progress[6])
    rows, dim, many, _, steps, _, formed = progress.tolist()
    rest = table[: rows * (dim + 1)].reshape(rows, dim + 1)
    return rest, left[:dim], columns[:many], inner[:dim], flags[1, :rows], trace[:steps], formed, state


def cone_rays(GT: Floats, inner: Floats, bounded: bool, most_rays: int) -> tuple[Floats, Indices, float] | None:
    """Extreme rays of a pointed cone ``{y : G y <= 0}`` in general position, proven to be all; None without a proof.

    Parameters
    ----------
    GT : array (d, m)
        Rows of length about one, transposed.
    inner : array (d,)
        A point where all rows are negative, up to rounding.
    bounded : bool
        Whether the last row is ``-y_(d-1) <= 0``: no proof then if a ray lies on it.
    most_rays : int

    Returns
    -------
    rays, active, slack
        Arrays (k, d), with ``y_(d-1) = 1`` if bounded, and (k, d - 1): the rows that each lies on; and the least slack
        of a row at a ray that does not lie on it.
    """
    (d, m), room, slack = GT.shape, min(_RAYS, most_rays), np.empty(2)
    while True:
        rays, active = np.empty((room, d)), np.empty((room, d - 1), np.int64)
        block = scratch(_cone_rays_room(d, m, room))
        k = _cone_rays(d, m, GT, inner, bounded, room, rays, active, slack, block)
        if k >= 0:
            return rays[:k], active[:k], slack.item(0)
        if k == _UNPROVEN or room >= most_rays:
            return None
        room = min(4 * room, most_rays)


def pointed_cone(rows: Indices, most_rays: int) -> Indices | None:
    """Extreme rays (k, d) of a pointed cone ``{y : rows y <= 0}``, primitive; None if int64 could overflow.

    Parameters
    ----------
    rows : integers (m, d)
        Of rank d.
    most_rays : int
        Beyond it, at any step, the method ends with one more.
    """
    (m, d), room = rows.shape, _RAYS
    while True:
        rays, block = np.empty((room, d), np.int64), scratch(_pointed_cone_room(d, m, room))
        k = _pointed_cone(d, m, rows, most_rays, room, rays, block)
        if k == _OVERFLOW:
            return None
        if k != _MORE_ROOM:
            return rays[: most_rays + 1 if k == _MORE_RAYS else k]
        room *= 4


def integer_rows(table: Floats) -> Indices | None:
    """Each row (m, d) as primitive integers, up to a positive factor; None if one does not fit into int64."""
    rows = np.empty(table.shape, np.int64)
    return rows if _integer_rows(*table.shape, table, rows) else None


def exponents(rows: Floats, rhs: Floats) -> tuple[Indices, Indices]:
    """Exponents r (m,) and s (d,): ``2^(r_i + s_j) rows[i, j]`` has rows whose largest entry is in [1/2, 1).

    ``2^r_i rhs[i]`` is at most one, and about one somewhere in each block of coordinates that rows join, and in rows of
    zeros.

    Parameters
    ----------
    rows, rhs : arrays (m, d) and (m,)
    """
    m, d = rows.shape
    r, s = np.empty(m, np.int64), np.empty(d, np.int64)
    _exponents(m, d, rows, rhs, r, s, scratch(_exponents_room(m, d)))
    return r, s


def scaled(rows: Floats, rhs: Floats) -> tuple[Floats, Floats, Floats, Indices, Indices, Indices, int, int]:
    """The rows that are not zero in even units, transposed, with norms in [1/2, 1).

    Parameters
    ----------
    rows, rhs : arrays (m, d) and (m,)

    Returns
    -------
    AT, b, norms : arrays (d, k), (k,) and (k,)
    r, s : arrays (k,) and (d,) of int
        The exponents.
    kept : array (k,) of int
        The rows that are not zero.
    far, lost : int
        A row whose hyperplane is more than 1e150 from the origin, and one whose scaled numbers are no floats; -1 if
        there is none.
    """
    m, d = rows.shape
    found, codes = np.empty((d + 2) * m), np.empty(2 * m + d + 2, np.int64)
    k = _scaled(m, d, rows, rhs, found, codes, scratch(_scaled_room(m, d)))
    AT, b, norms = found[: d * k].reshape(d, k), found[d * k : (d + 1) * k], found[(d + 1) * k : (d + 2) * k]
    s, r, kept, (far, lost) = codes[:d], codes[d : d + k], codes[d + m : d + m + k], codes[d + 2 * m :].tolist()
    return AT, b, norms, r, s, kept, far, lost
