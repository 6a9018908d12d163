"""Indices of a Boolean decision, by hand and against a sample-by-sample oracle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from svo.indices import FirstAlarm, detection_indices, first_true, isolation_indices, judge_alarm

TIME = np.arange(10) * 0.1


def decide(*true: int) -> np.ndarray:
    decision = np.zeros(10, dtype=bool)
    decision[list(true)] = True
    return decision


def test_an_alarm_at_the_first_faulty_sample_has_delay_Ts() -> None:
    indices = detection_indices(TIME, decide(4, 5, 6, 7, 8, 9), t_from=0.4)
    assert indices.delay == pytest.approx(0.1)
    assert indices.first_alarm == pytest.approx(0.1)
    assert not indices.false_alarm
    assert indices.false_detection_rate == 0
    assert indices.non_detection_rate == 0


def test_the_last_switch_counts() -> None:
    indices = detection_indices(TIME, decide(5, 7, 8, 9), t_from=0.4)
    assert indices.delay == pytest.approx(0.4)
    assert indices.first_alarm == pytest.approx(0.2)
    assert indices.non_detection_rate == pytest.approx(2 / 6)


def test_an_alarm_that_is_gone_at_the_horizon_is_no_detection() -> None:
    indices = detection_indices(TIME, decide(5, 6, 7, 8), t_from=0.4)
    assert math.isinf(indices.delay)
    assert indices.first_alarm == pytest.approx(0.2)
    assert detection_indices(TIME, decide(5, 6, 7, 8), t_from=0.4, t_hor=0.9).delay == pytest.approx(0.2)


def test_silence_is_infinite() -> None:
    indices = detection_indices(TIME, decide(), t_from=0.4)
    assert indices.delay == indices.first_alarm == math.inf
    assert indices.non_detection_rate == 1


@pytest.mark.parametrize(("since", "delay"), [(3, 0.0), (1, -0.2), (0, -0.3)])
def test_an_alarm_from_before_the_fault_is_flagged(since: int, delay: float) -> None:
    indices = detection_indices(TIME, decide(*range(since, 10)), t_from=0.4)
    assert indices.delay == pytest.approx(delay)
    assert indices.false_alarm
    assert indices.false_detection_rate == pytest.approx((4 - since) / 4)
    assert indices.non_detection_rate == 0


def test_a_false_alarm_that_ends_leaves_the_detection() -> None:
    indices = detection_indices(TIME, decide(1, 2, 6, 7, 8, 9), t_from=0.4)
    assert indices.false_alarm
    assert indices.delay == pytest.approx(0.3)
    assert indices.false_detection_rate == pytest.approx(0.5)


def test_what_is_before_the_window_is_not_looked_at() -> None:
    indices = detection_indices(TIME, decide(0, 1, 6, 7, 8, 9), t_from=0.4, t_on=0.2)
    assert not indices.false_alarm
    assert indices.false_detection_rate == 0


def test_without_time_before_the_fault_its_rate_is_unknown() -> None:
    indices = detection_indices(TIME, decide(*range(10)), t_from=0.0)
    assert math.isnan(indices.false_detection_rate)
    assert not indices.false_alarm
    assert indices.delay == pytest.approx(0.1)


def test_rates_weigh_samples_by_their_duration() -> None:
    time = np.array([0.0, 1.0, 3.0, 4.0, 4.5])
    indices = detection_indices(time, np.array([False, True, False, True, True]), t_from=3.0)
    assert indices.false_detection_rate == pytest.approx(2 / 3)
    assert indices.non_detection_rate == pytest.approx(0.5)
    assert indices.delay == pytest.approx(1.5)


@given(
    decision=st.lists(st.booleans(), min_size=2, max_size=40),
    fault=st.integers(0, 39),
    Ts=st.sampled_from([0.01, 0.1, 1 / 3]),
)
def test_against_a_count_sample_by_sample(decision: list[bool], fault: int, Ts: float) -> None:
    K = len(decision)
    fault = min(fault, K - 1)
    indices = detection_indices(np.arange(K) * Ts, np.array(decision), t_from=float(f"{fault * Ts:.12g}"))
    switch, first = None, None
    for k, now in enumerate(decision):
        if now and (k == 0 or not decision[k - 1]):
            switch = k
        if now and k >= fault and first is None:
            first = k
    delay = math.inf if switch is None or not decision[-1] else (switch - fault + 1) * Ts
    assert indices.delay == pytest.approx(delay)
    assert indices.first_alarm == pytest.approx(math.inf if first is None else (first - fault + 1) * Ts)
    assert indices.false_alarm == any(decision[:fault])
    assert indices.non_detection_rate == pytest.approx(1 - sum(decision[fault:]) / (K - fault))
    if fault:
        assert indices.false_detection_rate == pytest.approx(sum(decision[:fault]) / fault)
    if indices.delay < 0.5 * Ts:
        assert indices.false_alarm


@pytest.mark.parametrize(
    ("time", "decision", "t_from", "message"),
    [
        ([0.0], [True], 0.0, "at least two samples"),
        ([0.0, 0.0], [True, True], 0.0, "not strictly increasing"),
        ([0.0, np.nan], [True, True], 0.0, "not strictly increasing"),
        ([0.0, 1.0], [True], 0.0, r"decision has shape \(1,\)"),
        ([0.0, 1.0], [1, 0], 0.0, "of bool"),
        ([0.0, 1.0], [True, False], 2.0, "t_from is 2.0"),
        ([0.0, 1.0], [True, False], -1.0, "t_from is -1.0"),
        ([0.0, 1.0], [True, False], 1.5, "no sample of the window"),
    ],
)
def test_bad_arguments_are_refused(time: list[float], decision: list[bool], t_from: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        detection_indices(time, decision, t_from)


def test_isolation_indices_are_those_of_each_decision():
    time = np.arange(10) * 0.1
    isolated = [None, None, "b", None, "a", None, "a", "a", "a", "a"]
    found = isolation_indices(time, isolated, ("a", "b", "c"), t_from=0.3)
    assert found["a"].first_alarm == pytest.approx(0.2)
    assert found["a"].delay == pytest.approx(0.4)
    assert found["a"].non_detection_rate == pytest.approx(2 / 7)
    assert found["b"].false_alarm
    assert found["b"].false_detection_rate == pytest.approx(1 / 3)
    assert found["b"].delay == np.inf
    assert found["c"].non_detection_rate == 1.0
    with pytest.raises(ValueError, match="isolated names b, z"):
        isolation_indices(time, [*isolated[:-1], "z"], ("a",), t_from=0.3)


@pytest.mark.parametrize(
    ("said", "delay", "false_alarm"),
    [
        (range(4, 10), 0.1, False),
        ([6], 0.3, False),
        ([3], None, True),
        (range(3, 10), None, True),
        ([1, 6, 7], None, True),  # what a run says after a false alarm is no detection
        ([], None, False),
    ],
)
def test_the_first_alarm_of_a_run_is_a_detection_or_a_false_alarm(
    said: Sequence[int], delay: float | None, false_alarm: bool
) -> None:
    assert judge_alarm(first_true(decide(*said)), 4, 0.1) == FirstAlarm(delay, false_alarm)


@given(decision=st.lists(st.booleans(), min_size=1, max_size=30), fault=st.integers(0, 30))
def test_delays_are_counted_in_whole_samples(decision: list[bool], fault: int) -> None:
    """Against a count by hand, and against the indices of the survey where these know the same."""
    found = judge_alarm(first_true(np.array(decision)), fault, 0.01)
    assert found.false_alarm == any(decision[:fault])
    after = [k for k in range(fault, len(decision)) if decision[k]]
    wanted = None if found.false_alarm or not after else len(decision[fault : after[0]]) + 1
    assert found.delay == (None if wanted is None else round(wanted * 0.01, 12))
    if wanted is not None and len(decision) > 1:
        survey = detection_indices(0.01 * np.arange(len(decision)), np.array(decision), fault * 0.01)
        assert survey.first_alarm == pytest.approx(found.delay)
