"""Vertices, rays and lines: on every kind of set, there and back, and against the exact oracle."""

import numpy as np
import pytest
from exact_sets import polyhedron, supports
from random_programs import many
from sets import CATALOGUE, EMPTY

from polytopes import EmptySetError, Generators, HPolytope


def support_of(G: Generators, c: np.ndarray) -> np.ndarray:
    """Support of the generated set, from the generators alone."""
    along = np.vstack([G.rays, G.lines, -G.lines]) @ c.T
    endless = (along > 1e-9).any(axis=0)
    return np.where(endless, np.inf, (G.vertices @ c.T).max(axis=0))


def integer_directions(n: int) -> np.ndarray:
    return np.vstack([np.random.default_rng(1).integers(-4, 5, (25, n)), np.eye(n, dtype=int), -np.eye(n, dtype=int)])


@pytest.mark.parametrize("name", CATALOGUE)
def test_there_and_back(name: str) -> None:
    P = CATALOGUE[name]
    if name in EMPTY:
        with pytest.raises(EmptySetError):
            P.generators()
        return
    G, c = P.generators(), integer_directions(P.dim)
    assert (len(G.rays) + len(G.lines) == 0) == P.is_bounded()
    np.testing.assert_allclose(support_of(G, c), P.support(c), atol=1e-12)
    again = HPolytope.from_vertices(G.vertices, np.vstack([G.rays, G.lines, -G.lines]))
    if name == "decimal ray":  # its direction was rounded, so that far away the two are apart
        box = HPolytope.box(np.full(P.dim, -99.0), np.full(P.dim, 99.0))
        again, P = again.intersection(box), P.intersection(box)
    assert again.equals(P, tol=1e-9)


def test_integer_systems_match_the_exact_oracle() -> None:
    for k, (_, A, b) in enumerate(many("integer", 150)):
        P = HPolytope(A, b)
        if P.dim > 4 or P.emptiness().status == "empty":
            continue
        exact, G = polyhedron(P), P.generators()
        kinds = list(exact.minimized_generators())
        lines = sum(1 for g in kinds if g.is_line())
        assert len(G.lines) == lines, k
        if lines == 0:
            assert len(G.vertices) == sum(1 for g in kinds if g.is_point()), k
            assert len(G.rays) == sum(1 for g in kinds if g.is_ray()), k
        c = integer_directions(P.dim)
        np.testing.assert_allclose(support_of(G, c), supports(exact, c), atol=1e-9, err_msg=str(k))


def test_a_cone_and_a_wedge_from_rays() -> None:
    quadrant = HPolytope.from_vertices([[1.0, 1.0]], rays=[[1.0, 0.0], [0.0, 2.0]])
    assert quadrant.equals(HPolytope([[-1.0, 0.0], [0.0, -1.0]], [-1.0, -1.0]))
    plane = HPolytope.from_vertices([[0.0, 0.0, 1.0]], rays=[[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    assert plane.equals(HPolytope(np.empty((0, 3)), [], [[0.0, 0.0, 1.0]], [1.0]))
    with pytest.raises(ValueError, match="rays has shape"):
        HPolytope.from_vertices([[0.0, 0.0]], rays=[[1.0, 0.0, 0.0]])


@pytest.mark.parametrize("numbers", [[0.1, 0.3, 0.2], [1e300, -1e300], [5e-324, -0.0], [2.0**-40, 3.0]])
def test_the_hull_of_any_numbers_is_the_segment_between_the_least_and_the_largest(numbers: list[float]) -> None:
    P = HPolytope.from_vertices(np.array(numbers)[:, None])
    assert P.A.tolist() == [[1.0], [-1.0]]
    assert P.b.tolist() == [max(numbers), -min(numbers)]
    assert P.vertices().ravel().tolist() == sorted([min(numbers), max(numbers)])
    assert {"A", "b"} <= set(dir(P))
