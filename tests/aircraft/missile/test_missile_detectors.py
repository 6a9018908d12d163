"""The detectors of the comparison on the missile: all run, learn and find a large fault; redundancy names it."""

import numpy as np
import pytest

from aircraft.missile.detectors import Redundancy
from aircraft.missile.plant import missile
from svo.detectors.detector import Detector, Setting
from svo.studies.comparison.offer import ComparesDetectors

PLANT = missile()
LOGS = {
    fault: PLANT.simulate(fault, "none" if fault == "none" else "step", "bounded", 1)
    for fault in ("none", *PLANT.faults)
}
FAULT = round((PLANT.fault_time - LOGS["none"].time[0]) / PLANT.Ts)


def test_the_plant_offers_a_comparison() -> None:
    assert isinstance(PLANT, ComparesDetectors)
    detectors = PLANT.detectors("bounded")
    assert all(isinstance(d, Detector) for d in detectors)
    assert len({d.name for d in detectors}) == len(detectors)
    assert OWN in {d.name for d in detectors}


THRESHOLDS = [d.name for d in PLANT.detectors("bounded") if d.kind == "threshold"]
OWN = "control-induced redundancy"


@pytest.mark.parametrize("name", [n if n == OWN else pytest.param(n, marks=pytest.mark.slow) for n in THRESHOLDS])
def test_threshold_detectors_find_a_lost_quarter_of_the_propulsion(name: str) -> None:
    detector = next(d for d in PLANT.detectors("bounded") if d.name == name)
    parameters = {key: p.at(0.5) for key, p in detector.parameters.items()}
    healthy, faulty = detector.prepare(LOGS["none"]), detector.prepare(LOGS["propulsion"])
    learned = detector.learn(parameters, [healthy])
    level = detector.critical_level(Setting(0.0, parameters, learned), healthy, 0.0)
    assert np.isfinite(level)
    above = level * (1.0 + 1e-12)  # products over a log of another length round otherwise
    found = detector.run(Setting(above, parameters, learned), faulty)
    assert not found.alarm[:FAULT].any()
    assert found.alarm[FAULT:].any()


@pytest.mark.parametrize("fault", ["propulsion", "pitch_fin", "yaw_fin"])
def test_redundancy_names_the_actuator(fault: str) -> None:
    detector = Redundancy(PLANT.flights.airframe)
    parameters = {"samples": 10.0}
    prepared = [detector.prepare(LOGS[f]) for f in ("none", fault)]
    setting = Setting(6.0, parameters, detector.learn(parameters, prepared[:1]))
    found = detector.run(setting, prepared[1])
    named = found.isolated[FAULT:]
    right = named == detector.faults.index(fault)
    assert right.any()
    assert right.sum() > 0.5 * (named >= 0).sum()
