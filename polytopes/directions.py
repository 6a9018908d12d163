"""Directions for templates and supports: those of boxes and octagons, of a matrix, and spread over the sphere."""

import itertools

import numpy as np
from numpy.typing import ArrayLike

from polytopes.checks import Floats, real_array, whole_number


def box_directions(n: int) -> Floats:
    """The axes and their opposites (2 n, n): the normals of boxes."""
    axes = np.eye(whole_number("n", n, least=1))
    return np.vstack([axes, 0.0 - axes])


def octagon_directions(n: int) -> Floats:
    """Those of boxes and all ``+-e_i +- e_j`` (2 n^2, n): the normals of octagons (Mine 2006)."""
    axes = np.eye(whole_number("n", n, least=1))
    signs = list(itertools.product((1.0, -1.0), repeat=2))
    pairs = [0.0 + s * axes[i] + t * axes[j] for i, j in itertools.combinations(range(n), 2) for s, t in signs]
    return np.vstack([box_directions(n), *pairs])


def sphere_directions(n: int, count: int) -> Floats:
    """About evenly spread unit vectors (count, n), the same every time.

    Equal angles in the plane, a spiral of Fibonacci in space, and beyond the points of a low-discrepancy sequence
    (Roberts 2018) through the inverse of the normal distribution.  One dimension has two directions.

    Parameters
    ----------
    n, count : int
    """
    dim, many = whole_number("n", n, least=1), whole_number("count", count, least=1)
    k = np.arange(many) + 0.5
    if dim == 1:
        return np.array([[1.0], [-1.0]])[: min(many, 2)]
    if dim == 2:
        angles = 2.0 * np.pi * (k - 0.5) / many
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if dim == 3:
        z, angles = 1.0 - 2.0 * k / many, np.pi * (1.0 + 5.0**0.5) * k
        radius = np.sqrt(1.0 - z**2)
        return np.stack([radius * np.cos(angles), radius * np.sin(angles), z], axis=1)
    from scipy.special import ndtri

    normal = ndtri(np.mod(0.5 + k[:, None] * _rates(dim), 1.0))
    return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])


def _rates(n: int) -> Floats:
    """Powers (n,) of the root of ``x^(n + 1) = x + 1``, inverted."""
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (n + 1))
    return np.asarray(root ** -np.arange(1.0, n + 1.0))


def eigenvector_directions(M: ArrayLike) -> Floats:
    """Directions that a matrix M (n, n) keeps: its left eigenvectors, of pairs real and imaginary parts, both signs.

    The support of a set along a left eigenvector of a real eigenvalue is multiplied by it in every step of M, so that
    templates of these directions do not grow by wrapping.

    Raises
    ------
    ValueError
        If M is not square.
    """
    matrix = real_array("M", M, ("n", "n"))
    if matrix.shape[0] != matrix.shape[1]:
        raise ValueError(f"M has shape {matrix.shape}; expected a square matrix.")
    values, vectors = np.linalg.eig(matrix.T)
    kept = vectors[:, values.imag >= 0.0].T
    rows = np.vstack([kept.real, kept.imag[np.abs(kept.imag).max(axis=1) > 0.0]])
    return np.vstack([rows, 0.0 - rows])
