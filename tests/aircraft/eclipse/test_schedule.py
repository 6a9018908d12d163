"""Scheduling on measured airspeed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from aircraft.eclipse.schedule import AirspeedFilter, ScheduledBlocks


def _y(V):
    return np.array([V, 0.1, 0.1, 0.0])


def test_filter_is_a_first_order_low_pass_of_half_a_second():
    V = np.random.default_rng(0).uniform(30, 50, 400)
    airspeed = AirspeedFilter(0.01, 37.0)
    seen = [airspeed(_y(v)) for v in V]
    pole = np.exp(-0.01 / 0.5)
    expected, _ = lfilter([1 - pole], [1, -pole], V, zi=[pole * V[0]])
    np.testing.assert_allclose(seen, expected, rtol=1e-12)
    assert seen[0] == V[0]


def test_missing_airspeed_holds_the_last_value():
    airspeed = AirspeedFilter(0.01, 37.0)
    assert airspeed(_y(np.nan)) == 37.0
    assert airspeed(_y(41.0)) == 41.0  # the first measured one, not a step of the filter
    held = airspeed(_y(40.0))
    assert airspeed(_y(np.nan)) == held
    assert 40.0 < airspeed(_y(40.0)) < held


RNG = np.random.default_rng(1)
TABLE = ScheduledBlocks(25.0, 0.5, {"A": RNG.normal(size=(61, 2, 2)), "a": RNG.normal(size=(61, 2))})


@settings(max_examples=50, deadline=None)
@given(airspeed=st.floats(25.0, 55.0))
def test_table_is_interpolated_linearly(airspeed):
    grid = 25.0 + 0.5 * np.arange(61)
    for name in ("A", "a"):
        flat = TABLE.tables[name].reshape(61, -1)
        expected = [np.interp(airspeed, grid, column) for column in flat.T]
        np.testing.assert_allclose(TABLE.block(name)(airspeed).ravel(), expected, atol=1e-12)
        np.testing.assert_array_equal(TABLE.over([airspeed, 30.0])[name][0], TABLE.block(name)(airspeed))


def test_outside_the_table_its_nearest_end_is_used():
    for outside, end in ((-3.0, 25.0), (24.9, 25.0), (55.1, 55.0), (400.0, 55.0)):
        np.testing.assert_array_equal(TABLE.block("A")(outside), TABLE.block("A")(end))


def test_blocks_of_a_sample_agree_with_all_of_them_at_once():
    for name in ("A", "a"):
        np.testing.assert_array_equal(TABLE.block(name)(31.4), TABLE.at(31.4)[name])


@pytest.mark.parametrize("schedule", [np.nan, np.inf])
def test_schedule_that_is_no_number_is_refused(schedule):
    with pytest.raises(ValueError, match="schedule"):
        TABLE.at(schedule)


def test_tables_of_different_lengths_and_unknown_blocks_are_refused():
    with pytest.raises(ValueError, match="tables"):
        ScheduledBlocks(25.0, 1.0, {"A": np.zeros((3, 1)), "B": np.zeros((4, 1))})
    with pytest.raises(ValueError, match="'Z'"):
        TABLE.block("Z")
