"""The interval detector: online and over logs alike, no alarm while its assumptions hold, alarms of their own kind."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from typing import get_args

import numpy as np
import pytest

from svo import Log
from svo.interval import (
    GainBounds,
    IntervalDetector,
    IntervalPredictor,
    NoiseCharacterization,
    ThresholdVerdict,
)
from svo.logs.drive import drive
from svo.observers.base import VerdictName

BOUNDS = GainBounds(0.8, 0.05)


def plant_log(samples: int, seed: int, jam_at: int | None = None) -> Log:
    """A plant inside BOUNDS with noisy measurements; from ``jam_at`` on it does not move."""
    rng = np.random.default_rng(seed)
    u, x = np.sin(0.05 * np.arange(samples)), np.zeros(samples)
    for k in range(samples - 1):
        g = rng.uniform(0.75, 0.85)
        x[k + 1] = x[k] if jam_at is not None and k + 1 >= jam_at else g * x[k] + (1 - g) * u[k]
    y = x + rng.normal(0, 0.05, samples)
    return Log(time=0.01 * np.arange(samples), u=u[:, None], y=y[:, None], x=x[:, None])


def detector(pole: float = 0.9, qbar: int = 50) -> IntervalDetector:
    predictor = IntervalPredictor(BOUNDS, (0.0, 0.01))
    records = [predictor.predict(plant_log(2_000, seed)).residual for seed in range(3)]
    return IntervalDetector(predictor, NoiseCharacterization.from_records(records, qbar), pole)


@pytest.mark.parametrize("pole", [0.0, 0.6, 0.95])
def test_samples_one_by_one_are_the_run_over_the_log(pole: float) -> None:
    log = plant_log(300, seed=9, jam_at=200)
    log.y[[0, 3, 4, 120, 299]] = np.nan
    online = detector(pole)
    record = online.run(log)
    steps = list(drive(online, log))
    assert [s.sample for s in steps] == list(range(300))
    assert tuple(s.verdict for s in steps) == record.verdicts
    assert np.array([s.interval for s in steps]) == pytest.approx(
        np.column_stack([record.prediction.center, record.prediction.radius]), abs=0
    )
    for name in ("residual", "filtered", "threshold"):
        found = np.array([getattr(s, name) for s in steps])
        assert found == pytest.approx(getattr(record, name), abs=1e-15, nan_ok=True)
    assert np.isnan(record.filtered[0])
    assert record.filtered[3] == record.filtered[4] == record.filtered[2]
    assert record.threshold[5] == record.threshold[2] or record.threshold[5] != record.threshold[4]


def test_a_missing_measurement_does_not_count_for_the_threshold() -> None:
    log = plant_log(60, seed=9)
    log.y[10:20] = np.nan
    one = detector()
    threshold = one.run(log).threshold
    assert threshold[9] == threshold[19]
    assert threshold[20] == one.noise.thresholds(one.pole)[10]


def test_no_alarm_while_the_residual_keeps_to_the_characterisation() -> None:
    one = detector()
    for seed in range(3):  # the records that were learnt from
        assert one.run(plant_log(2_000, seed)).first_alarm is None
    for seed in range(100, 140):
        record = one.run(plant_log(1_000, seed))
        assert record.first_alarm is None or not one.noise.check(record.residual).holds


def test_a_jam_is_found_soon_after_it_begins() -> None:
    record = detector().run(plant_log(1_000, seed=5, jam_at=600))
    alarm = record.first_alarm_from(6.0)
    assert alarm is not None
    assert 6.0 <= alarm < 6.5
    assert record.first_alarm == round(alarm / 0.01)
    assert record.first_alarm_from(9.999) is None


def test_an_alarm_is_of_another_kind_than_a_falsification() -> None:
    assert set(get_args(ThresholdVerdict)) & {"falsified"} == set()
    assert set(get_args(VerdictName)) & {"exceeded"} == set()
    online, log = detector(), plant_log(800, seed=5, jam_at=600)
    online.update(log.y[0])
    steps = list(islice(drive(online, log, start=1), 799))
    alarm = next(s for s in steps if s.exceeded)
    assert alarm.verdict == "exceeded"
    assert not hasattr(alarm, "certificate")
    assert alarm.box[0] < alarm.box[1]
    assert alarm.set.contains([alarm.interval.center])


def test_a_reset_starts_again_from_another_interval() -> None:
    online, log = detector(), plant_log(100, seed=2)
    first = list(islice(drive(online, log), 100))
    online.reset(0.0, 0.01)
    again = list(islice(drive(online, log), 100))
    assert [(s.sample, s.filtered, s.threshold) for s in first] == [(s.sample, s.filtered, s.threshold) for s in again]
    online.reset(0.5, 0.2)
    assert online.update(0.9).residual == pytest.approx(0.2)


def test_a_run_may_start_elsewhere() -> None:
    log = plant_log(100, seed=2)
    assert detector().run(log, initial=(0.25, 0.5)).prediction.lower[0] == -0.25


def test_a_step_before_the_first_measurement_predicts_only() -> None:
    online, log = detector(), plant_log(10, seed=2)
    step = online.step(log.u[0], log.y[1])
    assert step.sample == 1
    assert step.filtered == step.residual


@pytest.mark.parametrize(
    ("use", "match"),
    [
        (lambda d: (d.update(0.0), d.update(0.0)), "update was called after the first sample"),
        (lambda d: d.step(0.0, [1.0, 2.0]), r"y has shape \(2,\)"),
        (lambda d: d.step(0.0, np.inf), "y is inf"),
        (lambda d: d.step(np.nan, 0.0), "u is nan"),
        (lambda d: d.step([1.0, 2.0], 0.0), r"u has shape \(2,\)"),
        (lambda d: IntervalDetector(d, d.noise, 0.9), "predictor is a IntervalDetector"),
        (lambda d: IntervalDetector(d.predictor, d.noise.bounds, 0.9), "noise is a ndarray"),
        (lambda d: IntervalDetector(d.predictor, d.noise, 1.0), "pole is 1.0"),
    ],
)
def test_errors_name_what_is_wrong(use: Callable[[IntervalDetector], object], match: str) -> None:
    with pytest.raises((ValueError, TypeError), match=match):
        use(detector())


def test_a_refused_step_leaves_the_detector_as_it_was() -> None:
    online, log = detector(), plant_log(10, seed=2)
    online.update(log.y[0])
    with pytest.raises(ValueError, match="y is"):
        online.step(log.u[0], np.inf)
    assert online.step(log.u[0], log.y[1]).filtered == detector().run(log).filtered[1]
