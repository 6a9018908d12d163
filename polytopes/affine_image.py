"""The image ``{M x + t : x in P}`` of a set under an affine map, whose support is ``h_P(M'c) + c't``."""

import numpy as np

from polytopes.checks import Floats
from polytopes.generators import in_integers
from polytopes.integers import exact_product, integer_rows, short
from polytopes.minkowski_weyl import image
from polytopes.outer_supports import upper_supports
from polytopes.outward import float_rows
from polytopes.projection import project
from polytopes.rows import Rows, Table, nothing
from polytopes.support import is_bounded, known_nonempty

_EPS = float(np.finfo(np.float64).eps)
_DIRECT = 1e8  # condition number up to which an image is formed with the inverse of the map
_MAX_ROWS = 20_000


def affine_image(P: Rows, M: Floats, t: Floats) -> Table:
    """Rows A, b, C, d of the image, for any matrix M (p, n) and shift t (p,).

    ``A inv(M)``, where that needs no rounding (a permutation, integers of determinant one, powers of two).  The hull of
    the images of the generators, in integers, where P is computed with in integers and P or its image is flat or thin
    or the map short, and where P is unbounded.  Else P is bounded and full-dimensional: normals ``A inv(M)`` for a
    well-conditioned square map, or those of the projection of ``{(z, x) : z = M x + t, x in P}``, with supports
    rounded up.
    """
    p, n = M.shape
    if not known_nonempty(P):
        return nothing(p)
    square = p == n and np.linalg.cond(M) < _DIRECT
    moved = _moved_rows(P, M, t) if square else None
    if moved is not None:
        return moved
    numbers = integer_rows(np.append(np.hstack([M, t[:, None]]).ravel(), 1.0)[None])
    if not is_bounded(P) or (P.exact is not None and (short(numbers) or not (square and P.wide))):
        *whole, scale = numbers[0].tolist()
        table = np.array(whole, dtype=object).reshape(p, n + 1)
        return float_rows(image(in_integers(P), table[:, :-1], table[:, -1], scale))
    normals = _normals(P, M, t, square)
    return *_supported(P, M, t, normals), np.empty((0, p)), np.empty(0)


def _moved_rows(P: Rows, M: Floats, t: Floats) -> Table | None:
    """``A inv(M) z <= b + A inv(M) t``, and the equalities alike; None if a float of it had to be rounded."""
    back = np.asarray(np.linalg.inv(M), dtype=np.float64)
    identity, certain = exact_product(M, back)
    if not certain.all() or (identity != np.eye(len(M))).any():
        return None
    rows, certain = exact_product(np.vstack([P.A, P.C]), back)
    shifts, known = exact_product(np.hstack([rows, np.append(P.b, P.d)[:, None]]), np.append(t, 1.0)[:, None])
    if not (certain.all() and known.all()):
        return None
    k = P.b.size
    return rows[:k], shifts[:k, 0], rows[k:], shifts[k:, 0]


def _normals(P: Rows, M: Floats, t: Floats, square: bool) -> Floats:
    """Normals of the image of a bounded set, and of the subspace that it lies in."""
    p = len(M)
    if square:
        return np.asarray(np.linalg.solve(M.T, np.vstack([P.A, P.C, -P.C]).T).T, dtype=np.float64)
    lifted = Rows(
        np.hstack([np.zeros((P.b.size, p)), P.A]),
        P.b,
        np.vstack([np.hstack([np.eye(p), -M]), np.hstack([np.zeros((P.d.size, p)), P.C])]),
        np.append(t, P.d),
    )
    A, _, C, _ = project(lifted, range(p), "auto", _MAX_ROWS, False)
    return np.vstack([A, C, -C])


def _supported(P: Rows, M: Floats, t: Floats, normals: Floats) -> tuple[Floats, Floats]:
    """The normals with ``h_P(M'a) + a't``, rounded up."""
    unit = (sum(M.shape) + 2) * _EPS
    supports = upper_supports(P, normals @ M, unit * np.abs(normals) @ np.abs(M))
    moved = normals @ t
    return normals, supports + moved + unit * (np.abs(supports) + np.abs(normals) @ np.abs(t))
