"""Answers with a reason: what they say is true, and what they show proves it."""

import itertools

import numpy as np
import ppl
import pytest
from exact_sets import polyhedron
from sets import CATALOGUE, EMPTY, FACETS

from polytopes import EmptySetError, HPolytope

EVERY = pytest.mark.parametrize("name", CATALOGUE)
SAME_SPACE = [(p, q) for p, q in itertools.product(CATALOGUE, repeat=2) if CATALOGUE[p].dim == CATALOGUE[q].dim]
PAIRS = [pytest.param(*pair, marks=[pytest.mark.slow] if k % 3 else []) for k, pair in enumerate(SAME_SPACE)]


def exact_form(normal: tuple, bound: object) -> ppl.Linear_Expression:
    common = int(np.lcm.reduce([v.denominator for v in (*normal, bound)], dtype=object))
    form = sum((int(v * common) * ppl.Variable(j) for j, v in enumerate(normal)), 0 * ppl.Variable(len(normal) - 1))
    return form - int(bound * common)


@pytest.mark.parametrize(("p", "q"), PAIRS)
def test_sets_meet_in_a_point_or_a_plane_is_between_them(p: str, q: str) -> None:
    P, Q = CATALOGUE[p], CATALOGUE[q]
    answer, common = P.intersects(Q), polyhedron(P)
    common.intersection_assign(polyhedron(Q))
    assert bool(answer) == (not common.is_empty())
    if answer:
        assert P.contains(answer.point)
        assert Q.contains(answer.point)
        return
    assert answer.verify(P, Q)
    assert not answer.verify(P, P) or p in EMPTY
    if answer.plane is None:
        assert p in EMPTY or q in EMPTY
        return
    plane = answer.plane
    assert plane.below < plane.above
    for exact, form in ((polyhedron(P), exact_form(plane.exact_normal, plane.below)),
                        (polyhedron(Q), -exact_form(plane.exact_normal, plane.above))):  # fmt: skip
        exact.add_constraint(form >= 0)  # what lies beyond the plane, or on it
        on = ppl.C_Polyhedron(exact)
        on.add_constraint(form == 0)
        assert exact == on
    if "decimal ray" in (p, q):  # its normal is no multiple of floats
        return
    assert P.support(plane.normal) <= plane.offset + 1e-12
    assert -Q.support(-plane.normal) >= plane.offset - 1e-12


@pytest.mark.parametrize(("p", "q"), PAIRS)
def test_a_set_that_is_not_inside_shows_a_point_beyond_a_row(p: str, q: str) -> None:
    P, Q = CATALOGUE[p], CATALOGUE[q]
    answer = P.contains(Q)
    assert bool(answer) == (answer == True) == (answer != False)  # noqa: E712
    if answer:
        assert answer.counterexample is None
        assert answer.row is None
        return
    assert Q.contains(answer.counterexample, tol=1e-9)
    assert not P.contains(answer.counterexample, tol=min(0.5 * answer.excess, 1e-3))
    normal, side = (np.vstack([P.A, P.C])[answer.row], np.append(P.b, P.d)[answer.row])
    missed = (normal @ answer.counterexample - side) / np.linalg.norm(normal) if normal.any() else np.inf
    assert (missed if answer.row < P.b.size else abs(missed)) > 0.0
    assert np.isinf(answer.excess) or abs(missed) == pytest.approx(answer.excess, rel=1e-9)


def test_the_worst_row_is_shown() -> None:
    P, Q = HPolytope.box([0.0, 0.0], [1.0, 1.0]), HPolytope.box([0.0, -3.0], [1.5, 1.0])
    answer = P.contains(Q)
    assert answer.excess == 3.0
    assert P.A[answer.row].tolist() == [0.0, -1.0]
    assert P.contains(Q, tol=3.0)


@EVERY
def test_the_numbers_of_the_rows_that_are_kept(name: str) -> None:
    P = CATALOGUE[name]
    if name in EMPTY:
        with pytest.raises(EmptySetError):
            P.minimal_rows()
        return
    kept, Q = P.minimal_rows(), P.remove_redundancy()
    np.testing.assert_array_equal(P.A[kept.inequalities], Q.A)
    np.testing.assert_array_equal(np.vstack([P.C[kept.equalities], P.A[kept.implicit]]), Q.C)
    np.testing.assert_array_equal(np.append(P.d[kept.equalities], P.b[kept.implicit]), Q.d)
    assert (kept.inequalities.size, kept.equalities.size + kept.implicit.size) == FACETS[name]
