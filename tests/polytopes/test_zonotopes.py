"""Constrained zonotopes: to rows and back, against an exact library and supports by programs."""

import numpy as np
import pytest
from exact_sets import polyhedron, shadow
from kinds_of_sets import mapped
from sets import CATALOGUE, EMPTY, UNBOUNDED

from polytopes import ConstrainedZonotope, EmptySetError, HPolytope, UnboundedError


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_bounded_set_is_a_constrained_zonotope(name: str) -> None:
    P = CATALOGUE[name]
    if name in EMPTY | UNBOUNDED:
        with pytest.raises(EmptySetError if name in EMPTY else UnboundedError):
            ConstrainedZonotope.of(P)
        return
    Z = ConstrainedZonotope.of(P)
    rows = int(P.A.any(axis=1).sum())
    assert Z.generators.shape == (P.dim, P.dim + rows)
    assert Z.constraints.shape == (rows + P.d.size, P.dim + rows)
    if P.affine_dim() == P.dim:  # of a flat set, rounding leaves a little more or nothing
        assert HPolytope.from_zonotope(Z).equals(P, tol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_rows_of_random_ones_are_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, g, c = 2 + seed % 2, 4, seed % 3
    G, centre = rng.integers(-2, 3, (n, g)), rng.integers(-2, 3, n)
    A, b = rng.integers(-1, 2, (c, g)), np.zeros(c)
    cube = HPolytope(np.vstack([np.eye(g), -np.eye(g)]), np.ones(2 * g), A, b)
    P = HPolytope.from_zonotope(ConstrainedZonotope(centre, G, A, b))
    assert polyhedron(P) == mapped(polyhedron(cube), G, centre)
    if P.affine_dim() == n:
        again = HPolytope.from_zonotope(ConstrainedZonotope.of(P))
        assert again.equals(P, tol=1e-9)


def test_points_zonotopes_and_wrong_ones() -> None:
    point = ConstrainedZonotope([1.0, 2.0], np.empty((2, 0)))
    assert HPolytope.from_zonotope(point) == HPolytope.box([1.0, 2.0], [1.0, 2.0])
    hexagon = ConstrainedZonotope([0.0, 0.0], [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    assert len(HPolytope.from_zonotope(hexagon).vertices()) == 6
    assert repr(hexagon) == "ConstrainedZonotope(dim=2, 3 generators, 0 constraints)"
    nothing = ConstrainedZonotope([0.0], [[1.0]], [[1.0]], [2.0])
    assert HPolytope.from_zonotope(nothing).is_empty()
    with pytest.raises(ValueError, match="read-only"):
        hexagon.centre[0] = 1.0
    with pytest.raises(ValueError, match=r"generators has shape \(1, 1\)"):
        ConstrainedZonotope([0.0, 1.0], [[1.0]])
    with pytest.raises(ValueError, match="given together"):
        ConstrainedZonotope([0.0], [[1.0]], [[1.0]])
    with pytest.raises(TypeError, match="Z is a HPolytope"):
        HPolytope.from_zonotope(CATALOGUE["square"])  # type: ignore[arg-type]


def lifted(Z: ConstrainedZonotope) -> HPolytope:
    """All ``(x, xi)``, nothing rounded."""
    n, g = Z.generators.shape
    axes = np.hstack([np.zeros((g, n)), np.eye(g)])
    image = np.hstack([np.eye(n), -Z.generators])
    held = np.hstack([np.zeros((len(Z.offset), n)), Z.constraints])
    return HPolytope(np.vstack([axes, -axes]), np.ones(2 * g), np.vstack([image, held]), np.append(Z.centre, Z.offset))


@pytest.mark.parametrize("seed", [*range(12), *(pytest.param(k, marks=pytest.mark.slow) for k in range(12, 400))])
def test_generators_that_only_hold_a_constraint_change_no_set(seed: int) -> None:
    rng = np.random.default_rng([seed, 5])
    n, g, more, c = 1 + seed % 3, int(rng.integers(1, 5)), int(rng.integers(4)), int(rng.integers(4))
    G = np.hstack([rng.integers(-2, 3, (n, g)), np.zeros((n, more))]) * (seed % 7 > 0)
    A = rng.integers(-2, 3, (c, g + more)) * (rng.random((c, g + more)) < 0.6)
    Z = ConstrainedZonotope(rng.integers(-2, 3, n), G, A, rng.integers(-2, 3, c) / 2)
    assert polyhedron(HPolytope.from_zonotope(Z)) == shadow(lifted(Z), list(range(n)))


def test_rows_that_repeat_are_no_work() -> None:
    P = HPolytope.simplex(3)
    Q = HPolytope(np.vstack([P.A] * 100), np.concatenate([P.b] * 100))
    again = HPolytope.from_zonotope(ConstrainedZonotope.of(Q))
    assert again.b.size < 20
    assert again.equals(P, tol=1e-12)
