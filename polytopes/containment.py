"""Points and sets inside a set, and equality of sets, with a stated tolerance."""

import numpy as np
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.rows import Rows
from polytopes.support import known_nonempty


def contains_points(P: Rows, points: Floats, tol: float) -> NDArray[np.bool_]:
    """For each point (k, n): is it within `tol` of every half-space and hyperplane of P (Euclidean distance)?"""
    lengths, fixed = np.linalg.norm(P.A, axis=1), np.linalg.norm(P.C, axis=1)
    inside = (points @ P.A.T - P.b <= tol * lengths).all(axis=1)
    on: NDArray[np.bool_] = (np.abs(points @ P.C.T - P.d) <= tol * fixed).all(axis=1)
    return inside & on


def contains_set(P: Rows, Q: Rows, tol: float) -> bool:
    """Whether every point of Q is within `tol` of every half-space and hyperplane of P.

    That is ``h_Q(a_i) <= b_i + tol |a_i|`` for every row of P (both signs for an equality); the empty set lies in any.
    """
    if not known_nonempty(Q):
        return True
    normals, rhs = np.vstack([P.A, P.C, -P.C]), np.concatenate([P.b, P.d, -P.d])
    farthest = Q.program.estimate(normals)
    return bool((farthest <= rhs + tol * np.linalg.norm(normals, axis=1)).all())


def equal_sets(P: Rows, Q: Rows, tol: float) -> bool:
    """Whether each set contains the other within `tol`."""
    return contains_set(P, Q, tol) and contains_set(Q, P, tol)
