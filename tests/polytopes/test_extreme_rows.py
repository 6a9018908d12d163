"""Rows of extreme units, subnormal or doubled a thousand times: the answers of the same set by ordinary rows."""

import numpy as np
import pytest

from polytopes import HPolytope, UndecidedError

A = np.vstack([np.eye(2), -np.eye(2), [[1.0, 1.0]]])
B = np.array([1.0, 1.0, 1.0, 1.0, 1.5])
UNITS = [
    [2.0**500, 2.0**-500, 1e200, 1e-200, 1.0],
    [1e-200] * 5,
    [1e200] * 5,
    [2.0**-1074, 2.0**-1074, 1.0, 1.0, 2.0**-1060],
    [2.0**-1050, 2.0**900, 1.0, 1e-300, 2.0**-1000],
]


@pytest.mark.parametrize("units", UNITS)
def test_units_of_rows_change_no_answer(units: list[float]) -> None:
    P, Q = HPolytope(A, B), HPolytope(A * np.array(units)[:, None], B * units)
    with np.errstate(all="raise", under="ignore"):
        for x in (
            [0.75, 0.75],
            [0.75, 0.75 + 2.0**-53],
            [1.0, 0.5],
            [-1.0, -1.0],
            [1.0 + 1e-8, 0.0],
            [1.0 + 1e-11, 0.0],
        ):
            assert Q.contains(x) == P.contains(x)
            assert (x in P) == (x in HPolytope(A[:4] * np.array(units)[:4, None], units[:4]) & HPolytope(A, B))
        ball = Q.chebyshev()
        assert ball.radius == pytest.approx(P.chebyshev().radius, rel=1e-12)
        assert P.contains(ball.centre + ball.radius * np.eye(2), tol=1e-12).all()
        for norm in (1, 2, np.inf):
            assert Q.distance([7.0, 7.0], norm=norm) == pytest.approx(P.distance([7.0, 7.0], norm=norm), rel=1e-12)
        np.testing.assert_allclose(Q.closest_point([7.0, 0.0]), [1.0, 0.0], atol=1e-12)
        np.testing.assert_allclose(Q.vertices(), P.vertices(), atol=1e-12)
        np.testing.assert_allclose(Q.bounding_box(), P.bounding_box(), rtol=1e-12)
        np.testing.assert_allclose(Q.normalise().b, P.normalise().b, rtol=1e-12)
        assert Q.volume() == pytest.approx(P.volume(), rel=1e-12)
        answer, given = Q.contains(2 * P), P.contains(2 * P)
        assert (answer.row, answer.excess) == (given.row, pytest.approx(given.excess, rel=1e-12))
        assert Q.outer_reduce(4).is_bounded()
        np.testing.assert_allclose(Q.inner_box(), P.inner_box(), atol=1e-9)
        assert Q.inscribed_ellipsoid().volume == pytest.approx(P.inscribed_ellipsoid().volume, rel=1e-5)


def test_rows_given_a_thousand_times_are_asked_once() -> None:
    P = HPolytope(np.vstack([A] * 400), np.concatenate([B + 1e-3 * k for k in range(400)]))
    assert P.difference(P).is_empty()
    assert (P | P).is_convex()
    Q = P.translate([0.5, 0.5])
    assert P.difference(Q).volume() == pytest.approx(P.volume() - (P & Q).volume(), rel=1e-12)
    assert P.difference(HPolytope(A, B)).is_empty()
    assert len(P.difference(Q).pieces) == 2


def test_what_lies_beyond_all_floats_is_said_once() -> None:
    thin = HPolytope.box([0.0, 0.0], [2.0**-1074, 1.0])
    with pytest.raises(UndecidedError, match="beyond all floats"):
        thin.polar()
    assert thin.gauge([1.0, 1.0]) == np.inf
    large = HPolytope.box([-(2.0**400)] * 2, [2.0**400] * 2)
    assert large.volume(relative=True) == large.volume() == 2.0**802
    assert HPolytope.box([0.0] * 2, [2.0**-400] * 2).volume(relative=True) == 2.0**-800
