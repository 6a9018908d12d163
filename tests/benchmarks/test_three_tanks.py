"""Three tanks of others: bounds from the healthy record, and what their faulty records show."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks._servo_records import VARIABLE, data_folder, halves, part
from benchmarks.three_tanks import BEGIN, Bounds, bank, learnt, records, without_flow
from svo import Log

FOLDER = data_folder()
needs_data = pytest.mark.skipif(FOLDER is None, reason=f"{VARIABLE} is not set: no recorded data")


@pytest.fixture(scope="module")
def logs() -> dict[str, Log]:
    assert FOLDER is not None
    return records(FOLDER)


@pytest.fixture(scope="module")
def bounds(logs: dict[str, Log]) -> Bounds:
    return learnt(halves(logs["normal"])[0])


@needs_data
def test_the_first_half_gives_the_bounds(bounds: Bounds) -> None:
    assert bounds == (0.7, 0.003, 0.99)


@needs_data
def test_the_difference_of_the_flows_isolates_the_first_fault_in_20_samples(
    logs: dict[str, Log], bounds: Bounds
) -> None:
    record = bank(bounds, with_flow=True).run(part(logs["fault01"], BEGIN - 5, BEGIN + 25))
    assert record.fault == "flow 1"
    assert record.detected_at == record.isolated_at
    assert record.isolated_at is not None
    assert 5 <= record.isolated_at <= 25


@needs_data
def test_a_level_sensor_that_drifts_is_detected_by_450(logs: dict[str, Log], bounds: Bounds) -> None:
    record = bank(bounds).run(part(without_flow(logs["fault04"]), 360, 455))
    assert record.detected_at is not None
    assert record.detected_at <= 450 - 360
    assert "sensor 1" in record.verdict.alive


@needs_data
def test_the_healthy_second_half_begins_with_all_models_alive(logs: dict[str, Log], bounds: Bounds) -> None:
    record = bank(bounds, with_flow=True).run(part(halves(logs["normal"])[1], 0, 30))
    assert record.alive.all()
    assert not record.undecided.any()


@pytest.mark.slow
@needs_data
def test_all_of_the_healthy_second_half_leaves_all_models_alive(logs: dict[str, Log], bounds: Bounds) -> None:
    """8004 samples."""
    record = bank(bounds).run(without_flow(halves(logs["normal"])[1]))
    assert record.alive.all()


@pytest.mark.slow
@needs_data
@pytest.mark.parametrize(
    ("name", "detected", "isolated"),
    [("fault01", 430, 950), ("fault04", 450, 650), ("fault07", 430, None), ("fault10", 850, None)],
)
def test_the_four_faults(logs: dict[str, Log], bounds: Bounds, name: str, detected: int, isolated: int | None) -> None:
    """2001 samples each, with the levels alone: not later than the method's prototype found them."""
    record = bank(bounds).run(without_flow(logs[name]))
    assert record.detected_at is not None
    assert BEGIN < record.detected_at <= detected
    if isolated is not None:
        assert record.isolated_at is not None
        assert record.isolated_at <= isolated
    truth = {"fault01": "flow 1", "fault04": "sensor 1", "fault07": "leak 1", "fault10": "pipe 1-3"}[name]
    assert truth in record.verdict.alive
    assert np.all(record.alive[:BEGIN])
