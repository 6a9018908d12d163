from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from svo.logs.drive import drive
from svo.logs.log import Log
from svo.plant import Plant, load_plant
from svo.studies.configuration import Job
from svo.studies.isolation import exemplar as exemplar_module
from svo.studies.isolation.run import execute, judge

NAMES = ("nominal", "leak", "gauge")
SAMPLES = 40  # the fault begins at sample 10


class Record:
    """What a bank's record tells a study, from the samples at which observers fall."""

    def __init__(self, **died: int) -> None:
        self.names = NAMES
        self.died_at = {name: died.get(name) for name in NAMES}
        falls = np.array([died.get(name, SAMPLES) for name in NAMES])
        self.alive = np.arange(SAMPLES)[:, None] < falls
        self.seconds = np.where(self.alive, 1e-4, np.nan)
        self.undecided = np.zeros_like(self.alive)
        self.stopped = np.zeros(self.alive.shape, dtype=np.int64)
        self.certificates = dict.fromkeys(NAMES)
        self.detected_at = died.get("nominal")
        left = [i for i in range(1, 3) if falls[i] == SAMPLES]
        alone = self.detected_at is not None and len(left) == 1
        self.isolated_at = max(falls[falls < SAMPLES].tolist()) if alone else None
        self.fault = NAMES[left[0]] if alone else None


@pytest.fixture
def tank(registered_tank: str) -> Plant:
    return load_plant(registered_tank)


def row(tank: Plant, fault: str, **died: int) -> Any:
    log = Log(time=np.arange(SAMPLES) * 0.1, u=np.zeros((SAMPLES, 1)), y=np.zeros((SAMPLES, 2)))
    profile = "none" if fault == "none" else "step"
    return judge(tank, Job(3, fault, profile, "calm", 5, False), log, Record(**died))  # type: ignore[arg-type]


def test_an_alarm_at_the_first_faulty_sample_has_the_delay_of_one_sample(tank: Plant) -> None:
    found = row(tank, "leak", nominal=10, gauge=12)
    assert (found.first_alarm_s, found.detection_delay_s, found.isolation_delay_s) == (1.0, 0.1, 0.3)
    assert (found.isolated_as, found.alive_end) == ("leak", "leak")
    assert not found.false_alarm
    assert not found.wrong_isolation


def test_an_alarm_before_the_fault_is_false_and_no_detection(tank: Plant) -> None:
    found = row(tank, "leak", nominal=9, gauge=12)
    assert found.false_alarm
    assert found.first_alarm_s == pytest.approx(0.9)
    assert found.detection_delay_s is None
    assert not found.wrong_isolation


def test_any_alarm_without_a_fault_is_false(tank: Plant) -> None:
    assert row(tank, "none", nominal=39).false_alarm
    assert not row(tank, "none").false_alarm
    assert row(tank, "none", nominal=30, gauge=35).wrong_isolation


def test_it_is_wrong_to_falsify_the_true_fault_or_to_leave_another_alone(tank: Plant) -> None:
    alone = row(tank, "leak", nominal=10, leak=12)
    assert alone.wrong_isolation
    assert alone.isolated_as == "gauge"
    assert alone.isolation_delay_s is None
    assert row(tank, "leak", leak=20).wrong_isolation
    assert row(tank, "leak", nominal=10, leak=20, gauge=20).wrong_isolation


def test_what_is_not_reached_is_none_and_the_survivors_are_named(tank: Plant) -> None:
    found = row(tank, "leak", nominal=10)
    assert found.isolation_delay_s is None
    assert found.isolated_as is None
    assert found.alive_end == "leak, gauge"


def test_times_are_those_of_living_observers(tank: Plant) -> None:
    assert row(tank, "leak", nominal=10).microseconds_per_step == pytest.approx(100)


def test_a_real_run_is_isolated_with_proofs_and_its_exemplar_holds_the_truth(tank: Plant) -> None:
    outcome = execute(tank, Job(0, "gauge", "step", "calm", 1, exemplary=True))
    assert outcome.row.isolated_as == "gauge"
    assert outcome.row.detection_delay_s == 0.1
    assert {alarm.observer for alarm in outcome.alarms} == {"nominal", "leak"}
    assert all(alarm.certificate.verify() for alarm in outcome.alarms)
    assert outcome.alarms[0].source["seed"] == 1
    exemplar = outcome.exemplar
    assert exemplar is not None
    gauge = exemplar.names.index("gauge")
    assert exemplar.alive[:, gauge].all()
    assert (exemplar.lower[:, gauge] <= exemplar.x).all()
    assert (exemplar.x <= exemplar.upper[:, gauge]).all()
    for snapshot in exemplar.snapshots:
        assert all(polytope.contains(exemplar.x[snapshot.sample]) for polytope in snapshot.sets.values())
    assert [snapshot.sample for snapshot in exemplar.snapshots] == [9, 39]


def test_an_exemplar_has_every_box_and_only_the_outlines_that_it_keeps(
    tank: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    outlined: list[int] = []
    outline = exemplar_module.planar_outline
    monkeypatch.setattr(exemplar_module, "planar_outline", lambda step: outlined.append(step.sample) or outline(step))
    job = Job(0, "gauge", "step", "calm", 1, exemplary=True)
    exemplar = execute(tank, job).exemplar
    assert exemplar is not None
    log, bank = tank.simulate("gauge", "step", "calm", 1), tank.bank("calm")
    alive = bank.run(log).alive
    np.testing.assert_array_equal(exemplar.alive, alive)
    before = np.flatnonzero((alive[:-1] & ~alive[1:]).any(axis=1)).tolist()
    assert [snapshot.sample for snapshot in exemplar.snapshots] == [*before, len(log) - 1]
    assert len(outlined) == sum(len(snapshot.sets) for snapshot in exemplar.snapshots[:-1])  # the last has one model
    assert set(outlined) == set(before)
    for k, verdict in enumerate(drive(tank.bank("calm"), log)):
        for i, name in enumerate(exemplar.names):
            step, found = verdict.steps.get(name), (exemplar.lower[k, i], exemplar.upper[k, i])
            expected = step.box if step is not None and alive[k, i] else np.full((2, 1), np.nan)
            np.testing.assert_array_equal(found, expected)
