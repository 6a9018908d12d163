"""Logs: shapes, time, missing readings and the schedule."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from svo.logs.columns import is_sampled
from svo.logs.log import Log


def parts(**changes: Any) -> dict[str, Any]:
    return {"time": [0.0, 0.1, 0.2], "u": np.zeros((3, 0)), "y": np.ones((3, 2))} | changes


def test_a_log_holds_float_arrays_and_knows_its_length() -> None:
    log = Log(**parts(u=[[1], [2], [3]], x=np.zeros((3, 4)), y=[[1, np.nan]] * 3))
    assert len(log) == 3
    assert [getattr(log, name).dtype for name in ("time", "u", "y", "x")] == [np.dtype(float)] * 4
    assert np.isnan(log.y[:, 1]).all()
    assert log.schedule_at(0) is None


def test_a_schedule_is_a_number_or_an_array_a_sample() -> None:
    value = Log(**parts(schedule=[1, 2, 3])).schedule_at(1)
    assert value == 2.0
    assert isinstance(value, float)
    np.testing.assert_array_equal(Log(**parts(schedule=np.eye(3))).schedule_at(1), [0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time": [[0.0, 0.1, 0.2]]}, r"time has shape \(1, 3\); expected \(K,\)"),
        ({"time": [0.0, 0.1, 0.1]}, r"time\[2\] is 0.1; expected finite, strictly increasing"),
        ({"time": [0.0, np.nan, 0.2]}, r"time contains NaN at \[1\]"),
        ({"time": [0.0, 0.1, np.inf]}, r"time\[2\] is inf"),
        ({"time": [0.0, 0.1]}, r"u has shape \(3, 0\); expected \(2, channels\)"),
        ({"y": np.ones(3)}, r"y has shape \(3,\); expected \(3, channels\)"),
        ({"y": np.ones((2, 2))}, r"y has shape \(2, 2\); expected \(3, channels\)"),
        ({"x": np.ones((4, 2))}, r"x has shape \(4, 2\)"),
        ({"schedule": [1.0]}, r"schedule has shape \(1,\)"),
        ({"schedule": 1.0}, r"schedule has shape \(\)"),
    ],
)
def test_mistakes_are_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Log(**parts(**changes))


@pytest.mark.parametrize("Ts", [1e-4, 0.01, 0.3, 60.0])
def test_a_step_is_the_sampling_time_within_one_percent_and_no_more(Ts: float) -> None:
    for factor, taken in ((0.989, False), (0.991, True), (1.0, True), (1.009, True), (1.011, False), (2.0, False)):
        assert is_sampled(0.0, factor * Ts, Ts) is taken
        assert is_sampled(5 * Ts, (5 + factor) * Ts, Ts) is taken
