"""Flat, thin and unbounded sets of integers: every operation on every pair of kinds against an exact library.

The result, its floats taken as rationals, is the exact set: 0 wrong, 0 unbounded, 0 undecided.  `make test` runs 60
pairs an operation, ``-m slow`` 1000, in 1 to 5 dimensions, from the seeds 0, 1, 2, ...
"""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import pytest

ppl = pytest.importorskip("ppl", reason="needs pplpy: pip install pplpy")

from exact_sets import polyhedron  # noqa: E402
from kinds_of_sets import (  # noqa: E402
    KINDS,
    eroded,
    integer_set,
    mapped,
    maximum,
    preimage_of,
    rows_of,
    total_of,
)  # fmt: skip

from polytopes import EmptySetError, HPolytope, UnboundedError, convex_hull, union_bounds  # noqa: E402

AMOUNT = pytest.mark.parametrize("count", [60, pytest.param(1000, marks=pytest.mark.slow)])


def pairs(count: int) -> Iterator[tuple[str, np.random.Generator, ppl.C_Polyhedron, ppl.C_Polyhedron]]:
    """Pairs of sets; every pair of kinds comes by turns."""
    order = np.random.default_rng(13).permutation(len(KINDS) ** 2)
    for k in range(count):
        rng = np.random.default_rng([17, k])
        first, second = divmod(int(order[k % len(order)]), len(KINDS))
        n = int(rng.choice([1, 2, 2, 3, 3, 4, 5]))
        case = f"{k}: {KINDS[first]}, {KINDS[second]} in {n}"
        yield case, rng, integer_set(rng, KINDS[first], n), integer_set(rng, KINDS[second], n)


@AMOUNT
def test_convex_hull(count: int) -> None:
    for case, _, P, Q in pairs(count):
        exact = ppl.C_Polyhedron(P)
        exact.poly_hull_assign(Q)
        assert polyhedron(convex_hull([rows_of(P), rows_of(Q)])) == exact, case


@AMOUNT
def test_minkowski_sum(count: int) -> None:
    for case, _, P, Q in pairs(count):
        assert polyhedron(rows_of(P).minkowski_sum(rows_of(Q))) == total_of(P, Q), case


@AMOUNT
def test_pontryagin_difference(count: int) -> None:
    for case, _, P, Q in pairs(count):
        assert polyhedron(rows_of(P).pontryagin_difference(rows_of(Q))) == eroded(P, Q), case
        total = total_of(P, Q)
        assert polyhedron(rows_of(total).pontryagin_difference(rows_of(Q))) == eroded(total, Q), case


@AMOUNT
def test_product_intersection_containment_and_equality(count: int) -> None:
    for case, _, P, Q in pairs(count):
        both, common = ppl.C_Polyhedron(P), ppl.C_Polyhedron(P)
        both.concatenate_assign(Q)
        common.intersection_assign(Q)
        first, second = rows_of(P), rows_of(Q)
        assert polyhedron(first.product(second)) == both, case
        meeting = first.intersection(second)
        assert polyhedron(meeting) == common, case
        assert meeting.emptiness().status == ("empty" if common.is_empty() else "nonempty"), case
        assert meeting.affine_dim() == (-1 if common.is_empty() else common.affine_dimension()), case
        assert first.contains(second) == P.contains(Q), case
        assert first.equals(second) == (P == Q), case
        assert first.contains(meeting), case


@AMOUNT
def test_image_and_preimage(count: int) -> None:
    for case, rng, P, _ in pairs(count):
        n, p = P.space_dimension(), int(rng.integers(1, 5))
        M, t = rng.integers(-2, 3, (p, n)), rng.integers(-2, 3, p)
        if rng.random() < 0.3:
            M = np.outer(M[:, 0], M[0])  # singular
        image = rows_of(P).affine_map(M, t)
        assert polyhedron(image) == mapped(P, M, t), case
        assert polyhedron(image.preimage(M, t)) == preimage_of(mapped(P, M, t), M, t), case
        back, shift = rng.integers(-2, 3, (n, p)), rng.integers(-2, 3, n)
        assert polyhedron(rows_of(P).preimage(back, shift)) == preimage_of(P, back, shift), case
        for sign in (1, -1):
            eye = sign * np.eye(n, dtype=int)
            assert polyhedron(rows_of(P).affine_map(eye)) == mapped(P, eye, np.zeros(n, dtype=int)), case


