"""The observer of the page in the bank of the page's plant: detection, isolation, alarms stored and verified."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from docs.examples.heated_tank import HeatedTank, fault_object, tank
from docs.examples.interval_observer import IntervalCertificate, IntervalObserver
from polytopes import HPolytope
from svo import ArchitectureI
from svo.detection.detect import detect
from svo.isolation.alarms import KINDS, verify_alarms, write_alarms


class TankWithIntervals(HeatedTank):
    def bank(self, noise: str) -> ArchitectureI:
        start, nominal = HPolytope.box([0.0, 0.0], [40.0, 40.0]), tank(noise)
        models = {fault: fault_object(fault, "step").model(nominal) for fault in self.faults}
        return ArchitectureI(
            IntervalObserver(nominal, start), {fault: IntervalObserver(model, start) for fault, model in models.items()}
        )


def test_it_isolates_a_fault_and_its_alarms_are_proofs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(KINDS, IntervalCertificate.kind, IntervalCertificate)
    plant, file = TankWithIntervals(), tmp_path / "alarms.jsonl"
    log = plant.simulate("thermometer", "step", "laboratory", 1)
    found = detect(plant, log, noise="laboratory")
    assert found.record.fault == "thermometer"
    write_alarms(file, found.alarms)
    checks = verify_alarms(file, log)
    assert [check.ok for check in checks] == [True, True]


def test_a_certificate_that_holds_anything_else_proves_nothing() -> None:
    plant = TankWithIntervals()
    observer = plant.bank("laboratory").observers["nominal"]
    proof = observer.run(plant.simulate("thermometer", "step", "laboratory", 1)).certificate
    assert isinstance(proof, IntervalCertificate)
    assert proof.verify()
    for wrong in ({"lower": proof.upper + 1.0}, {"lower": proof.lower[:1]}, {"upper": proof.upper * np.nan}):
        assert not replace(proof, **wrong).verify()
