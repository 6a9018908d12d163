"""Flat sets whose equalities are written in any size: their multipliers are found, so that the sets stay bounded."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from polytopes import HPolytope
from svo import PolytopeObserver, UncertainModel
from svo.observers.polytope.vertex_images import outer_support

pytest.importorskip("ppl", reason="needs pplpy: pip install pplpy")

from tests.polytopes.exact_sets import polyhedron
from tests.polytopes.kinds_of_sets import maximum


def segment(x: np.ndarray, along: np.ndarray, power: int) -> HPolytope:
    """The points of the plane within 1 of x along a line, its equality times a power of two."""
    across = np.array([-along[1], along[0]])
    axes = np.vstack([np.eye(2), -np.eye(2)])
    return HPolytope(axes, axes @ x + 1.0, np.ldexp(across, power)[None], np.ldexp([across @ x], power))


@pytest.mark.parametrize("power", [-60, -30, 0, 30, 60])
def test_supports_of_products_of_flat_sets(power: int) -> None:
    rng = np.random.default_rng(power + 100)
    for _ in range(10):
        x, along = rng.integers(-9, 10, (2, 2)).astype(float)
        along[0] += 20.0
        P = segment(x, along, power).product(segment(-x, along[::-1], 0))
        directions = rng.integers(-3, 4, (5, 4))
        bounds = outer_support(P, directions.astype(float))
        for direction, bound in zip(directions, bounds, strict=True):
            right = Fraction(*maximum(polyhedron(P), direction))
            assert 0 <= Fraction(float(bound)) - right <= Fraction(1, 10**9)


@pytest.mark.parametrize("power", [-60, 60])
def test_an_observer_starts_in_a_flat_set(power: int) -> None:
    """The box was "undecided: too thin"."""
    rng = np.random.default_rng(7)
    disturbances = HPolytope.box([-1.0, 0.5], [1.0, 0.5]).intersection(
        HPolytope(np.empty((0, 2)), [], [[0.0, 1.0]], [0.5])
    )
    model = UncertainModel(
        rng.normal(size=(2, 2)), None, [[1.0, 0.5]], E=rng.normal(size=(2, 2)), F=[[0.1, 0.2]], w=disturbances, n=[0.1]
    )
    x = np.array([3.0, -2.0])
    observer = PolytopeObserver(model, segment(x, np.array([20.0, 3.0]), power))
    for k in range(6):
        w = np.array([rng.uniform(-1.0, 1.0), 0.5])
        y = model.C @ x + model.F @ w
        step = observer.update(y) if k == 0 else observer.step([], y)
        lower, upper = step.box
        assert step.verdict == "consistent"
        assert (lower <= x).all()
        assert (x <= upper).all()
        assert (upper - lower < 10.0).all()
        x = model.A @ x + model.E @ w
