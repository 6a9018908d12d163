"""Sets whose axes differ by up to twelve orders of magnitude, and thin ones: every operation against exact rationals.

Axes are scaled by powers of two, so that the exact minimal description is that of the even set.
"""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import ppl
import pytest
from exact_sets import minimal_size, polyhedron, shadow

from polytopes import HPolytope, UndecidedError, convex_hull
from polytopes.projection import METHODS

Floats = np.ndarray


def uneven_set(
    rng: np.random.Generator, n: int, span: float, width: float | None = None
) -> tuple[Floats, Floats, Floats]:
    """Integer rows inside a box, with a slab of the given width, axes scaled by 10^-span to 10^span."""
    m = int(rng.integers(3, 9))
    A = np.vstack([rng.integers(-3, 4, (m, n)), np.eye(n), -np.eye(n)]).astype(float)
    b = np.append(rng.integers(1, 6, m), rng.integers(1, 4, 2 * n)).astype(float)
    if width is not None:
        normal = rng.integers(-3, 4, n).astype(float)
        normal[0] = normal[0] or 1.0
        A, b = np.vstack([A, normal, -normal]), np.append(b, [width, 0.0])
    scales = 2.0 ** np.round(rng.uniform(-span, span, n) * np.log2(10.0))
    rows = 2.0 ** rng.integers(-10, 10, len(A))
    return A / scales * rows[:, None], b * rows, scales


