"""Faults of nonlinear plants: their models explain every run with them, of whatever size, and are wide enough only."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, UncertainModel, Uncertainty, WindowObserver
from svo.faults import (
    ActuatorFault,
    FaultPair,
    Intermittent,
    ParameterFault,
    PlantFault,
    Ramp,
    SensorFault,
    Step,
    simulate_fault,
)
from svo.functions import sin
from svo.logs.drive import drive
from svo.models.nonlinear import NonlinearModel
from tests.svo.models.nonlinear_plants import CASES, Case, crane, oscillator, pendulum

SEED = 20_261_201
START = 0.16  # s: sample 4 of the crane
SAMPLES = 13
STEP, RAMP, BLINK = Step(START), Ramp(START, 0.3), Intermittent(START, 0.16)


def brake(x: Any, u: Any, w: Any, p: Any) -> Any:
    """The crane with a brake, whose torque is a parameter after the plant's own."""
    f = crane().model.f(x, u, w, p)
    return [f[0], f[1] - p[2] * sin(2.0 * x[0]) * x[1]]


DIRECTION = Uncertainty(A=[[0.0, 0.0], [-1.0, -0.5]], B=[[0.0], [0.3]], a=[0.0, 0.2], C=[[0.1, 0.0], [0.0, 0.0]])
FAULTS: dict[str, Any] = {
    "bias": SensorFault(0, "bias", -0.3, STEP),
    "drift": SensorFault((0, 1), "drift", 0.4, RAMP),
    "scaling": SensorFault(0, "scaling", 0.5, RAMP),
    "scaling down": SensorFault((0, 1), "scaling", -0.6, BLINK),
    "frozen": SensorFault(1, "hard", 0.7, STEP),
    "dead": SensorFault((0, 1), "hard", 0.0, RAMP),
    "loss": ActuatorFault(0, "loss", 0.7, RAMP),
    "floating": ActuatorFault(0, "floating", None, BLINK),
    "hard-over": ActuatorFault(0, "hard-over", 4.0, STEP),
    "solid": ActuatorFault(0, "oscillatory-solid", 2.0, STEP, frequency_hz=2.1),
    "liquid": ActuatorFault(0, "oscillatory-liquid", 2.0, RAMP, frequency_hz=2.1),
    "noise": ActuatorFault(0, "noise", 2.0, STEP, seed=4),
    "locking": ActuatorFault(0, "locking", None, STEP, travel=(-4.0, 4.0)),
    "runaway": ActuatorFault(0, "runaway", 20.0, STEP, travel=(-4.0, 4.0)),
    "parameter": ParameterFault("drag", 2.0, RAMP),
    "parameter down": ParameterFault("gravity", -3.0, STEP),
    "function": ParameterFault("brake", 3.0, RAMP, f=brake),
    "plant": PlantFault(DIRECTION, -1.0, RAMP),
    "two sensors": FaultPair(SensorFault(0, "scaling", 0.5, STEP), SensorFault(0, "scaling", -0.4, RAMP)),
    "input and sensor": FaultPair(ActuatorFault(0, "loss", 0.7, STEP), SensorFault(0, "hard", 0.2, RAMP)),
    "two of one input": FaultPair(
        ActuatorFault(0, "loss", 0.7, STEP), ActuatorFault(0, "locking", None, RAMP, travel=(-3.0, 3.0))
    ),
    "plant and function": FaultPair(PlantFault(DIRECTION, 1.0, STEP), ParameterFault("brake", 2.0, RAMP, f=brake)),
    "one parameter twice": FaultPair(ParameterFault("drag", 1.0, RAMP), ParameterFault("drag", 1.0, STEP)),
}


def first(case: Case) -> HPolytope:
    return HPolytope.box(case.x0 - case.spread, case.x0 + case.spread)


def falsified_at(model: NonlinearModel, case: Case, log: Any) -> int | None:
    """The sample at which an observer is falsified; until then the truth is inside."""
    for k, step in enumerate(drive(WindowObserver(model, first(case), horizon=4), log)):
        if step.verdict == "falsified":
            return k
        assert step.verdict == "consistent", step.reason
        lower, upper = step.box
        assert (lower - 1e-9 <= log.x[k]).all(), k
        assert (log.x[k] <= upper + 1e-9).all(), k
    return None


