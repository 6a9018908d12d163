"""Zonotopes around a set, and boxes and templates inside one, against an exact library."""

import numpy as np
import pytest
from exact_sets import polyhedron, shadow
from sets import CATALOGUE, EMPTY, UNBOUNDED

from polytopes import (
    ConstrainedZonotope,
    EmptySetError,
    HPolytope,
    UnboundedError,
    box_directions,
    octagon_directions,
)

EVERY = pytest.mark.parametrize("name", CATALOGUE)
COUNT = pytest.mark.parametrize("count", [4, pytest.param(200, marks=pytest.mark.slow)])


def exact(Z: ConstrainedZonotope) -> object:
    """All of a zonotope, its floats taken as rationals."""
    n, g = Z.generators.shape
    axes = np.hstack([np.zeros((g, n)), np.eye(g)])
    cube = HPolytope(np.vstack([axes, -axes]), np.ones(2 * g), np.hstack([np.eye(n), -Z.generators]), Z.centre)
    return shadow(cube, list(range(n)))


def templates(n: int) -> list:
    skew = np.eye(n) + 0.3 * np.tri(n)
    return ["box", "principal", skew, np.hstack([skew, np.ones((n, 1)), 0.1 * np.eye(n)[:, :1]])]


def random_set(case: int, unit: float = 1.0) -> HPolytope:
    rng = np.random.default_rng([case, 31])
    n = 2 + case % 2
    A = np.vstack([rng.standard_normal((5, n)), np.eye(n), -np.eye(n)])
    return HPolytope(A, unit * rng.uniform(0.5, 1.0, 5 + 2 * n))


@EVERY
def test_zonotopes_around_every_kind_of_set(name: str) -> None:
    P = CATALOGUE[name]
    for generators in templates(P.dim):
        if name in EMPTY | UNBOUNDED:
            with pytest.raises(EmptySetError if name in EMPTY else UnboundedError):
                P.enclosing_zonotope(generators)
            continue
        Z = P.enclosing_zonotope(generators)
        assert not Z.offset.size
        assert exact(Z).contains(polyhedron(P))
    if name not in EMPTY | UNBOUNDED:
        lower, upper = P.bounding_box()
        box = P.enclosing_zonotope()
        np.testing.assert_allclose(box.centre, (lower + upper) / 2.0, atol=1e-16)
        assert box.generators.shape[1] == np.count_nonzero(upper > lower)


@COUNT
@pytest.mark.parametrize("unit", [1.0, 2.0**-300])
def test_zonotopes_are_sound_and_tight(count: int, unit: float) -> None:
    for case in range(count):
        P, n = random_set(case, unit), 2 + case % 2
        lengths = []
        for generators in templates(n):
            Z = P.enclosing_zonotope(generators)
            assert exact(Z).contains(polyhedron(P)), case
            lengths.append(np.linalg.norm(Z.generators / unit, axis=0).sum())
            if isinstance(generators, np.ndarray) and generators.shape == (n, n):
                rows = np.linalg.inv(generators)
                reach = np.abs(rows @ Z.generators).sum(axis=1)
                np.testing.assert_allclose(rows @ Z.centre + reach, P.support(rows), rtol=1e-9, atol=1e-12 * unit)
                np.testing.assert_allclose(reach - rows @ Z.centre, P.support(-rows), rtol=1e-9, atol=1e-12 * unit)
        assert lengths[3] <= lengths[2] * (1 + 1e-7) * np.sqrt(n), (
            case
        )  # scaled by the box, more generators are no worse


