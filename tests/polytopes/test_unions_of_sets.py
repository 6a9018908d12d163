"""Unions: cover, difference and convexity against an exact library; volumes in closed form."""

import itertools

import matplotlib.pyplot as plt
import numpy as np
import ppl
import pytest
from exact_sets import polyhedron
from kinds_of_sets import KINDS, integer_set, rows_of
from sets import CATALOGUE, EMPTY

from polytopes import EmptySetError, HPolytope, Union

EVERY = pytest.mark.parametrize("name", CATALOGUE)
PLANAR = [name for name in CATALOGUE if CATALOGUE[name].dim == 2]


def exact(union: Union) -> list[ppl.C_Polyhedron]:
    return [polyhedron(P) for P in union.pieces]


def forms(P: ppl.C_Polyhedron) -> list:
    """Linear forms that are positive where a row is broken."""
    found = []
    for row in P.minimized_constraints():
        form = sum((int(c) * ppl.Variable(j) for j, c in enumerate(row.coefficients())), 0 * ppl.Variable(0))
        form = form + int(row.inhomogeneous_term())
        found += [-form, form] if row.is_equality() else [-form]
    return found


def covered(H: ppl.C_Polyhedron, P: ppl.C_Polyhedron, Q: ppl.C_Polyhedron) -> bool:
    """Whether H lies in the union: no point of it breaks a row of P and a row of Q."""
    for one, other in itertools.product(forms(P), forms(Q)):
        beyond = ppl.C_Polyhedron(H)
        beyond.add_constraint(one >= 0)
        beyond.add_constraint(other >= 0)
        if not beyond.is_empty() and all(positive(beyond.maximize(form)) for form in (one, other)):
            return False
    return True


def positive(answer: dict) -> bool:
    return not answer["bounded"] or int(answer["sup_n"]) > 0


def left_open(P: HPolytope, Q: HPolytope) -> bool:
    """Whether some point of P is not in Q."""
    return not polyhedron(Q).contains(polyhedron(P))


@pytest.mark.parametrize(
    ("p", "q"),
    [
        pytest.param(*pair, marks=[pytest.mark.slow] if k % 5 else [])
        for k, pair in enumerate(itertools.product(PLANAR, repeat=2))
    ],
)
def test_difference_of_pairs(p: str, q: str) -> None:
    P, Q = CATALOGUE[p], CATALOGUE[q]
    left = P.difference(Q)
    assert left.is_empty() == (not left_open(P, Q))
    for piece in exact(left):
        assert polyhedron(P).contains(piece)
        assert piece.is_empty() or not polyhedron(Q).contains(piece)
        inside = ppl.C_Polyhedron(piece)
        inside.intersection_assign(polyhedron(Q))
        assert inside.is_empty() or inside.affine_dimension() < 2  # Q is touched, not entered
    for one, other in itertools.combinations(exact(left), 2):
        both = ppl.C_Polyhedron(one)
        both.intersection_assign(other)
        assert both.affine_dimension() < 2 or both.is_empty()
    back = left | Q
    assert back.contains(P)
    assert back >= P
    assert (P | Q) >= P
    assert (left | Q) == (P | Q)
    assert Union([P, Q]).contains(P & Q)


@pytest.mark.parametrize("n", [3, pytest.param(6, marks=pytest.mark.slow)])
def test_the_volume_of_a_box_without_a_box_inside(n: int) -> None:
    outer, inner = HPolytope.box(np.zeros(n), np.full(n, 3.0)), HPolytope.box(np.ones(n), np.full(n, 2.0))
    assert sum(P.volume() for P in outer.difference(inner).pieces) == pytest.approx(3.0**n - 1.0, rel=1e-13)


