"""Programs of many variables: bounds that hold, near the maximum, and the bound of all points behind them."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import linprog

from polytopes import HPolytope
from polytopes.exact_sides import exact_form


def around_a_point(rng: np.random.Generator, n: int, m: int, even: bool) -> HPolytope:
    """Random rows around a point, in even units or not."""
    A = rng.standard_normal((m, n)) * (1.0 if even else 2.0 ** rng.integers(-20, 21, n))
    return HPolytope(A, rng.uniform(0.5, 1.5, m) + A @ (rng.uniform(-1.0, 1.0, n) / np.abs(A).max(axis=0)))


@pytest.mark.parametrize(("n", "m", "even"), [(32, 160, True), (45, 200, False), (60, 300, True), (100, 500, True)])
def test_supports_in_many_variables_are_upper_bounds_and_near(n: int, m: int, even: bool) -> None:
    rng = np.random.default_rng([n, m])
    P = around_a_point(rng, n, m, even)
    units = np.abs(P.A).max(axis=0)
    directions = rng.standard_normal((3, n)) * units
    found = P.support_points(directions)
    np.testing.assert_array_equal(P.support(directions), found.values)
    centre = P.chebyshev().centre
    for c, value, x in zip(directions, found.values, found.points, strict=True):
        inside = centre + (1.0 - 1e-9) * (x - centre)  # so far inside that every row holds exactly
        near = np.flatnonzero(P.A @ inside > P.b - 1e-6)
        assert all(exact_form(P.A[i], inside) <= Fraction(P.b[i]) for i in near)
        assert exact_form(c, inside) <= Fraction(value)
        assert value - c @ inside < 2e-9 * (np.abs(c) @ np.abs(x))
        assert value <= c @ x + 1e-11 * (np.abs(c) @ np.abs(x) + abs(value))
    best = linprog(-directions[0], A_ub=P.A, b_ub=P.b, bounds=(None, None))
    assert found.values[0] == pytest.approx(-best.fun, rel=1e-7)


def test_a_box_of_many_coordinates_that_is_cut_is_bounded_along_all_of_them() -> None:
    n = 40  # its largest ball rests on few rows, so that nothing follows from them
    A = np.vstack([np.eye(n), -np.eye(n), np.ones((1, n))])
    P = HPolytope(A, np.append(np.linspace(0.1, 1.0, 2 * n), 3.0))
    lower, upper = P.bounding_box()
    np.testing.assert_array_equal(lower, -P.b[n : 2 * n])
    assert (upper <= P.b[:n]).all()
    c = np.linspace(0.1, 0.9, n)
    best = linprog(-c, A_ub=A, b_ub=P.b, bounds=(None, None))
    assert P.support(c) == pytest.approx(-best.fun, rel=1e-9)
    assert P.support(c) >= -best.fun - 1e-12