@AMOUNT
def test_projection(count: int) -> None:
    for case, rng, P, _ in pairs(count):
        n = P.space_dimension()
        keep = rng.permutation(n)[: int(rng.integers(1, n + 1))].tolist()
        exact = mapped(P, np.eye(n, dtype=int)[keep], np.zeros(len(keep), dtype=int))
        assert polyhedron(rows_of(P).project(keep)) == exact, case


@AMOUNT
def test_templates_are_the_exact_supports_rounded_up(count: int) -> None:
    for case, rng, P, Q in pairs(count):
        if P.is_empty() or Q.is_empty():
            continue
        n = P.space_dimension()
        T = np.vstack([rng.integers(-3, 4, (4, n)), np.eye(n, dtype=int), -np.eye(n, dtype=int)])
        first, second = ([maximum(R, row) for row in T] for R in (P, Q))
        assert_rounded_up(rows_of(P).outer_template(T), T, first, case)
        larger = [None if u is None or v is None else max(u, v, key=lambda r: Fraction(*r))
                  for u, v in zip(first, second, strict=True)]  # fmt: skip
        assert_rounded_up(union_bounds([rows_of(P), rows_of(Q)], directions=T), T, larger, case)


def assert_rounded_up(result: HPolytope, T: np.ndarray, values: list[tuple[int, int] | None], case: str) -> None:
    kept = [k for k, value in enumerate(values) if value is not None]
    np.testing.assert_array_equal(result.A, T[kept], err_msg=case)
    for bound, k in zip(result.b.tolist(), kept, strict=True):
        exact = Fraction(*values[k])
        assert Fraction(bound) >= exact > Fraction(float(np.nextafter(bound, -np.inf))), case


@AMOUNT
def test_minimal_rows_generators_vertices_and_volume(count: int) -> None:
    for case, rng, exact, _ in pairs(count):
        n = exact.space_dimension()
        P = rows_of(exact)
        more = rng.integers(0, 2, (3, P.b.size))  # rows that follow from the others
        P = HPolytope(np.vstack([P.A, more @ P.A]), np.append(P.b, more @ P.b + rng.integers(0, 2, 3)), P.C, P.d)
        minimal = P.remove_redundancy()
        assert polyhedron(minimal) == exact, case
        if exact.is_empty():
            assert P.vertices().shape == (0, n)
            with pytest.raises(EmptySetError):
                P.generators()
            continue
        rows = exact.minimized_constraints()
        fixed = sum(1 for row in rows if row.is_equality())
        assert (minimal.b.size, minimal.d.size) == (len(rows) - fixed, fixed), case
        expected, G = exact.minimized_generators(), P.generators()
        counts = tuple(sum(1 for g in expected if kind(g)) for kind in (_is_point, _is_ray, _is_line))
        assert (len(G.vertices), len(G.rays), len(G.lines)) == counts, case
        again = polyhedron(HPolytope.from_vertices(G.vertices, np.vstack([G.rays, G.lines, -G.lines])))
        assert again.contains(exact) or not (G.vertices * 2**20 % 1.0 == 0.0).all(), case
        assert P.is_bounded() == exact.is_bounded(), case
        if exact.is_bounded():
            assert len(P.vertices()) == counts[0], case
        else:
            with pytest.raises(UnboundedError):
                P.vertices()
        if exact.affine_dimension() < n:
            assert P.volume() == 0.0, case
        else:
            assert P.volume() > 0.0, case


def _is_point(g: ppl.Generator) -> bool:
    return bool(g.is_point())


def _is_ray(g: ppl.Generator) -> bool:
    return bool(g.is_ray())


def _is_line(g: ppl.Generator) -> bool:
    return bool(g.is_line())