@pytest.mark.parametrize("name", FAULTS)
def test_the_model_of_a_fault_explains_every_run_with_it(name: str) -> None:
    case, fault = crane(), FAULTS[name]
    model = fault.model(case.model)
    u = case.inputs(SAMPLES)
    for corners in (True, False):
        log = simulate_fault(case.model, fault, case.x0, u, np.random.default_rng(SEED), corners=corners, substeps=5)
        assert np.array_equal(log.u, u)
        assert falsified_at(model, case, log) is None
    healthy = case.model.simulate(case.x0, u, np.random.default_rng(SEED), corners=True, substeps=5)
    assert falsified_at(model, case, healthy) is None


@pytest.mark.parametrize("name", ["bias", "scaling", "frozen", "hard-over", "runaway", "parameter down", "function"])
def test_the_healthy_model_does_not_explain_a_large_fault(name: str) -> None:
    case, fault = crane(), FAULTS[name]
    log = simulate_fault(case.model, fault, case.x0, case.inputs(25), np.random.default_rng(SEED), substeps=5)
    for k, step in enumerate(drive(WindowObserver(case.model, first(case)), log)):
        if step.verdict == "falsified":
            assert k >= 4
            assert step.certificate.verify()
            return
    pytest.fail("it was not found")


@pytest.mark.parametrize("x0", [[1.0], [1.0, 1.2, 1.05]])
def test_a_constant_parameter_is_one_until_a_fault_moves_it(x0: list[float]) -> None:
    model = NonlinearModel(
        lambda x, u, p: [u[0] - p[0] * x[0] * p[1]], lambda x: [x[0]], states=["x"], inputs=["u"],
        parameters={"a": (0.5, 1.5), "b": (0.9, 1.1)}, constant=True, Ts=0.1, n=[0.01], largest=([0], [9]),
    )  # fmt: skip
    for fault in (ParameterFault("a", 0.5, Step(2.0)), ParameterFault("b", -0.4, Step(2.0))):
        log = simulate_fault(model, fault, x0, np.ones((40, 1)), np.random.default_rng(SEED))
        moved = 1 if fault.parameter == "a" else 2
        assert log.x[:, moved] == pytest.approx(log.x[0, moved] + fault.delta(log.time), rel=1e-15)
        assert len(x0) == 1 or log.x[0].tolist() == x0
        start = HPolytope.box([0.9], [1.1])
        assert 20 < (WindowObserver(model, start).run(log).falsified_at or 0) < 30
        assert WindowObserver(fault.model(model), start).run(log).falsified_at is None


def test_a_bank_isolates_one_of_three() -> None:
    case = crane()
    faults = {name: FAULTS[name] for name in ("frozen", "hard-over", "parameter")}
    start = lambda m: WindowObserver(m, first(case))  # noqa: E731
    bank = ArchitectureI(start(case.model), {name: start(fault.model(case.model)) for name, fault in faults.items()})
    log = simulate_fault(case.model, faults["frozen"], case.x0, case.inputs(30), np.random.default_rng(2), substeps=5)
    record = bank.run(log)
    assert record.fault == "frozen"
    assert record.isolated_at >= 4


def test_a_fault_of_a_linear_plant_is_that_of_its_linear_model() -> None:
    """Width of the boxes under the fault's model, of equations and of matrices."""
    linear, nonlinear = oscillator()
    u = np.ones((20, 1))
    start = HPolytope.box([0.5, -1.0], [1.5, 1.0])
    for fault in (
        ActuatorFault(0, "loss", 0.4, Step(0.8)),
        ActuatorFault(0, "oscillatory-liquid", 0.4, Step(0.8), frequency_hz=1.0),
        SensorFault(0, "bias", 0.1, Step(0.8)),
    ):
        log = simulate_fault(nonlinear, fault, [1.0, 0.0], u, np.random.default_rng(SEED))
        one, other = (WindowObserver(fault.model(m), start).run(log) for m in (linear, nonlinear))
        assert one.lower == pytest.approx(other.lower, abs=1e-6)
        assert one.upper == pytest.approx(other.upper, abs=1e-6)


def test_what_a_fault_adds_has_names_and_travels() -> None:
    model = FAULTS["two sensors"].model(crane().model)
    assert [*model.parameters] == ["gravity", "drag", "scaling of load", "scaling of load (2)"]
    model = FAULTS["two of one input"].model(crane().model)
    assert model.disturbances == ("wind", "locking of force")
    again = pickle.loads(pickle.dumps(model))
    one, other = (m.transition([0.1, -0.1], [0.3, 0.1], [1.0]) for m in (model, again))
    assert np.array_equal(one.R, other.R)


