"""The study of the scenarios: delays within the orders of the specification, reproducible, readable."""

import pickle
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from aircraft.missile.figures import write_figures
from aircraft.missile.scenario_study import (
    MEAN_SAMPLES,
    FlownCases,
    OrderRow,
    ResidualRow,
    ScenarioStudy,
    fixed_alarms,
    run_study,
    scenario_study,
)
from aircraft.missile.scenarios import Flights
from svo.studies.added import added_failures, publish_added, run_added
from svo.studies.engine import Place


@pytest.fixture(scope="module")
def study() -> ScenarioStudy:
    return run_study(2, 0, ("gaussian",))


# Scenario, residual, largest delay [s] with the fixed rule. The IMU's two samples and the first faulty one are in it.
DELAYS = [
    ("scenario 1", "r14", 0.04),
    ("scenario 1", "r12", 0.04),
    ("scenario 2", "r32", 0.4),
    ("scenario 2", "r1_14", 0.04),
    ("scenario 3", "r5_14", 0.04),
    ("scenario 3", "r4_11", 0.04),
    ("scenario 3", "r23", 0.2),
    ("scenario 3", "r32", 0.8),
]


@pytest.mark.parametrize(("scenario", "residual", "largest"), DELAYS)
def test_delays_of_the_scenarios(study: ScenarioStudy, scenario: str, residual: str, largest: float) -> None:
    rows = [r for r in study.residuals if (r.scenario, r.residual, r.rule) == (scenario, residual, "fixed")]
    assert len(rows) == 2
    assert all(row.delay_s is not None and 0.03 <= row.delay_s <= largest for row in rows)


def test_adaptive_bounds_are_quiet_where_they_should_be(study: ScenarioStudy) -> None:
    """Also near the intercept, where the fixed thresholds are crossed without a fault."""
    adaptive = [row for row in study.residuals if row.rule == "adaptive"]
    assert sum(row.false_alarms + row.late_false_alarms for row in adaptive) == 0
    fixed = [row for row in study.residuals if row.rule == "fixed" and row.scenario == "healthy"]
    assert sum(row.late_false_alarms for row in fixed) > 0


def test_no_order_is_wrong_and_every_size_contains_the_truth(study: ScenarioStudy) -> None:
    assert not any(row.wrong for row in study.orders)
    assert all(row.sizes_contain_truth for row in study.orders)
    found = {row.scenario: row.found_order for row in study.orders}
    assert (found["scenario 1"], found["scenario 2"], found["scenario 3"]) == ("eta", "dm eta", "eta dn dm")


def test_the_study_is_reproducible_and_writes_its_tables(study: ScenarioStudy, tmp_path: Path) -> None:
    again = run_study(1, 0, ("gaussian",))
    assert again.residuals == tuple(row for row in study.residuals if row.seed == 0)
    again.write(tmp_path)
    text = (tmp_path / "scenarios.txt").read_text(encoding="utf-8")
    assert "10 patterns for 16 fault sets" in text
    assert (tmp_path / "scenario_residuals.csv").read_text(encoding="utf-8").count("\n") == len(again.residuals) + 1
    with pytest.raises(ValueError, match="runs is 0"):
        run_study(0, 0, ("gaussian",))


def test_fixed_alarm_needs_a_whole_window_and_holds_off_without_data() -> None:
    time = np.arange(3000) * 0.01
    values = np.random.default_rng(0).standard_normal((3000, 1))
    values[2500:] += 20.0
    values[2700:2710] = np.nan
    alarms = fixed_alarms(time, values)[:, 0]
    assert not alarms[: MEAN_SAMPLES - 1].any()
    assert not alarms[:2500].any()
    assert alarms[2510:2700].all()
    assert not alarms[2700:2719].any()


def test_pictures_are_written(tmp_path: Path) -> None:
    written = write_figures(tmp_path, Flights(), 0)
    assert len(written) == 4
    assert all(path.stat().st_size > 10_000 for path in written.values())


def test_flights_that_are_kept_are_not_flown_again(study: ScenarioStudy, tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []

    def fly(seed: int) -> None:
        added = scenario_study(2, seed, ("gaussian",))
        run_added(added, tmp_path, Place(), progress=lambda *done: calls.append(done))
        publish_added(added, tmp_path)
        assert added_failures(added, tmp_path) == []

    fly(0)
    assert calls == [(0, 2), (1, 2), (2, 2)]
    text = (tmp_path / "scenarios.txt").read_text(encoding="utf-8")
    assert text == study.to_text() + "\n"
    part = tmp_path / "scenarios" / "rows" / "run-000001.jsonl"
    part.write_bytes(part.read_bytes()[:-1])
    fly(0)
    assert calls[3:] == [(1, 2), (2, 2)]
    assert (tmp_path / "scenarios.txt").read_text(encoding="utf-8") == text


def test_a_flight_that_fails_is_a_row_and_named(tmp_path: Path) -> None:
    added = replace(scenario_study(2, 0, ("gaussian",)), work=fail_in_the_second)
    run_added(added, tmp_path, Place())
    assert added_failures(added, tmp_path) == ["run 1 of scenarios failed: ArithmeticError: a wing came off"]
    publish_added(added, tmp_path)
    assert (tmp_path / "scenario_orders.csv").read_text(encoding="utf-8").count("\n") == 2


def fail_in_the_second(job: FlownCases) -> FlownCases:
    if job.seed == 1:
        raise ArithmeticError("a wing came off")
    order = OrderRow("healthy", job.noise, job.seed, "", "", False, "", True)
    residual = ResidualRow("healthy", job.noise, job.seed, "r14", "fixed", None, None, 0, 0)
    return replace(job, residuals=(asdict(residual),), orders=(asdict(order),))


def test_the_study_can_be_sent_to_a_worker() -> None:
    added = scenario_study(1, 0, ("bounded",))
    work, jobs = pickle.loads(pickle.dumps((added.work, added.jobs)))
    assert jobs == added.jobs
    assert callable(work)
