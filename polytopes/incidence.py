"""Which vertices of a bounded set lie in which facets, and the faces that follow from it: exact combinatorics.

Vertices and rows are taken in integers, so that a vertex is in a facet or is not.  Everything else follows from that
table: a face is the set of vertices that some facets share, and two vertices are joined by an edge if no third one is
in all facets that both are in (Ziegler 1995, section 2.2).  Sets of vertices and facets are the bits of integers.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polytopes.checks import Floats
from polytopes.derived import derived
from polytopes.errors import EmptySetError, UnboundedError
from polytopes.exact_generators import integer_form
from polytopes.generators import in_integers
from polytopes.integers import floats_of_points
from polytopes.minkowski_weyl import ExactGenerators
from polytopes.rows import Rows
from polytopes.shown import Shown
from polytopes.support import is_bounded, known_nonempty


@dataclass(frozen=True, eq=False)
class Incidence(Shown):
    """Vertices and facets of a bounded set, and which of them meet; exact.

    Attributes
    ----------
    dim : int
        Dimension d of the set itself, not of the space.
    vertices : array (k, n)
        The vertices to the nearest floats, in lexicographic order.
    rows : array (f,) of int
        The row of A of each facet, the first one where several are alike.
    table : array (f, k) of bool
        Whether a vertex lies in a facet.
    """

    dim: int
    vertices: Floats
    rows: NDArray[np.int64]
    table: NDArray[np.bool_]

    @derived
    def _facets(self) -> list[int]:
        """The vertices of each facet, as bits."""
        return [_bits(np.flatnonzero(row)) for row in self.table]

    def vertex_adjacency(self) -> NDArray[np.bool_]:
        """Which vertices are joined by an edge: array (k, k)."""
        return _adjacency(self.table.T, self.dim - 1)

    def facet_adjacency(self) -> NDArray[np.bool_]:
        """Which facets share a face of one dimension less: array (f, f)."""
        return _adjacency(self.table, self.dim - 1) if self.dim > 1 else np.zeros((len(self.rows),) * 2, dtype=bool)

    def faces(self, dim: int) -> list[tuple[int, ...]]:
        """The faces of a dimension, from 0 (vertices) to that of the set: the numbers of their vertices, in order.

        Parameters
        ----------
        dim : int

        Raises
        ------
        ValueError
            If there are no faces of that dimension.
        """
        if not 0 <= dim <= self.dim:
            raise ValueError(f"dim is {dim}; expected 0 to {self.dim}, the dimension of the set.")
        return sorted(map(_numbers, self._levels[dim]))

    def f_vector(self) -> tuple[int, ...]:
        """How many faces there are of each dimension, from vertices to facets; Euler's relation holds for them."""
        return tuple(len(level) for level in self._levels[:-1])

    @derived
    def _levels(self) -> list[list[int]]:
        """The faces of each dimension, as bits, from vertices to the set itself."""
        levels = [[_bits(range(len(self.vertices)))]]
        for _ in range(self.dim):
            levels.append(list({below: None for face in levels[-1] for below in self.facets_of(face)}))
        return levels[::-1]

    def facets_of(self, face: int) -> list[int]:
        """The largest faces in a face, which is the bits of its vertices; alike the results."""
        shared = {face & facet for facet in self._facets if facet & face != face}
        return [one for one in shared if one and not any(one != other and one & other == one for other in shared)]

    def simplices(self) -> NDArray[np.int64]:
        """A triangulation without new points: the numbers (s, d + 1) of the vertices of simplices.

        Each face is joined from its first vertex to the triangulations of its facets that do not hold that vertex
        (a pulling triangulation, De Loera, Rambau and Santos 2010, section 4.3.2); combinatorial, hence exact.
        """
        known: dict[int, list[tuple[int, ...]]] = {}

        def split(face: int) -> list[tuple[int, ...]]:
            if face not in known:
                apex = (face & -face).bit_length() - 1
                rest = face & (face - 1)
                parts = [part for below in self.facets_of(face) if not below >> apex & 1 for part in split(below)]
                known[face] = [(apex, *part) for part in parts] if rest else [(apex,)]
            return known[face]

        return np.array(split(_bits(range(len(self.vertices)))), dtype=np.int64)


def incidence(P: Rows) -> Incidence:
    """The vertices of a bounded set and its facets.

    Raises
    ------
    EmptySetError, UnboundedError
        If there are no vertices that describe the set.
    UndecidedError
        If the double description passes 10 000 rays.
    """
    if not known_nonempty(P):
        raise EmptySetError("the empty set has no vertices; ask is_empty() first.")
    if not is_bounded(P):
        raise UnboundedError("P is unbounded, so its vertices do not describe it; intersect it with a box first.")
    found = sorted_vertices(P)
    corners, rows = found.vertices.astype(object), integer_form(P.A, P.b, P.C, P.d).inequalities.astype(object)
    touches = rows[:, :-1] @ corners[:, :-1].T == rows[:, -1:] * corners[:, -1]
    facets = _largest([_bits(np.flatnonzero(row)) for row in touches], _bits(range(len(corners))))
    table = touches[facets] if facets else np.zeros((0, len(corners)), dtype=bool)
    return Incidence(found.affine_dim, found.points, np.array(facets, dtype=np.int64), table.astype(bool))


def sorted_vertices(P: Rows) -> ExactGenerators:
    """The vertices of a bounded set in integers, in lexicographic order of their floats."""
    found = in_integers(P)
    order = np.lexsort(floats_of_points(found.vertices).T[::-1])
    return ExactGenerators(found.vertices[order], found.rays, found.lines)


def _largest(faces: list[int], everything: int) -> list[int]:
    """Numbers of the faces that are facets: not the set itself, in no other one, the first of those that are alike."""
    proper = {face: i for i, face in reversed(list(enumerate(faces))) if face and face != everything}
    return sorted(i for face, i in proper.items() if not any(face != one and face & one == face for one in proper))


def _adjacency(table: NDArray[np.bool_], least: int) -> NDArray[np.bool_]:
    """Which of the items (k, f) are adjacent: they share `least` properties or more, and no third one has all these."""
    count = table.astype(np.int64)
    shared = count @ count.T
    adjacent = np.zeros((len(table), len(table)), dtype=bool)
    for i, j in np.argwhere(np.triu(shared >= least, 1)).tolist():
        holders = table[:, table[i] & table[j]].all(axis=1)
        adjacent[i, j] = adjacent[j, i] = np.count_nonzero(holders) == 2
    return adjacent


def _bits(numbers: Iterable[int]) -> int:
    whole = 0
    for i in numbers:
        whole |= 1 << int(i)
    return whole


def _numbers(bits: int) -> tuple[int, ...]:
    return tuple(i for i in range(bits.bit_length()) if bits >> i & 1)
