"""Ranges that are promised of the state: taken, refused, and bounded outward along directions."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from svo.models.model import UncertainModel
from svo.models.state_range import StateRange


def test_promised_ranges_of_the_state() -> None:
    model = UncertainModel([[0.9, 0], [0, 0.8]], None, [[1.0, 0.0]], physical=(0, [np.inf, 4.0]), largest=([-1, 1], 3))
    assert model.physical_range is not None
    assert model.start_range is not None
    assert model.physical_range.upper.tolist() == [np.inf, 4.0]
    assert not model.physical_range.is_bounded
    assert model.start_range.lower.tolist() == [0.0, 1.0]  # within physical
    assert model.replace(Ts=2.0).start_range is not None
    assert model.replace(largest=None).start_range is None  # physical is not bounded
    default = model.replace(largest=None, physical=(-1.0, 1.0)).start_range
    assert default is not None
    assert default.upper.tolist() == [1.0, 1.0]
    continuous = UncertainModel.from_continuous([[-1.0]], None, [[1.0]], Ts=0.1, physical=(-2.0, 2.0))
    assert continuous.start_range is not None


@pytest.mark.parametrize("name", ["physical", "largest"])
@pytest.mark.parametrize("value", [(1, 0), (np.nan, 1), 5, ([0, 0], [1, 1]), (0, "a"), (np.inf, np.inf), (0, 1, 2)])
def test_a_promised_range_that_is_none_is_refused(name: str, value: object) -> None:
    with pytest.raises((TypeError, ValueError), match=rf"^{name}(\[[01]\])? .*expected"):
        UncertainModel([[0.9]], None, [[1.0]], **{name: value})  # type: ignore[arg-type]


def test_the_largest_set_is_bounded_and_meets_the_physical_range() -> None:
    with pytest.raises(ValueError, match="all finite"):
        UncertainModel([[0.9]], None, [[1.0]], largest=(-np.inf, 1.0))
    with pytest.raises(ValueError, match="no common point"):
        UncertainModel([[0.9]], None, [[1.0]], physical=(0.0, 1.0), largest=(2.0, 3.0))


def test_directions_over_a_promised_range_are_bounded_outward() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        n = int(rng.integers(1, 5))
        lower = rng.normal(size=n)
        held = StateRange(lower, lower + rng.random(n))
        d = rng.normal(size=(1, n)) * (rng.random((1, n)) < 0.7)
        corner = np.where(d[0] > 0.0, held.upper, held.lower)
        exact = sum(
            (Fraction(a) * Fraction(b) for a, b in zip(d[0].tolist(), corner.tolist(), strict=True)), Fraction(0)
        )
        assert Fraction(float(held.support(d)[0])) >= exact
    assert StateRange(np.array([-np.inf, 0.0]), np.array([1.0, np.inf])).support(np.eye(2)).tolist() == [1.0, np.inf]


@pytest.mark.parametrize("name", ["physical", "largest"])
@pytest.mark.parametrize(
    "bound",
    [
        np.ma.array([1.0, -9999.0], mask=[False, True]),
        np.array([1.0 + 1.0j, 2.0]),
        np.array([1, 2], dtype="timedelta64[s]"),
        np.array([1, 2], dtype="datetime64[s]"),
        np.array(["1.0", "2.0"]),
        np.array([1.0, 2.0], dtype=object),
        [10**400, 1],
        [np.nan, 1.0],
        [1.0, 2.0, 3.0],
    ],
    ids=lambda bound: str(getattr(bound, "dtype", "list")),
)
def test_a_range_of_the_state_goes_through_the_door_for_numbers(name: str, bound: Any) -> None:
    """A masked end was read as data, and an imaginary part was dropped."""
    with pytest.raises((TypeError, ValueError), match=rf"^{name}\[1\]"):
        UncertainModel(np.eye(2), None, np.eye(2), **{name: ([-9e9, -9e9], bound)})


def test_a_zero_end_of_a_range_is_the_same_zero_however_it_is_reached() -> None:
    """Boxes of steps and of logs that the core follows are compared to the bit."""
    model = UncertainModel(0.9 * np.eye(2), None, [[1.0, 0.0]], physical=([0.0, -0.0], [-0.0, 3.0]))
    physical = model.physical_range
    assert physical is not None
    for of in (physical, physical.along(np.array([[1.0, 0.0], [0.0, 1.0]]))):
        for zero in (0.0, -0.0):
            lower, upper, meets = of.cut(np.array([-1.0, zero]), np.array([zero, 5.0]))
            assert meets
            assert not np.signbit([*lower, *upper]).any()