def test_a_zonotope_is_its_own_enclosure() -> None:
    hexagon = ConstrainedZonotope([1.0, 2.0], [[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]])
    Z = HPolytope.from_zonotope(hexagon).enclosing_zonotope(hexagon.generators)
    np.testing.assert_allclose(Z.centre, [1.0, 2.0])
    np.testing.assert_allclose(Z.generators[:, :3], hexagon.generators, atol=1e-9)
    diagonal = HPolytope.from_vertices([[0.0, 0.0], [1.0, 1.0], [1.0, 1.25], [0.0, 0.25]])
    turned = diagonal.enclosing_zonotope("principal")
    assert np.linalg.det(turned.generators[:, :2]) ** 2 < np.linalg.det(diagonal.enclosing_zonotope().generators) ** 2
    for wrong, words in ((np.ones((2, 3)), "span less than"), ("pca", "expected 'box'"), (np.ones((3, 2)), "shape")):
        with pytest.raises(ValueError, match=words):
            diagonal.enclosing_zonotope(wrong)


@EVERY
def test_templates_inside_every_kind_of_set(name: str) -> None:
    P = CATALOGUE[name]
    for T in (box_directions(P.dim), octagon_directions(P.dim) if P.dim > 1 else np.array([[2.0], [-0.5], [0.0]])):
        if name in EMPTY | UNBOUNDED:
            with pytest.raises(EmptySetError if name in EMPTY else UnboundedError):
                P.inner_template(T)
            continue
        inner = P.inner_template(T)
        assert polyhedron(P).contains(polyhedron(inner))
        assert inner.affine_dim() == P.affine_dim()
        if name in ("square", "cube", "scaled rows", "thin", "segment by an equality", "touching", "interval"):
            assert inner.volume(relative=True) == pytest.approx(P.volume(relative=True), rel=1e-9)


@COUNT
@pytest.mark.parametrize("unit", [1.0, 2.0**300])
def test_no_face_of_a_template_inside_can_move_out(count: int, unit: float) -> None:
    for case in range(count):
        P, T = random_set(case, unit), octagon_directions(2 + case % 2)
        inner = P.inner_template(T)
        assert polyhedron(P).contains(polyhedron(inner)), case
        for j in inner.minimal_rows().inequalities:
            larger = inner.with_rows(inner.A, inner.b + 1e-6 * unit * (np.arange(inner.b.size) == j))
            assert not larger <= P, case


@COUNT
@pytest.mark.parametrize("unit", [1.0, 2.0**-300])
def test_boxes_inside_lie_there_exactly_and_can_have_the_largest_volume(count: int, unit: float) -> None:
    rng = np.random.default_rng(7)
    for case in range(count):
        P, volumes = random_set(case, unit), []
        for by_volume in (False, True):
            lower, upper = P.inner_box(by_volume=by_volume)
            assert polyhedron(P).contains(polyhedron(HPolytope.box(lower, upper))), case
            volumes.append(np.prod((upper - lower) / unit))
        assert volumes[0] <= volumes[1] * (1 + 1e-5), case
        for x in P.random_points(40, rng):  # other boxes: any proportions about any centre
            widths = rng.random(P.dim)
            room = ((P.b - P.A @ x) / (np.abs(P.A) @ widths)).min()
            assert np.prod(2.0 * widths * room / unit) <= volumes[1] * (1 + 1e-5), case


@pytest.mark.parametrize("n", [1, 2, 4])
def test_largest_boxes_in_closed_form(n: int) -> None:
    lower, upper = HPolytope.simplex(n).inner_box(by_volume=True)
    assert np.prod(upper - lower) == pytest.approx(float(n) ** -n, rel=1e-6)
    lower, upper = HPolytope.cross_polytope(n).scale(n).inner_box(by_volume=True)
    np.testing.assert_allclose([lower, upper], [-np.ones(n), np.ones(n)], rtol=1e-4)


def test_directions_that_hold_no_set_are_refused() -> None:
    with pytest.raises(ValueError, match="directions leave sets unbounded"):
        HPolytope.simplex(2).inner_template([[1.0, 0.0], [0.0, 1.0]])
    with pytest.raises(TypeError, match="by_volume="):
        HPolytope.simplex(2).inner_box(True)  # type: ignore[misc]
