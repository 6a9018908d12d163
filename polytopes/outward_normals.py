"""Normals in floats near exact ones, and the supports along them.

A row whose normal is rounded holds all over a set if its right-hand side is the support along the rounded normal,
which must not rise along a ray or change along a line.  So normals are rounded within those that vanish on the lines,
and tilted a little towards one that falls along every ray if they rise along one.  Where lines leave no room for that
(their integers are too long) the row holds for the part of the set within 2^10 times the size of its vertices.
"""

from fractions import Fraction
from math import gcd

import numpy as np
from flint import fmpz_mat
from numpy.typing import NDArray

from polytopes.double_description import Integers, null_space
from polytopes.integers import Floats, are_floats, as_floats, floats_of_points, up, whole_numbers
from polytopes.minkowski_weyl import ExactGenerators

_BITS = 53  # of a float
_TILTS = (0, 50, 46, 42, 38, 34, 30)  # exponents of the tilts that are tried, 0 for none
_LEAST_BITS = 20  # of a normal across lines; below, the lines are missed by rounding instead
_FAR = 2.0**10  # times the size of the vertices: how far along missed lines a row still holds
_EPS = float(np.finfo(np.float64).eps)
_TINY = float(np.finfo(np.float64).tiny)


def support_of(generators: ExactGenerators, normal: Floats) -> Fraction | float:
    """The exact support of a nonempty set along a normal; inf where it is unbounded."""
    whole, exponent = whole_numbers(normal)
    if (products(generators.rays, whole) > 0).any() or products(generators.lines, whole).any():
        return np.inf
    farthest = generators.vertices[_may_be_farthest(generators.points, normal)]
    best, size = 0, 0
    for value, t in zip(products(farthest[:, :-1], whole).tolist(), farthest[:, -1].tolist(), strict=True):
        if not size or value * size > best * t:
            best, size = value, t
    return Fraction(best, size << exponent)


def _may_be_farthest(points: Floats, normal: Floats) -> NDArray[np.bool_]:
    """Which points (k, n), rounded to nearest, rounding allows to be the farthest along a normal (n,)."""
    with np.errstate(over="ignore", invalid="ignore"):
        values = points @ normal
        room = (normal.size + 4) * _EPS * (np.abs(points) @ np.abs(normal)) + _TINY
        best = np.fmax.reduce(values - room, initial=-np.inf)
        return ~(values + room < best)  # also what is not a number


def products(rows: Integers, whole: NDArray[np.object_]) -> NDArray[np.object_]:
    product: NDArray[np.object_] = rows.astype(object) @ whole
    return product


class OutwardNormals:
    """Normals in floats near exact rows of one set.

    Parameters
    ----------
    generators : ExactGenerators
        Of the nonempty set.
    inner : list of m lists of n integers
        Normals of rows of the set, whose sum falls along every ray.
    """

    def __init__(self, generators: ExactGenerators, inner: list[list[int]]) -> None:
        self._corners = ExactGenerators(generators.vertices, generators.rays[:0], generators.lines[:0])
        self._rays = generators.rays
        self._inner = inner
        self._lines = generators.lines
        self._across = _short_normals(generators.lines) if len(generators.lines) else None

    def row(self, normal: list[int]) -> Floats:
        """A row ``[a, b]`` of floats that holds all over the set, its normal near an exact one."""
        divisor = gcd(*normal)
        exact = [v // divisor for v in normal]
        near = as_floats(exact, exact)
        rounded = near if are_floats(exact) and self._holds(near) else self._rounded(exact)
        bound = up(support_of(self._corners, rounded))
        if not self._holds(rounded):
            points = floats_of_points(self._corners.vertices)
            bound += 2.0 * _EPS * _FAR * float(np.abs(rounded) @ np.abs(points).max(axis=0))
        return np.append(rounded, bound)

    def _holds(self, normal: Floats) -> bool:
        """Whether the normal rises along no ray and is constant along the lines."""
        whole = whole_numbers(normal)[0]
        return not ((products(self._rays, whole) > 0).any() or products(self._lines, whole).any())

    def _rounded(self, exact: list[int]) -> Floats:
        """The nearest normal that rises along no ray; the nearest one, if only a large tilt would do."""
        for tilt in _TILTS if len(self._rays) and self._inner else _TILTS[:1]:
            normal = self._nearest(self._tilted(exact, tilt) if tilt else exact)
            if self._holds(normal):
                return normal
        return self._nearest(exact)

    def _tilted(self, exact: list[int], bits: int) -> list[int]:
        """The normal and 2^-bits of one that falls along every ray: the sum of all normals, of one length."""
        lengths = [max(map(abs, row)).bit_length() for row in self._inner]
        alike = [[v << (max(lengths) - k) for v in row] for row, k in zip(self._inner, lengths, strict=True)]
        inner = [sum(column) for column in zip(*alike, strict=True)]
        size, own = max(map(abs, inner)).bit_length(), max(map(abs, exact)).bit_length()
        return [(u << (bits + size)) + (v << own) for u, v in zip(exact, inner, strict=True)]

    def _nearest(self, exact: list[int]) -> Floats:
        """The normal to the nearest floats, or to fewer bits so that it vanishes on the lines."""
        if self._across is None:
            return as_floats(exact, exact)
        weights = _solved(self._across, exact)
        room = _BITS - max(map(abs, self._across.ravel().tolist())).bit_length() - len(weights).bit_length()
        if room < _LEAST_BITS:
            return as_floats(exact, exact)
        factor = Fraction(1 << room) / max(map(abs, weights))
        whole = np.array([round(w * factor) for w in weights], dtype=object) @ self._across
        return as_floats(whole.tolist(), whole.tolist())


def _short_normals(lines: Integers) -> Integers:
    """A basis of the normals that vanish on lines, reduced so that its integers are short."""
    basis = null_space(lines)[0]
    reduced = fmpz_mat(len(basis), basis.shape[1], basis.ravel().tolist()).lll()
    return np.array([[int(v) for v in row] for row in reduced.tolist()], dtype=object).reshape(basis.shape)


def _solved(basis: Integers, vector: list[int]) -> list[Fraction]:
    """The weights of a vector in a basis of the space it lies in."""
    k, n = basis.shape
    system = fmpz_mat(k, n, basis.ravel().tolist())
    gram = system * system.transpose()
    solution = gram.solve(system * fmpz_mat(n, 1, vector))
    return [Fraction(int(solution[i, 0].p), int(solution[i, 0].q)) for i in range(k)]
