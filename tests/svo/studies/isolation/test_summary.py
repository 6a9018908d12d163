from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from svo.studies.isolation.run import RunRow
from svo.studies.isolation.summary import Delays, Share, summarise, to_json, write_summary

delays = st.lists(st.floats(0.01, 100.0), min_size=2, max_size=30)


def row(
    run: int = 0, fault: str = "leak", detected: float | None = 0.1, isolated: float | None = 0.2, **rest: object
) -> RunRow:
    given = {"false_alarm": False, "wrong_isolation": False, "alive_end": fault, "microseconds_per_step": 100.0}
    given |= {"microseconds_p99": 300.0, "undecided": 0} | rest
    profile = "none" if fault == "none" else "step"
    return RunRow(run, run, fault, profile, "calm", detected, detected, isolated, fault, **given)  # type: ignore[arg-type]


@given(delays)
def test_statistics_of_delays_that_were_all_reached(values: list[float]) -> None:
    found = Delays.of(values)
    assert found.mean == pytest.approx(np.mean(values))
    assert found.median == pytest.approx(np.median(values))
    assert (found.p05, found.p95) == pytest.approx(tuple(np.quantile(values, [0.05, 0.95])))
    assert found.reached.count == found.reached.of == len(values)
    if np.ptp(values) > 1e-6:
        expected = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
        assert found.mean_interval == pytest.approx((expected.low, expected.high))


@given(delays, st.integers(1, 30))
def test_delays_that_were_not_reached_count_as_infinite(values: list[float], never: int) -> None:
    found = Delays.of([*values, *[None] * never])
    assert found.reached.count == len(values)
    assert found.mean == pytest.approx(np.mean(values))
    ordered = np.sort([*values, *[np.inf] * never])
    for q, quantile in ((0.05, found.p05), (0.5, found.median), (0.95, found.p95)):
        expected = np.quantile(ordered, q, method="higher")
        assert (quantile is None) == (not np.isfinite(expected))
        assert quantile is None or quantile <= expected


def test_without_any_delay_nothing_is_made_up() -> None:
    found = Delays.of([None, None])
    assert (found.mean, found.mean_interval, found.median, found.p95) == (None, None, None, None)


@given(st.integers(1, 60), st.data())
def test_the_interval_of_a_share_has_the_tails_that_it_promises(of: int, data: st.DataObject) -> None:
    count = data.draw(st.integers(0, of))
    low, high = Share(count, of).interval
    assert low <= count / of <= high
    if count:
        assert stats.binom.sf(count - 1, of, low) == pytest.approx(0.025)
    if count < of:
        assert stats.binom.cdf(count, of, high) == pytest.approx(0.025)


def test_a_summary_counts_what_should_not_be_and_names_the_survivors() -> None:
    rows = [
        row(0, "none", None, None),
        row(1),
        row(2, isolated=None, alive_end="leak, gauge"),
        row(3, isolated=None, alive_end="leak, gauge"),
        row(4, detected=None, isolated=None, alive_end="nominal, leak, gauge", false_alarm=True, wrong_isolation=True),
    ]
    healthy, leak = summarise(rows)
    assert healthy.survivors == {}
    assert leak.runs == 4
    assert leak.survivors == {"leak, gauge": 2, "nominal, leak, gauge": 1}
    assert (leak.false_alarms.count, leak.wrong_isolations.count) == (1, 1)
    assert leak.isolate.reached.value == 0.25
    assert leak.microseconds_p99 == 300.0


def test_the_summary_file_has_one_row_a_condition(tmp_path: Path) -> None:
    summaries = summarise([row(0, "none", None, None), row(1), row(2, isolated=None, alive_end="leak, gauge")])
    write_summary(tmp_path / "summary.csv", summaries)
    with (tmp_path / "summary.csv").open() as file:
        healthy, leak = list(csv.DictReader(file))
    assert healthy["detect_mean_s"] == ""
    assert float(leak["detect_mean_s"]) == 0.1
    assert float(leak["not_isolated_share"]) == 0.5
    assert leak["survivors"] == "leak, gauge: 1"
    json.dumps(to_json(summaries), allow_nan=False)
