"""Rational data are exact from end to end: fractions as rows, points and vertices; points in any unit."""

from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
import scipy.sparse
from exact_sets import polyhedron
from sets import CATALOGUE, EMPTY, UNBOUNDED

from polytopes import HPolytope

F = Fraction
EVERY = pytest.mark.parametrize("name", CATALOGUE)


def test_rows_of_fractions_are_exact() -> None:
    A, b = [[F(1, 3), 1], [-1, 0], [0, F(-5, 7)]], [F(1, 7), 0, F(1, 9)]
    P = HPolytope(A, b)
    top = F(1, 7) + F(7, 45)
    assert P.vertices(exact=True) == sorted([(F(0), F(1, 7)), (F(0), F(-7, 45)), (3 * top, F(-7, 45))])
    assert P.volume(exact=True) == 3 * top * top / 2
    assert P.support([0.0, -1.0], exact=True) == F(7, 45)
    assert HPolytope(np.array(A, dtype=object), np.array(b, dtype=object)) == P
    line = HPolytope(np.empty((0, 2)), [], [[F(1, 3), F(1, 7)]], [F(1, 5)])
    assert (F(3, 5), F(0)) in line
    assert (F(3, 5) + F(1, 10**30), F(0)) not in line
    assert [F(1, 2), 0.25] in HPolytope.simplex(2)


@EVERY
def test_exact_vertices_make_the_set_again(name: str) -> None:
    P = CATALOGUE[name]
    if name in EMPTY | UNBOUNDED:
        return
    corners = P.vertices(exact=True)
    assert all(corner in P for corner in corners)
    again = HPolytope.from_vertices(corners)
    if name in ("slice", "scaled rows"):  # vertices of decimals are no short fractions
        assert polyhedron(again).contains(polyhedron(P))
        return
    assert again == P
    assert again.vertices(exact=True) == corners


def test_thirds_and_rays() -> None:
    wedge = HPolytope.from_vertices([[F(1, 3), F(1, 7)]], rays=[[F(1, 2), F(1, 3)], [0, 1]])
    assert wedge == HPolytope([[-1, 0], [2, -3]], [F(-1, 3), F(2, 3) - F(3, 7)])
    assert wedge.generators().vertices.tolist() == [[1 / 3, 1 / 7]]


@pytest.mark.parametrize("unit", [60, -60, 400, -400])
def test_hulls_of_short_points_are_exact_in_any_unit(unit: int) -> None:
    rng = np.random.default_rng(2)
    for n in (1, 2, 3):
        V = rng.integers(-9, 10, (n + 4, n)).astype(float)
        P, Q = HPolytope.from_vertices(V), HPolytope.from_vertices(np.ldexp(V, unit))
        assert polyhedron(Q) == polyhedron(P.scale(2.0**unit))
        assert Q.volume(exact=True) == P.volume(exact=True) * F(2) ** (n * unit)


def test_sets_move_by_fractions_exactly() -> None:
    third = F(1, 3)
    P, start = HPolytope.box([third, 0], [F(5, 7), 1]), HPolytope.box([0, 0], [F(8, 21), 1])
    assert P.vertices(exact=True) == [(third, 0), (third, 1), (F(5, 7), 0), (F(5, 7), 1)]
    assert P == start.translate([third, 0]) == start - [-third, 0]
    assert third * HPolytope.simplex(2) == HPolytope([[-1, 0], [0, -1], [3, 3]], [0, 0, 1])
    assert F(0) * P == HPolytope.box([0, 0], [0, 0])
    assert -third * P == P.scale(F(-1, 3)) == HPolytope.box([F(-5, 21), -third], [F(-1, 9), 0])
    assert HPolytope.simplex(2).slice({0: third}) == HPolytope.box([0], [F(2, 3)])
    assert HPolytope(np.empty((0, 2)), [], [[1, 1]], [1]).slice({0: third}) == HPolytope.box([F(2, 3)], [F(2, 3)])
    for wrong, words in (
        (lambda: P.translate([third]), r"t has shape \(1,\); expected \(2,\)"),
        (lambda: HPolytope.box([third], [1, 2]), r"upper has shape \(2,\); expected \(1,\)"),
        (lambda: HPolytope.box([third], [np.inf]), "upper holds inf"),
    ):
        with pytest.raises(ValueError, match=words):
            wrong()


def test_what_is_no_rational_is_said_once() -> None:
    third = F(1, 3)
    for wrong, words in (
        (lambda: HPolytope([[third, "a"]], [1]), r"A\[0\] holds a str"),
        (lambda: HPolytope([[third, np.inf]], [1]), r"A\[0\] holds inf"),
        (lambda: HPolytope([[third, 1], [1]], [1, 1]), "differ in length"),
        (lambda: HPolytope([[third, 1]], [1, 2]), r"b has shape \(2,\); expected \(1,\)"),
        (lambda: HPolytope([[third, F(1, 2**60 + 1)]], [1]), "row 0 of A is no multiple of floats"),
        (lambda: HPolytope.from_vertices([[third, 1], [1]]), "differ in length"),
        (lambda: HPolytope.from_vertices([[third, 1]], rays=[[1]]), "rays as long"),
        (lambda: [third] in HPolytope.simplex(2), r"expected \(2,\)"),
    ):
        with pytest.raises((TypeError, ValueError), match=words):
            wrong()


def test_operators_that_other_libraries_try_first() -> None:
    P = HPolytope.simplex(2)
    for M in (np.eye(2), scipy.sparse.csr_array(np.eye(2))):
        with pytest.raises(TypeError, match="M @ P is an image"):
            P @ M
        with pytest.raises(TypeError, match="unsupported operand"):
            M @ (P | P)
    assert pd.Series([1.0, 2.0]) + P == P.translate([1.0, 2.0])
    with pytest.raises(TypeError, match="expected a sequence of HPolytope"):
        P.difference(P).__class__(P)
    with pytest.raises(ValueError, match="expected at most 20"):
        HPolytope.cross_polytope(21)
