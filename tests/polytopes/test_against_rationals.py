"""Thousands of small systems against exact rational arithmetic: emptiness, redundancy, projection, sum, hull, image.

The result of an operation, its floats taken as rationals, must be the exact set: equal, or each in the other to within
1e-9 (a distance), with as many rows and equalities as the exact minimal description.  `make test` runs some hundreds
of systems of each kind, `make test-slow` several thousand.
"""

import numpy as np
import ppl
import pytest
from exact_sets import minimal_size, polyhedron, shadow, supports, within
from integer_systems import KINDS, many, system

from polytopes import HPolytope, convex_hull
from polytopes.projection import METHODS

AMOUNT = pytest.mark.parametrize("count", [60, pytest.param(1400, marks=pytest.mark.slow)])
EVERY = pytest.mark.parametrize("kind", KINDS)


def assert_exact(result: HPolytope, exact: ppl.C_Polyhedron, case: str) -> None:
    """The same set, and as many rows as it has facets once redundancy is removed."""
    assert result.emptiness().status == ("empty" if exact.is_empty() else "nonempty"), case
    minimal = result.remove_redundancy()
    for Q in (result, minimal):
        found = polyhedron(Q)
        assert found == exact or (within(found, exact, 1e-9) and within(exact, found, 1e-9)), case
    assert (minimal.b.size, minimal.d.size) == ((1, 0) if exact.is_empty() else minimal_size(exact)), case


def other(rng: np.random.Generator, kind: str, P: HPolytope) -> HPolytope:
    """A second set in the space of P, of the same kind or of another."""
    return system(rng, kind if rng.random() < 0.5 else str(rng.choice(KINDS)), P.dim)


@AMOUNT
@EVERY
def test_emptiness_redundancy_and_dimension(kind: str, count: int) -> None:
    for case, rng, P in many(kind, 2 * count, (1, 2, 3, 4)):
        exact = polyhedron(P)
        assert_exact(P, exact, case)
        assert P.affine_dim() == (-1 if exact.is_empty() else exact.affine_dimension()), case
        assert P.is_bounded() == exact.is_bounded(), case
        c = rng.integers(-4, 5, (6, P.dim))
        np.testing.assert_allclose(P.support(c), supports(exact, c), atol=1e-9, err_msg=case)
        proof = P.emptiness().certificate
        assert (proof is not None and proof.verify(P)) == exact.is_empty(), case


@AMOUNT
@EVERY
def test_projection(kind: str, count: int) -> None:
    for case, rng, P in many(kind, 2 * count, (2, 3, 4)):
        keep = rng.permutation(P.dim)[: int(rng.integers(1, P.dim))].tolist()
        bounded = polyhedron(P).is_bounded()
        method = str(rng.choice(METHODS if bounded else ("auto", "fourier-motzkin")))
        assert_exact(P.project(keep, method=method), shadow(P, keep), f"{case} {method}")


@AMOUNT
@EVERY
def test_minkowski_sum(kind: str, count: int) -> None:
    for case, rng, P in many(kind, count, (1, 2, 3)):
        Q = other(rng, kind, P)
        exact = polyhedron(P.product(Q))
        for j in range(P.dim):
            exact.affine_image(ppl.Variable(j), ppl.Variable(j) + ppl.Variable(j + P.dim))
        exact.remove_higher_space_dimensions(P.dim)
        assert_exact(P.minkowski_sum(Q), exact, case)


@AMOUNT
@EVERY
def test_convex_hull(kind: str, count: int) -> None:
    for case, rng, P in many(kind, count, (1, 2, 3)):
        Q = other(rng, kind, P)
        exact = polyhedron(P)
        exact.poly_hull_assign(polyhedron(Q))
        assert_exact(convex_hull([P, Q]), exact, case)


@AMOUNT
@EVERY
def test_affine_image(kind: str, count: int) -> None:
    for case, rng, P in many(kind, count, (1, 2, 3)):
        M, t = rng.integers(-2, 3, (int(rng.integers(1, 4)), P.dim)), rng.integers(-2, 3, P.dim)
        graph = HPolytope(
            np.hstack([np.zeros((P.b.size, len(M))), P.A]), P.b,
            np.vstack([np.hstack([np.zeros((P.d.size, len(M))), P.C]), np.hstack([np.eye(len(M)), -M])]),
            np.append(P.d, M @ t),
        )  # fmt: skip
        assert_exact(P.affine_map(M, M @ t), shadow(graph, list(range(len(M)))), case)


@AMOUNT
@EVERY
def test_pontryagin_difference(kind: str, count: int) -> None:
    for case, rng, P in many(kind, count, (1, 2, 3)):
        Q = other(rng, kind, P)
        assert_exact(P.pontryagin_difference(Q), eroded(P, polyhedron(Q)), case)


def eroded(P: HPolytope, Q: ppl.C_Polyhedron) -> ppl.C_Polyhedron:
    """Every row of P (both signs of an equality) moved inward by the exact support of Q."""
    system = ppl.Constraint_System()
    x = [ppl.Variable(j) for j in range(P.dim)]
    system.insert(0 * x[-1] <= 0)
    for row, value in zip(np.vstack([P.A, P.C, -P.C]), np.concatenate([P.b, P.d, -P.d]), strict=True):
        form = sum((int(c) * v for c, v in zip(row, x, strict=True)), 0 * x[0])
        if Q.is_empty():
            continue
        answer = Q.maximize(form)
        if not answer["bounded"]:
            return ppl.C_Polyhedron(P.dim, "empty")
        system.insert(int(answer["sup_d"]) * (form - int(value)) + int(answer["sup_n"]) <= 0)
    return ppl.C_Polyhedron(system)


@AMOUNT
@EVERY
def test_generators(kind: str, count: int) -> None:
    for case, _, P in many(kind, count, (1, 2, 3)):
        exact = polyhedron(P)
        if exact.is_empty():
            continue
        G, expected = P.generators(), list(exact.minimized_generators())
        counts = len(G.vertices), len(G.rays), len(G.lines)
        assert counts == tuple(sum(map(k, expected)) for k in (is_point, is_ray, is_line)), case
        again = polyhedron(HPolytope.from_vertices(G.vertices, np.vstack([G.rays, G.lines, -G.lines])))
        whole = (G.vertices * 2**20 % 1.0 == 0.0).all()  # no vertex was rounded
        flat = exact.affine_dimension() < P.dim  # rounded vertices of a flat set span a sliver, whose hull is outer
        tight = flat or within(again, exact, 1e-9)
        assert again == exact or (not whole and within(exact, again, 1e-9) and tight), case


def is_point(g: ppl.Generator) -> bool:
    return bool(g.is_point())


def is_ray(g: ppl.Generator) -> bool:
    return bool(g.is_ray())


def is_line(g: ppl.Generator) -> bool:
    return bool(g.is_line())