def exact_support(exact: ppl.C_Polyhedron, c: Floats) -> Fraction:
    ratios = [float(v).as_integer_ratio() for v in c]
    common = max(q for _, q in ratios)
    form = sum((p * (common // q) * ppl.Variable(j) for j, (p, q) in enumerate(ratios)), 0 * ppl.Variable(len(c) - 1))
    answer = exact.maximize(form)
    assert answer["bounded"]
    return Fraction(int(answer["sup_n"]), int(answer["sup_d"]) * common)


def assert_same(result: HPolytope, exact: ppl.C_Polyhedron, scales: Floats, case: object) -> None:
    """Supports equal to 1e-9 of the width along the direction, or to 1e-14 of the terms of ``c'x``."""
    k = result.dim
    grid = np.random.default_rng(0).integers(-4, 5, (10, k))
    directions = np.vstack([grid[grid.any(axis=1)], np.eye(k), -np.eye(k)]) / scales
    for c, value in zip(directions, result.support(directions), strict=True):
        upper, lower = exact_support(exact, c), -exact_support(exact, -c)
        room = 1e-9 * float(upper - lower) + 4e-14 * float(np.abs(c) @ scales)
        assert np.isfinite(value), case
        assert abs(float(Fraction(value) - upper)) <= room, case


def operations(P: HPolytope, Q: HPolytope, keep: list[int]) -> dict[str, Callable[[], HPolytope]]:
    return {
        "itself": lambda: P,
        "minimal": P.remove_redundancy,
        "vertices": lambda: HPolytope.from_vertices(P.vertices()),
        "sum": lambda: P.minkowski_sum(Q),
        "hull": lambda: convex_hull([P, Q]),
        **{f"projection {m}": lambda m=m: P.project(keep, method=m) for m in METHODS},  # type: ignore[misc]
    }


def exact_sum(P: HPolytope, Q: HPolytope) -> ppl.C_Polyhedron:
    n, lifted = P.dim, polyhedron(P.product(Q))
    for j in range(n):
        lifted.affine_image(ppl.Variable(j), ppl.Variable(j) + ppl.Variable(j + n))
    lifted.remove_higher_space_dimensions(n)
    return lifted


@pytest.mark.parametrize("span", [3.0, 6.0])
def test_uneven_axes_change_nothing(span: float) -> None:
    for trial in range(40):
        rng = np.random.default_rng([int(span), trial])
        n = int(rng.integers(2, 4))
        A, b, scales = uneven_set(rng, n, span)
        P = HPolytope(A, b)
        rows, rhs, _ = uneven_set(rng, n, 0.0)
        Q = HPolytope(rows / scales, rhs)
        keep = rng.permutation(n)[: int(rng.integers(1, n))].tolist()
        hull = polyhedron(P)
        hull.poly_hull_assign(polyhedron(Q))
        expected = {"sum": exact_sum(P, Q), "hull": hull}
        assert P.emptiness().status == "nonempty"
        for name, task in operations(P, Q, keep).items():
            result, axes = task(), scales[keep] if "projection" in name else scales
            exact = expected.get(name) or (shadow(P, keep) if "projection" in name else polyhedron(P))
            assert_same(result, exact, axes, (name, trial))
            minimal = result.remove_redundancy()
            assert (minimal.b.size, minimal.d.size) == minimal_size(exact), (name, trial)
            assert name == "itself" or minimal.b.size == result.b.size, (name, trial)


@pytest.mark.parametrize("span", [0.0, 4.0])
def test_thin_sets_by_elimination_and_redundancy(span: float) -> None:
    """Slabs in integer directions, 1e-6 to 1e-12 wide."""
    for trial in range(40):
        rng = np.random.default_rng([7, int(span), trial])
        n = int(rng.integers(2, 5))
        A, b, scales = uneven_set(rng, n, span, 10.0 ** rng.uniform(-12, -6))
        P = HPolytope(A, b)
        keep = rng.permutation(n)[: int(rng.integers(1, n))].tolist()
        assert P.emptiness().status == "nonempty"
        assert P.affine_dim() == n
        minimal = P.remove_redundancy()
        assert_same(minimal, polyhedron(P), scales, trial)
        assert_same(P.project(keep, method="fourier-motzkin"), shadow(P, keep), scales[keep], trial)
        inner, outer = polyhedron(P), polyhedron(minimal)
        assert outer.contains(inner)  # what was dropped only lets the set grow, and here by nothing
        assert minimal.b.size <= minimal_size(inner)[0]


@pytest.mark.parametrize("width", [1e-6, 1e-7, 1e-8])
def test_skew_slabs_through_their_vertices_keep_their_width(width: float) -> None:
    """Every operation is right to 1e-6 of the width, in the directions of all its own rows."""
    for trial in range(12):
        rng = np.random.default_rng([9, trial])
        n = int(rng.integers(2, 4))
        A, b, _ = uneven_set(rng, n, 0.0, width)
        P, Q = HPolytope(A, b), HPolytope(*uneven_set(rng, n, 0.0)[:2])
        small = HPolytope(Q.A, Q.b * 2.0 ** np.round(np.log2(width)))
        keep = rng.permutation(n)[: int(rng.integers(1, n))].tolist()
        hull = polyhedron(P)
        hull.poly_hull_assign(polyhedron(small))
        expected = {"sum": exact_sum(P, small), "hull": hull}
        for name, task in operations(P, small, keep).items():
            exact = expected.get(name) or (shadow(P, keep) if "projection" in name else polyhedron(P))
            result = task()
            directions = np.vstack([result.A[:20], -result.A[:20]])
            for c, value in zip(directions, result.support(directions), strict=True):
                upper, lower = exact_support(exact, c), -exact_support(exact, -c)
                assert abs(Fraction(float(value)) - upper) <= 1e-6 * (upper - lower), (name, trial)


@pytest.mark.parametrize("width", [1e-9, 1e-11, 1e-13])
def test_a_hull_contains_sets_of_any_width(width: float) -> None:
    """Two slabs that lie together, or a slab and a small set, as thin as rounding: neither is missed, nor made flat.

    To 2e-9 of the own width of a set along each row, about what merging of vertices may cost; and the hull is at
    most some units of the last place too wide.
    """
    for trial in range(15):
        rng = np.random.default_rng([10, trial])
        n = int(rng.integers(2, 5))
        A, b, scales = uneven_set(rng, n, 4.0 * (trial % 2), width)
        rows, rhs, _ = uneven_set(rng, n, 0.0)
        P, small = HPolytope(A, b), HPolytope(rows / scales, rhs * 2.0 ** np.round(np.log2(width)))
        moved = HPolytope(A, b + A @ (rng.integers(-3, 4, n) * scales * width))
        for Q in (small, moved):
            H, exact = convex_hull([P, Q]), polyhedron(P)
            assert H.d.size == 0, trial
            exact.poly_hull_assign(polyhedron(Q))
            for R in (polyhedron(P), polyhedron(Q)):
                for row, value in zip(H.A, H.b, strict=True):
                    upper, lower = exact_support(R, row), -exact_support(R, -row)
                    assert upper - Fraction(float(value)) <= 2e-9 * (upper - lower), trial
            for row, value in zip(H.A, H.b, strict=True):
                assert Fraction(float(value)) - exact_support(exact, row) <= 1e-14 * float(np.abs(row) @ scales), trial


def test_a_hull_is_flat_only_if_the_union_is() -> None:
    """Equalities come from the exact dimension of the union, not from how near its points are to a plane."""
    plane, line = [[1.0, 2.0, 3.0]], [[1.0, 2.0, 3.0], [1.0, -1.0, 0.0]]
    box = HPolytope.box([-1.0] * 3, [1.0] * 3)
    flat = HPolytope(box.A, box.b, plane, [0.5])
    for C, d, dimension in ((plane, [0.5], 2), (plane, [0.5 + 1e-13], 3), (line, [0.5, 0.0], 2)):
        H = convex_hull([flat, HPolytope(box.A, box.b, C, d)])
        assert H.affine_dim() == dimension
        assert H.d.size == 3 - dimension
        assert H.contains(flat, tol=1e-15 * (3 - dimension))


@pytest.mark.parametrize("width", [0.0, 1e-13, 1.0])
def test_a_sum_by_vertices_is_flat_only_if_the_sum_is(monkeypatch: pytest.MonkeyPatch, width: float) -> None:
    """A part of a plane, and beside the plane a segment or a slab parallel to it."""
    monkeypatch.setattr("polytopes.minkowski_sum._CHEAP_ROWS", 1)
    box, normal = HPolytope.box([-1.0] * 3, [1.0] * 3), np.array([1.0, 2.0, 3.0])
    P = HPolytope(box.A, box.b, [normal], [0.5])
    if width == 0.0:
        Q = HPolytope(box.A, box.b, [normal, [0.0, 1.0, 1.0]], [1.5, 0.0])
    else:
        Q = HPolytope(np.vstack([box.A, normal, -normal]), np.append(box.b, [width + 1.5, -1.5]))
    S, exact = P.minkowski_sum(Q), exact_sum(P, Q)
    assert S.d.size == (width == 0.0)
    for row, value in zip(S.A, S.b, strict=True):
        assert exact_support(exact, row) <= Fraction(float(value)) + Fraction(1e-14) * (width != 1e-13)


def test_qhull_never_reaches_the_user_with_an_error_of_its_own() -> None:
    """Thin sets through their vertices: a hull that holds them all, or an error that says what is undecided."""
    for trial in range(60):
        rng = np.random.default_rng([8, trial])
        n = int(rng.integers(2, 5))
        A, b, scales = uneven_set(rng, n, 5.0, 10.0 ** rng.uniform(-14, -8))
        try:
            V = HPolytope(A, b).vertices()
            hull = HPolytope.from_vertices(V)
        except UndecidedError:
            continue
        beyond = (V @ hull.A.T - hull.b) / (np.abs(hull.A) @ scales)
        assert beyond.max() <= 1e-14
        assert np.abs((V @ hull.C.T - hull.d) / (np.abs(hull.C) @ scales + 1e-300)).max(initial=0.0) <= 1e-10


def test_a_set_far_from_the_origin() -> None:
    """Slacks of 1e-4 beside coordinates of 1e9: every row still is a facet."""
    sphere = np.random.default_rng(3).standard_normal((40, 3))
    sphere = np.round(sphere / np.linalg.norm(sphere, axis=1)[:, None] * 2.0**10) / 2.0**10
    centre = np.array([2.0**30, -(2.0**29), 2.0**28])
    near = HPolytope(sphere, np.full(40, 2.0**-13))
    far = HPolytope(sphere, 2.0**-13 + sphere @ centre)
    assert far.remove_redundancy().b.size == near.remove_redundancy().b.size == minimal_size(polyhedron(far))[0]
