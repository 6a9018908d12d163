"""Round trips to the forms of other libraries."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import ConvexHull, HalfspaceIntersection
from sets import CATALOGUE

from polytopes import HPolytope, conversions

EVERY = pytest.mark.parametrize("name", CATALOGUE)


@EVERY
def test_halfspaces_describe_the_same_set(name: str) -> None:
    P = CATALOGUE[name]
    assert conversions.from_halfspaces(conversions.to_halfspaces(P)).equals(P)


def test_scipy_takes_our_rows_and_we_take_its_equations() -> None:
    P = HPolytope.cross_polytope(3)
    hull = HalfspaceIntersection(conversions.to_halfspaces(P), np.zeros(3))
    assert conversions.from_halfspaces(ConvexHull(hull.intersections).equations).equals(P)


@EVERY
def test_cdd_matrices_keep_equalities(name: str) -> None:
    pytest.importorskip("cdd")
    P = CATALOGUE[name]
    Q = conversions.from_cdd(conversions.to_cdd(P))
    assert Q.equals(P)
    np.testing.assert_array_equal(Q.C, P.C)


def test_generators_of_cdd_are_refused() -> None:
    cdd = pytest.importorskip("cdd")
    points = cdd.matrix_from_array([[1.0, 0.0]], rep_type=cdd.RepType.GENERATOR)
    with pytest.raises(ValueError, match="not an H-representation"):
        conversions.from_cdd(points)


def test_polytope_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    P = CATALOGUE["triangle"]
    other = SimpleNamespace(A=P.A, b=P.b[:, None])
    assert conversions.from_polytope(other).equals(P)
    made = SimpleNamespace(Polytope=lambda A, b, normalize: SimpleNamespace(A=A, b=b, normalize=normalize))
    monkeypatch.setitem(sys.modules, "polytope", made)
    assert conversions.from_polytope(conversions.to_polytope(P)).equals(P)
    monkeypatch.setitem(sys.modules, "polytope", None)
    with pytest.raises(ImportError, match="pip install polytope"):
        conversions.to_polytope(P)


def test_a_missing_cdd_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cdd", None)
    with pytest.raises(ImportError, match=r"svo-fdi\[cdd\]"):
        conversions.to_cdd(CATALOGUE["square"])