@pytest.mark.parametrize("n", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_box_without_a_box_inside(n: int) -> None:
    one = np.ones(n)
    outer, inner = HPolytope.box(0 * one, 3 * one), HPolytope.box(one, 2 * one)
    ring = outer.difference(inner)
    assert ring.volume() == pytest.approx(3.0**n - 1.0, rel=1e-13)
    assert len(ring.pieces) == 2 * n
    assert not ring.is_convex()
    assert (ring | inner).is_convex()
    assert (ring | inner) == outer
    assert len((ring | inner).merge().pieces) == 1
    assert ring.complement(outer) == inner
    assert 1.5 * one not in ring
    assert one in ring
    assert ring.contains(np.array([0.5 * one, 1.5 * one])).tolist() == [True, False]
    np.testing.assert_array_equal(np.vstack(ring.bounding_box()), [0 * one, 3 * one])
    assert (ring & HPolytope.box(one, 3 * one)).volume() == pytest.approx(2.0**n - 1.0)
    assert (HPolytope.box(one, 3 * one) & ring) == (ring & HPolytope.box(one, 3 * one))


def test_volume_counts_overlaps_once() -> None:
    P, Q = HPolytope.box([0, 0], [2, 2]), HPolytope.box([1, 1], [3, 3])
    assert (P | Q | P).volume() == pytest.approx(7.0)
    assert (P | Q).disjoint().volume() == pytest.approx(7.0)
    assert (P | HPolytope.whole_space(2)).volume() == np.inf


@pytest.mark.parametrize("count", [16, pytest.param(600, marks=pytest.mark.slow)])
def test_convexity_and_cover_match_an_exact_library(count: int) -> None:
    for case in range(count):
        rng = np.random.default_rng([case, 44])
        n = 1 + case % 3
        P, Q = (integer_set(rng, KINDS[k], n) for k in rng.integers(0, len(KINDS), 2))
        if case % 2 and not P.is_empty():  # a set cut in two, or nearly so
            c = rng.integers(-2, 3, n).tolist()
            form = sum((v * ppl.Variable(j) for j, v in enumerate(c)), 0 * ppl.Variable(n - 1))
            Q = ppl.C_Polyhedron(P)
            P.add_constraint(form <= 0)
            Q.add_constraint(form >= int(rng.integers(0, 2)))
        union, hull = rows_of(P) | rows_of(Q), ppl.C_Polyhedron(P)
        hull.poly_hull_assign(Q)
        convex = covered(hull, P, Q)
        assert union.contains(rows_of(hull)) == union.is_convex() == convex, case
        assert len(union.merge().pieces) == (1 if convex else 2), case
        assert union.merge() == union, case


@EVERY
def test_unions_with_nothing_and_everything(name: str) -> None:
    P = CATALOGUE[name]
    nothing, everything = HPolytope.empty(P.dim), HPolytope.whole_space(P.dim)
    assert (P | nothing) == P == Union([P])
    assert (P | nothing).is_convex()
    assert (P | everything) == everything
    assert P.difference(everything).is_empty()
    assert P.difference(P).is_empty()
    assert P.difference(nothing) == P
    assert Union([P]).is_empty() == (name in EMPTY)
    outside = Union([P]).complement(everything)
    assert (outside | P) == everything
    assert outside.complement(everything) == P or P.affine_dim() < P.dim
    if name in EMPTY:
        with pytest.raises(EmptySetError):
            Union([P]).bounding_box()
    else:
        np.testing.assert_array_equal(Union([P]).bounding_box(), P.bounding_box())


def test_a_union_shows_itself() -> None:
    ring = HPolytope.box([0, 0], [3, 3]).difference(HPolytope.box([1, 1], [2, 2]))
    assert repr(ring) == "Union(dim=2, 4 pieces)"
    artists = ring.plot(label="ring")
    assert len(artists) == 4
    assert len(artists[0].axes.get_legend_handles_labels()[1]) == 1
    plt.close("all")
    assert "image/png" in ring._repr_html_()
    with pytest.raises(ValueError, match="dims is"):
        ring.plot(dims=(0,))


def test_wrong_unions_are_refused() -> None:
    P = HPolytope.box([0, 0], [1, 1])
    with pytest.raises(ValueError, match="pieces is empty"):
        Union([])
    with pytest.raises(ValueError, match="pieces have dimensions 2 and 1"):
        Union([P, HPolytope.empty(1)])
    with pytest.raises(TypeError, match="expected a sequence of"):
        Union([P, 3])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="Q has dimension 1"):
        P.difference(HPolytope.empty(1))
    with pytest.raises(TypeError, match="expected an HPolytope or a Union"):
        P.difference(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        P | 3
    with pytest.raises(TypeError, match="unhashable"):
        hash(P | P)
    assert (P | P) != 3
