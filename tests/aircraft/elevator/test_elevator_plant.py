"""The elevator as a registered plant: Table 1, the promises of both detectors, and its schedule."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from aircraft.elevator.plant import POLES, TABLE_1, elevator
from svo import WindowObserver
from svo.detectors.detector import Detector, Setting
from svo.logs.drive import drive
from svo.plant import InputScheduler, Plant, TimesFaults, fault_start, load_plant, schedule_of
from svo.studies.comparison.offer import ComparesDetectors
from svo.studies.thresholds import LearnsDetectors

PLANT = elevator()
QUIET, CONSERVATIVE = "quiet", "conservative"


def test_it_is_registered_and_offers_what_studies_and_comparisons_ask_for() -> None:
    plant = load_plant("elevator")
    for protocol in (Plant, TimesFaults, LearnsDetectors, ComparesDetectors):
        assert isinstance(plant, protocol)
    assert isinstance(plant.scheduler(), InputScheduler)
    assert plant.faults["jam"] == ("moving", "steady")
    assert [fault_start(plant, *key) for key in TABLE_1] == [50.0, 14.5, 66.0]
    assert fault_start(plant, "none", "none") == plant.fault_time


@pytest.fixture(scope="module")
def delays() -> dict[tuple[str, str], np.ndarray]:
    """Median detection times of 20 runs for each scenario of Table 1 and each pole, one learning record each."""
    times: dict[tuple[str, str], list[list[float]]] = {key: [] for key in TABLE_1}
    for seed in range(20):
        noise = PLANT.characterise([PLANT.learning_log(CONSERVATIVE, 1_000 + seed)])
        for key, found in times.items():
            log = PLANT.simulate(*key, CONSERVATIVE, seed)
            start = fault_start(PLANT, *key)
            detectors = PLANT.interval_detectors(noise, float(log.u[0, 0])).values()
            alarms = [d.run(log).first_alarm_from(start) for d in detectors]
            found.append([np.inf if t is None else t for t in alarms])
    return {key: np.median(found, axis=0) for key, found in times.items()}


@pytest.mark.parametrize("scenario", [("runaway", "slow"), ("jam", "moving")])
def test_abrupt_faults_are_found_within_20_ms_of_the_paper(delays: dict, scenario: tuple[str, str]) -> None:
    assert delays[scenario] == pytest.approx(TABLE_1[scenario], abs=0.02 + 1e-9)


def test_the_slow_jam_is_found_soonest_with_the_pole_of_0_95(delays: dict) -> None:
    times = delays["jam", "steady"]
    assert POLES[int(np.argmin(times))] == 0.95
    assert (np.diff(times[:4]) < 0).all()
    assert times[4] > times[3]
    assert np.abs(times - TABLE_1["jam", "steady"]).max() < 0.6  # the noise of the paper is another


def test_the_prediction_keeps_the_true_position_without_a_fault() -> None:
    """All that the predictor does not know, the force, the noise in gamma and the sampling, is inside its bounds."""
    for log in (PLANT.simulate("none", "none", QUIET, 0), PLANT.learning_log(QUIET, 1)):
        p = PLANT.predictor(float(log.u[0, 0])).predict(log)
        assert log.x is not None
        excess = np.abs(log.x[:, 0] - p.center) - p.radius
        assert excess.max() < 1e-5


def test_the_scheduler_makes_the_schedule_of_the_log_sample_by_sample() -> None:
    log = PLANT.simulate("jam", "moving", QUIET, 3)
    scheduler = PLANT.scheduler()
    found = [schedule_of(scheduler, y, u) for y, u in zip(log.y[:2_000], log.u[:2_000], strict=True)]
    assert log.schedule is not None
    assert np.array_equal(found, log.schedule[:2_000])


def test_the_observer_of_the_same_plant_is_inside_the_prediction_and_keeps_the_position() -> None:
    log = PLANT.simulate("none", "none", QUIET, 0)
    p = PLANT.predictor(float(log.u[0, 0])).predict(log)
    nominal = PLANT.bank(QUIET).observers["nominal"]
    assert isinstance(nominal, WindowObserver)
    for k, step in enumerate(islice(drive(nominal, log), 1_600)):
        assert step.verdict == "consistent"
        if k > 100:  # the prediction starts from 2 mrad, the observer from the whole travel
            lower, upper = (float(b[0]) for b in step.box)
            assert p.lower[k] - 1e-6 <= lower
            assert upper <= p.upper[k] + 1e-6
            assert log.x is not None
            assert lower - 1e-5 <= log.x[k, 0] <= upper + 1e-5


def test_the_bank_never_rules_out_the_true_fault() -> None:
    log = PLANT.simulate("runaway", "slow", CONSERVATIVE, 1)
    bank = PLANT.bank(CONSERVATIVE)
    first = 4_990  # the observers may start at any sample
    bank.update(log.y[first], schedule=log.schedule_at(first))
    for k in range(first + 1, first + 700):  # beyond the arrival at the stop
        verdict = bank.step(log.u[k - 1], log.y[k], u_next=log.u[k], schedule=log.schedule_at(k))
    assert verdict.detected_at is not None
    assert 10 <= verdict.detected_at <= 17
    assert {"runaway", "jam"} <= set(verdict.alive)
    assert "nominal" not in verdict.alive


def test_runs_are_reproducible_and_noise_keeps_to_its_set() -> None:
    first, again, other = (PLANT.simulate("none", "none", QUIET, seed) for seed in (1, 1, 2))
    assert np.array_equal(first.y, again.y)
    assert not np.array_equal(first.y, other.y)
    assert first.x is not None
    assert np.abs(first.y - first.x).max() <= 4 * 8e-4 + 1e-12
    free = PLANT.with_noise("gaussian")
    assert free.gaussian
    assert not free.with_noise("bounded").gaussian


def test_the_compared_detectors_have_different_names_and_satisfy_the_protocol() -> None:
    detectors = PLANT.detectors(QUIET)
    assert len({d.name for d in detectors}) == len(detectors)
    assert all(isinstance(d, Detector) for d in detectors)


def test_the_interval_detector_of_a_comparison_has_an_alarm_just_below_its_critical_level() -> None:
    detector = PLANT.detectors(QUIET)[2]
    healthy = [detector.prepare(PLANT.simulate("none", "none", QUIET, seed)) for seed in range(3)]
    learned = detector.learn({}, healthy[:2])
    level = detector.critical_level(Setting(1.0, {}, learned), healthy[2], 0.0)
    assert not detector.run(Setting(level, {}, learned), healthy[2]).alarm.any()
    assert detector.run(Setting(0.999 * level, {}, learned), healthy[2]).alarm.any()
    assert all(detector.critical_level(Setting(1.0, {}, learned), h, 0.0) <= 1 for h in healthy[:2])


def test_errors_name_what_is_known() -> None:
    with pytest.raises(ValueError, match="expected one of runaway slow, jam moving"):
        PLANT.simulate("jam", "slow", QUIET, 0)
    with pytest.raises(ValueError, match="noise is 'loud'; expected one of conservative, quiet"):
        PLANT.bank("loud")
