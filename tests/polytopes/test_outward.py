"""Decimal sets of every kind: no result misses a point of the exact one, none is empty or unbounded by rounding.

The exact set of an operation is that of the floats of its operands, taken as rationals.  Lines and rays that no float
normal vanishes on (those of an image under decimals) are contained within 2^10 times the size of the vertices.
"""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import pytest

ppl = pytest.importorskip("ppl", reason="needs pplpy: pip install pplpy")

from exact_sets import polyhedron  # noqa: E402
from kinds_of_sets import KINDS, eroded, integer_set, mapped, maximum, total_of  # noqa: E402

from polytopes import HPolytope, convex_hull, union_bounds  # noqa: E402

AMOUNT = pytest.mark.parametrize("count", [40, pytest.param(600, marks=pytest.mark.slow)])
SCALE = 2**60


def decimals(rng: np.random.Generator, kind: str, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and rays of a set of a kind, in multiples of 0.1, 0.3, 0.7 or a third."""
    points, rays, unit = [], [], rng.choice([0.1, 0.3, 0.7, 1 / 3])
    for g in integer_set(rng, kind, n).minimized_generators():
        entries = ([float(c) for c in g.coefficients()] + [0.0] * n)[:n]
        if g.is_point():
            points.append([c / int(g.divisor()) for c in entries])
        else:
            rays += [entries] if g.is_ray() else [entries, [-c for c in entries]]
    return np.array(points) * unit + rng.integers(-9, 10, n) * 0.1, np.reshape(rays, (-1, n)) * unit


def whole(table: np.ndarray, scale: int = SCALE) -> np.ndarray:
    """Floats times 2^60, exactly."""
    return np.array([int(Fraction(v) * scale) for v in table.ravel().tolist()], dtype=object).reshape(table.shape)


def pairs(count: int) -> Iterator[tuple[str, np.random.Generator, HPolytope, HPolytope]]:
    kinds = [kind for kind in KINDS if kind != "empty"]
    for k in range(count):
        rng = np.random.default_rng([23, k])
        first, second, n = *rng.choice(kinds, 2).tolist(), int(rng.choice([1, 2, 2, 3, 3, 4]))
        P, Q = (HPolytope.from_vertices(*decimals(rng, kind, n)) for kind in (first, second))
        yield f"{k}: {first}, {second} in {n}", rng, P, Q


def assert_outer(result: HPolytope, exact: ppl.C_Polyhedron, case: str) -> None:
    """It contains the exact set, is bounded if that is, and then at most 1e-8 of its size larger along the axes."""
    found = polyhedron(result)
    assert found.contains(exact), case
    assert result.emptiness().status == ("empty" if found.is_empty() else "nonempty"), case
    assert result.is_bounded() == found.is_bounded() == exact.is_bounded(), case
    if exact.is_bounded() and not exact.is_empty():
        for row in np.vstack([np.eye(result.dim), -np.eye(result.dim)]).astype(int):
            inner, outer = (Fraction(*(maximum(R, row) or (0, 1))) for R in (exact, found))
            assert outer - inner <= Fraction(1, 10**8) * max(1, abs(inner)), case


@AMOUNT
def test_points_and_rays(count: int) -> None:
    for k in range(2 * count):
        rng = np.random.default_rng([29, k])
        kind, n = str(rng.choice(KINDS[1:])), int(rng.choice([1, 2, 3, 4]))
        V, rays = decimals(rng, kind, n)
        exact, x = ppl.Generator_System(), [ppl.Variable(j) for j in range(n)]
        for table, make in ((V, ppl.point), (rays, ppl.ray)):
            for row in whole(table).tolist():
                form = sum((c * v for c, v in zip(row, x, strict=True)), 0 * x[-1])
                exact.insert(make(form, SCALE) if make is ppl.point else make(form))
        P = HPolytope.from_vertices(V, rays)
        assert_outer(P, ppl.C_Polyhedron(exact), f"{k}: {kind} in {n}")
        for point in V:
            meeting = P.intersection(HPolytope.from_vertices(point[None]))
            assert meeting.emptiness().status == "nonempty", f"{k}: {kind} in {n}"


@AMOUNT
def test_hulls_sums_and_bounds(count: int) -> None:
    for case, rng, P, Q in pairs(count):
        first, second = polyhedron(P), polyhedron(Q)
        both = ppl.C_Polyhedron(first)
        both.poly_hull_assign(second)
        assert_outer(convex_hull([P, Q]), both, case)
        assert_outer(P.minkowski_sum(Q), total_of(first, second), case)
        assert polyhedron(P.remove_redundancy()).contains(first), case
        assert polyhedron(P.pontryagin_difference(Q)).contains(eroded(first, second)), case
        total = P.minkowski_sum(Q)
        assert polyhedron(total.pontryagin_difference(Q)).contains(eroded(polyhedron(total), second)), case
        T = np.vstack([rng.integers(-3, 4, (4, P.dim)) * 0.1, np.eye(P.dim), -np.eye(P.dim)])
        assert polyhedron(P.outer_template(T)).contains(first), case
        assert polyhedron(union_bounds([P, Q], directions=T)).contains(both), case


@AMOUNT
def test_images_and_preimages(count: int) -> None:
    for case, rng, P, _ in pairs(count):
        M, t = (rng.integers(-3, 4, size) * 0.1 for size in ((int(rng.integers(1, 4)), P.dim), 1))
        t = np.repeat(t, len(M))
        exact = mapped(polyhedron(P), whole(M), whole(t), SCALE)
        image = P.affine_map(M, t)
        if exact.is_bounded():
            assert_outer(image, exact, case)
        back = image.preimage(M, t)
        assert back.emptiness().status == "nonempty", case
        assert back.intersection(P).emptiness().status == "nonempty", case


@pytest.mark.parametrize("normal", [[0.36, 0.48, 0.8], [0.1, 0.2, 0.3], [1.0, 1.0, 1.0]])
def test_slices_of_a_box(normal: list[float]) -> None:
    box = HPolytope.box([-1.0] * 3, [1.0] * 3)
    P, Q = (HPolytope(box.A, box.b, [normal], [side]) for side in (0.3, 0.7))
    exact = total_of(polyhedron(P), polyhedron(Q))
    assert_outer(P.minkowski_sum(Q), exact, "sum")
    both = polyhedron(P)
    both.poly_hull_assign(polyhedron(Q))
    assert_outer(convex_hull([P, Q]), both, "hull")


@pytest.mark.parametrize("seed", range(24))
def test_an_image_that_is_a_point_but_for_rounding(seed: int) -> None:
    """Thin in every direction: no coordinate is left that its shadow could be taken on."""
    rng = np.random.default_rng(seed)
    n = 1 + seed % 3
    flat = (rng.normal(size=(1, n)), [0.0]) if seed % 2 and n > 1 else ()
    P = HPolytope(np.vstack([np.eye(n), -np.eye(n)]), rng.uniform(1.0, 2.0, 2 * n), *flat)
    M, t = np.ldexp(rng.normal(size=(n, n)), -58), rng.uniform(1.0, 2.0, n)
    scale = 2**140  # all bits of the floats below
    assert_outer(P.affine_map(M, t), mapped(polyhedron(P), whole(M, scale), whole(t, scale), scale), f"in {n}")


def test_an_entry_that_is_lost_beside_others_makes_no_ray() -> None:
    """A row of 2.5e-32 and 1 is all but an axis: floats of balanced rows took the edge along it for a ray."""
    P = HPolytope.from_vertices([[-0.6, 0.0], [-0.6, 0.3], [1e-16, 0.0]])
    assert P.is_bounded()
    assert len(P.vertices()) == 3
    for k in range(200):
        rng = np.random.default_rng([37, k])
        A = np.round(rng.normal(size=(4, 2)), 1)
        A = np.where(rng.random((4, 2)) < 0.3, 10.0 ** -rng.integers(8, 34, (4, 2)) * rng.choice([-1, 1], (4, 2)), A)
        P = HPolytope(A, 10.0 ** -rng.integers(0, 16, 4) * rng.random(4))
        assert P.is_bounded() == polyhedron(P).is_bounded(), k
        for direction in rng.integers(-9, 10, (3, 2)):
            assert np.isfinite(P.support(direction)) == (maximum(polyhedron(P), direction) is not None), (k, direction)