def test_rows_as_text_may_be_changed_one_by_one() -> None:
    common = {"states": ["h", "g"], "inputs": ["Q"], "n": 0.1, "largest": ([0, 0], [9, 9])}
    plant = NonlinearModel({"h": "Q - sqrt(h)", "g": "sqrt(h) - sqrt(g)"}, {"level": "g"}, **common)
    clog = ParameterFault("clog", 0.5, Step(1.0), f={"g": "(1 - clog) * sqrt(h) - sqrt(g)"})
    model = clog.model(plant)
    assert model.f["h"] == "Q - sqrt(h)"
    assert model.parameters == {"clog": (0.0, 0.5)}
    point = np.array([4.0, 1.0, 0.5, 2.0])
    assert model.flow.tape.values(point) == pytest.approx([0.0, 0.0])
    foam = ParameterFault("foam", 0.5, Step(1.0), h={"level": "g + foam * h"})
    both = FaultPair(clog, foam).model(plant)
    assert set(both.parameters) == {"clog", "foam"}
    with pytest.raises(ValueError, match="both faults have f of their own, of which one would be lost"):
        FaultPair(clog, ParameterFault("other", 1.0, Step(), f={"g": "sqrt(h) - other"}))


@pytest.mark.parametrize(
    ("make", "error", "why"),
    [
        (lambda: ParameterFault("dra", 1.0, STEP).model(crane().model), ValueError, "'dra'.*did you mean 'drag'"),
        (lambda: ParameterFault("k", 1.0, STEP).model(pendulum().model), ValueError, "expected one of none, or give f"),
        (lambda: ParameterFault("drag", 0.0, STEP), ValueError, "magnitude is 0.0; expected a finite number, not zero"),
        (lambda: ParameterFault("drag", 1.0, 3.0), TypeError, "profile"),
        (lambda: ParameterFault(3, 1.0, STEP), TypeError, "parameter is .*; expected the name of a parameter"),
        (
            lambda: ParameterFault("k", 1.0, STEP).model(UncertainModel([[1.0]], None, [[1.0]], Ts=1.0)),
            TypeError,
            "expected a NonlinearModel",
        ),
        (lambda: SensorFault(2, "bias", 1.0, STEP).model(crane().model), ValueError, "there are 2 outputs"),
        (lambda: ActuatorFault(1, "floating", None, STEP).model(crane().model), ValueError, "there are 1 inputs"),
        (
            lambda: PlantFault(Uncertainty(A=[[1.0]]), 1.0, STEP).model(crane().model),
            ValueError,
            r"A of the direction has shape \(1, 1\); expected \(2, 2\)",
        ),
        (
            lambda: PlantFault(Uncertainty(A=lambda s: np.eye(2)), 1.0, STEP).model(crane().model),
            ValueError,
            "A of the direction is a function of a schedule",
        ),
        (
            lambda: simulate_fault("crane", STEP, [0, 0], [[0.0]], np.random.default_rng(0)),
            TypeError,
            "model is a str; expected a NonlinearModel",
        ),
        (
            lambda: simulate_fault(crane().model, STEP, [0, 0], [[0.0]], np.random.default_rng(0)),
            TypeError,
            "acting is a Step",
        ),
        (
            lambda: crane().model.simulate([0, 0], [[0.0]], np.random.default_rng(0), parameters={"drag": [0.9]}),
            ValueError,
            r"parameters\['drag'\] is from 0.9 to 0.9; expected within \[0.1, 0.3\]",
        ),
        (
            lambda: crane().model.simulate([0, 0], [[0.0]], np.random.default_rng(0), parameters={"wind": [0.0]}),
            ValueError,
            "names of any of gravity, drag",
        ),
    ],
)
def test_a_fault_that_cannot_be_is_one_error(make, error, why) -> None:
    with pytest.raises(error, match=why):
        make()


def test_every_plant_takes_a_fault_of_each_kind() -> None:
    for name, make in CASES.items():
        model = make().model
        faults: list[Any] = [SensorFault(0, "scaling", 0.1, STEP), SensorFault(0, "hard", 1.0, STEP)]
        if model.n_inputs:
            liquid = ActuatorFault(0, "oscillatory-liquid", 0.1, STEP, frequency_hz=1.0)
            faults += [ActuatorFault(0, "loss", 0.5, STEP), liquid]
        for fault in faults:
            assert fault.model(model).n_states == model.n_states, name
