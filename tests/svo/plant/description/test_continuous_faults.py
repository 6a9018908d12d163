"""Faults of a continuous model are stated in continuous time, in a TOML file and in Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from svo import UncertainModel, Uncertainty
from svo.detection.chains import verify_chains
from svo.detection.detect import detect
from svo.faults import ActuatorFault, FaultPair, PlantFault, SensorFault, Step
from svo.isolation.alarms import write_alarms
from svo.logs.log import Log
from svo.plant.description import read_description
from svo.plant.description.plant import DescribedPlant

TS = 0.1
PLANT = """
Ts = 0.1
[columns]
inputs = [{ name = "u", unit = "1" }]
outputs = [{ name = "y", unit = "1" }]
[model]
continuous = true
A = [[-1.0]]
B = [[1.0]]
C = [[1.0]]
n = [0.01]
remainder = { states = [3.0], inputs = [1.0] }
[initial]
lower = [1.9]
upper = [2.1]
"""
MODELS = """
[global]
lower = [-3.0]
upper = [3.0]
[faults.fast]
type = "model"
A = [[-3.0]]
[faults.slow]
type = "model"
A = [[-0.2]]
"""
DIRECTIONS = """
[faults.fast]
type = "plant"
A = [[-2.0]]
magnitude = 1.0
[faults.slow]
type = "plant"
A = [[0.8]]
magnitude = 1.0
"""


def described(folder: Path, text: str) -> DescribedPlant:
    path = folder / "decay.toml"
    path.write_text(text, encoding="utf-8")
    return read_description(path)


def decay(rate: float, begins: int = 20, count: int = 60) -> Log:
    """dx/dt = -x + u, from sample ``begins`` on -rate x + u, by its exact solution; x(0) = 2."""
    rng, x, y = np.random.default_rng(3), 2.0, []
    u = 0.5 * np.ones((count, 1))
    for k in range(count):
        y.append([x + rng.uniform(-0.01, 0.01)])
        a = rate if k >= begins else 1.0
        x = x * np.exp(-a * TS) + u[k, 0] / a * (1.0 - np.exp(-a * TS))
    return Log(time=TS * np.arange(count), u=u, y=np.array(y))


@pytest.mark.parametrize("faults", [MODELS, DIRECTIONS], ids=["model", "plant"])
@pytest.mark.parametrize(("rate", "name"), [(3.0, "fast"), (0.2, "slow")])
def test_the_fault_that_is_there_is_isolated_and_proven(tmp_path: Path, faults: str, rate: float, name: str) -> None:
    plant = described(tmp_path, PLANT + faults)
    log = decay(rate)
    found = detect(plant, log, noise="stated")
    assert found.detected_s is not None
    assert 2.0 < found.detected_s < 3.0
    assert found.alive == (name,)
    assert {alarm.observer for alarm in found.alarms} == {"nominal", "fast", "slow"} - {name}
    write_alarms(tmp_path / "alarms.jsonl", found.alarms)
    assert all(check.ok for check in verify_chains(tmp_path / "alarms.jsonl", log, plant))
    healthy = detect(plant, decay(1.0), noise="stated")
    assert healthy.detected_s is None


def test_a_fault_model_is_what_the_same_arrays_make_alone(tmp_path: Path) -> None:
    plant = described(tmp_path, PLANT + MODELS)
    expected = UncertainModel.from_continuous([[-3.0]], [[1.0]], [[1.0]], Ts=TS, n=[0.01], remainder=[0.0])
    assert np.array_equal(plant.faults["fast"].model.stack(), expected.stack())
    assert plant.faults["fast"].model.block("A")[0, 0] == pytest.approx(np.exp(-0.3), rel=1e-14)


def test_a_direction_in_python_is_discretised_with_its_model() -> None:
    model = UncertainModel.from_continuous(
        [[-1.0]], [[1.0]], [[1.0]], Ts=TS, n=[0.01], remainder={"states": [3.0], "inputs": [1.0]}
    )
    faulty = PlantFault(Uncertainty(A=[[-2.0]]), 1.0, Step()).model(model)
    expected = UncertainModel.from_continuous(
        [[-1.0]], [[1.0]], [[1.0]], Ts=TS, n=[0.01], remainder={"states": [3.0], "inputs": [1.0]},
        uncertainties=[Uncertainty(A=[[-2.0]], bounds=(0.0, 1.0))],
    )  # fmt: skip
    assert np.array_equal(faulty.stack(), expected.stack())
    assert [b.tolist() for b in faulty.bounds()] == [b.tolist() for b in expected.bounds()]
    x, u = np.array([2.0]), np.array([0.5])
    change, _ = PlantFault(Uncertainty(A=[[-2.0]]), 1.0, Step()).perturbation(model, 1.0, x, u, np.zeros(1))
    exact = 2.0 * np.exp(-0.3) + 0.5 / 3 * (1 - np.exp(-0.3)) - (2.0 * np.exp(-0.1) + 0.5 * (1 - np.exp(-0.1)))
    assert abs(change[0] - exact) <= expected.bounds()[1][0]


def test_sensor_and_actuator_faults_are_those_of_the_discrete_model() -> None:
    """Their arrays are linear in B and C, so continuous time changes nothing but where the remainder stands."""
    model = UncertainModel.from_continuous(
        [[-1.0, 0.3], [0.0, -2.0]], [[1.0], [0.5]], np.eye(2), Ts=TS, n=[0.01, 0.01], E=np.eye(2), w=[0.1, 0.1],
        uncertainties=[Uncertainty(B=[[0.1], [0.0]])],
    )  # fmt: skip
    discrete = model.replace(origin=None)
    faults: list[Any] = [
        SensorFault(0, "scaling", 0.3, Step()),
        SensorFault(1, "bias", 0.3, Step()),
        ActuatorFault(0, "loss", 0.5, Step()),
        ActuatorFault(0, "hard-over", 0.5, Step()),
        ActuatorFault(0, "locking", None, Step(), travel=(-1.0, 1.0)),
        ActuatorFault(0, "oscillatory-solid", 0.5, Step(), frequency_hz=1.0),
    ]
    for fault in [*faults, FaultPair(faults[0], faults[2])]:
        np.testing.assert_allclose(fault.model(model).stack(), fault.model(discrete).stack(), rtol=1e-12, atol=1e-16)


def test_another_remainder_is_asked_for_where_numbers_do_not_bound_it(tmp_path: Path) -> None:
    numbers = PLANT.replace("remainder = { states = [3.0], inputs = [1.0] }", "remainder = [1e-3]")
    with pytest.raises(ValueError, match=r"\[faults.fast\]: remainder is given in numbers.*not that of plant fault"):
        described(tmp_path, numbers + DIRECTIONS)
    own = DIRECTIONS.replace("magnitude = 1.0", "magnitude = 1.0\nremainder = { states = [3.0], inputs = [1.0] }")
    found = described(tmp_path, numbers + own).faults["fast"].model
    assert found.bounds()[1] == described(tmp_path, PLANT + DIRECTIONS).faults["fast"].model.bounds()[1]
    with pytest.raises(ValueError, match=r"\[faults.fast\], key 'remainder': has no meaning for a discrete model"):
        described(tmp_path, numbers.replace("continuous = true", "").replace("remainder = [1e-3]", "") + own)


def test_arrays_of_a_fault_have_no_columns_for_the_remainder(tmp_path: Path) -> None:
    text = PLANT.replace("n = [0.01]", "n = [0.01]\nE = [[1.0]]\nw = [0.1]")
    windy = '[faults.windy]\ntype = "model"\nE = [[2.0]]\nw = [0.3]\ncontains_nominal = true\n'
    model = described(tmp_path, text + windy).faults["windy"].model
    assert model.n_disturbances == 2
    assert model.bounds()[1][0] == 0.3


def test_arrays_of_discrete_time_leave_the_origin_behind() -> None:
    model = UncertainModel.from_continuous([[-1.0]], None, [[1.0]], Ts=TS)
    fault = PlantFault(Uncertainty(A=[[-0.2]]), 1.0, Step())
    with pytest.raises(ValueError, match=r"then got arrays of discrete time.*replace\(origin=None\)"):
        fault.model(model.replace(A=[[0.9]]))
    assert fault.model(model.replace(origin=None)).uncertainties[0].A == [[-0.2]]
    renamed = model.replace(names={"states": ["x"]}, n=[0.1])
    with pytest.raises(ValueError, match="remainder is missing"):
        fault.model(renamed)
    gained = PlantFault(Uncertainty(a=[1.0]), 1.0, Step()).model(renamed)
    assert gained.bounds()[2].tolist() == [0.1]
    assert gained.names == {"states": ["x"]}


def test_what_varies_is_a_key_of_the_file(tmp_path: Path) -> None:
    text = PLANT.replace("n = [0.01]", 'n = [0.01]\nE = [[1.0]]\nw = [0.1]\nvarying = ["w"]')
    held, varying = (described(tmp_path, t).model for t in (text.replace('varying = ["w"]', ""), text))
    assert held.bounds()[1][1] == 0.0
    assert 0 < varying.bounds()[1][1] < 1e-3
    with pytest.raises(ValueError, match=r"\[model\]: varying names 'wind'; expected any of all, w"):
        described(tmp_path, text.replace('["w"]', '"wind"'))
    with pytest.raises(ValueError, match=r"key 'varying': has no meaning for a discrete model"):
        described(tmp_path, text.replace("continuous = true", "").replace("remainder = {", "# {"))


@pytest.mark.parametrize(
    "more",
    [
        'kind = "loss"\nmagnitude = 0.5', 'kind = "floating"', 'kind = "hard-over"\nmagnitude = 1.0',
        'kind = "locking"\ntravel = [-1.0, 1.0]', 'kind = "runaway"\nmagnitude = 1.0\ntravel = [-1.0, 1.0]',
        'kind = "oscillatory-solid"\nmagnitude = 1.0\nfrequency_hz = 0.5',
        'kind = "oscillatory-liquid"\nmagnitude = 1.0\nfrequency_hz = 0.5',
    ],
)  # fmt: skip
def test_what_discretisation_leaves_out_is_named_by_its_state(tmp_path: Path, more: str) -> None:
    text = PLANT.replace("[model]", 'states = [{ name = "level", unit = "m" }]\n[model]').replace(
        "C = ", "E = [[1.0]]\nw = [0.1]\nC = "
    )
    wider = '\n[faults.other]\ntype = "model"\nE = [[1.0, 2.0]]\nw = [0.1, 0.2]\n'
    valve = f'[[model.uncertainties]]\nA = [[0.1]]\n[faults.valve]\ntype = "actuator"\ninput = "u"\n{more}\n'
    bounded = "[global]\nlower = [-9.0]\nupper = [9.0]"
    plant = described(tmp_path, text.replace("[initial]", f"{valve}[initial]") + bounded + wider)
    nominal = plant.model
    assert nominal.names is not None
    assert nominal.names["disturbances"] == ["w[0]", "remainder of level"]
    assert names_of(plant, "other") == ["w[0]", "w[1]", "remainder of level"]
    model, kind = plant.faults["valve"].model, more.split('"')[1]
    named = names_of(plant, "valve")
    assert set(named) - {f"{kind} of u"} == {"w[0]", "remainder of level"}
    assert len(named) == model.n_disturbances
    assert f"{kind} of u" in [*named, *(item.name for item in model.uncertainties)]


def names_of(plant: DescribedPlant, fault: str) -> list[str]:
    names = plant.faults[fault].model.names
    assert names is not None
    return list(names["disturbances"])
