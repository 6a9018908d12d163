"""The names that users type, as a contract: what is public today, its arguments, and what an import costs."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys

import numpy as np
import pytest

import svo
from polytopes import HPolytope
from svo import ArchitectureI, ArchitectureII, UncertainModel, WindowObserver
from svo.faults import SensorFault, Step

NAMES = {
    "polytopes": ["HPolytope"],
    "svo": [
        "ArchitectureI",
        "ArchitectureII",
        "ConstrainedZonotopeObserver",
        "NonlinearModel",
        "PolytopeObserver",
        "UncertainModel",
        "Uncertainty",
        "WindowObserver",
        "detect",
        "find_plant",
        "read_log",
        "verify",
    ],
    "svo.functions": [
        "abs",
        "atan2",
        "cos",
        "exp",
        "log",
        "max",
        "min",
        "piecewise",
        "sign",
        "sin",
        "sqrt",
        "sroot",
        "tanh",
    ],
    "svo.plant": ["Plant"],
    "svo.faults": ["ActuatorFault", "Exponential", "Intermittent", "PlantFault", "Ramp", "SensorFault", "Step"],
    "svo.indices": ["detection_indices"],
    "svo.interval": ["IntervalDetector", "IntervalPredictor", "NoiseCharacterization"],
}

ARGUMENTS = [
    (UncertainModel, ["A", "B", "C", "E", "w", "D", "F", "n", "a", "c", "Ts", "names", "uncertainties"]),
    (svo.Uncertainty, ["A", "B", "a", "E", "C", "D", "c", "F", "bounds"]),
    (UncertainModel.simulate, ["x0", "u", "rng"]),
    (
        svo.NonlinearModel,
        [
            "f",
            "h",
            "states",
            "inputs",
            "disturbances",
            "parameters",
            "Ts",
            "n",
            "w",
            "physical",
            "valid",
            "largest",
            "continuous",
        ],
    ),
    (WindowObserver, ["model", "initial", "horizon", "template"]),
    (WindowObserver.update, ["y0", "u", "schedule"]),
    (WindowObserver.step, ["u", "y", "u_next", "schedule"]),
    (WindowObserver.run, ["log"]),
    (svo.PolytopeObserver, ["model", "initial", "horizon", "max_facets", "as_published"]),
    (svo.PolytopeObserver.update, ["y0", "u", "schedule"]),
    (svo.PolytopeObserver.step, ["u", "y", "u_next", "schedule"]),
    (svo.PolytopeObserver.run, ["log"]),
    (svo.ConstrainedZonotopeObserver, ["model", "initial", "max_generators", "max_constraints"]),
    (svo.ConstrainedZonotopeObserver.step, ["u", "y", "u_next", "schedule"]),
    (ArchitectureI, ["nominal", "faults", "debounce", "recovery", "timeout"]),
    (ArchitectureII, ["nominal", "faults", "global_", "class_one", "debounce", "recovery", "timeout"]),
    (ArchitectureI.update, ["y0", "u", "schedule"]),
    (ArchitectureI.step, ["u", "y", "u_next", "schedule"]),
]

HPOLYTOPE = [
    "box", "from_vertices", "empty", "whole_space", "emptiness", "support", "support_points", "bounding_box",
    "chebyshev", "contains", "intersection", "product", "affine_map", "preimage",
]  # fmt: skip


@pytest.mark.parametrize(("module", "name"), [(m, n) for m, names in NAMES.items() for n in names])
def test_the_name_is_there_and_documented(module: str, name: str) -> None:
    thing = getattr(importlib.import_module(module), name)
    assert (inspect.getdoc(thing) or "").strip()


@pytest.mark.parametrize(("thing", "arguments"), ARGUMENTS, ids=lambda v: getattr(v, "__qualname__", ""))
def test_the_arguments_are_there(thing: object, arguments: list[str]) -> None:
    assert set(arguments) <= set(inspect.signature(thing).parameters)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", HPOLYTOPE)
def test_the_set_has_the_operation(name: str) -> None:
    assert callable(getattr(HPolytope, name))


def test_what_follows_C_is_given_by_name() -> None:
    with pytest.raises(TypeError, match="D="):
        UncertainModel([[1.0]], [[1.0]], [[1.0]], [[1.0]])  # type: ignore[misc]


def test_every_public_name_exists() -> None:
    for module in ("svo", "svo.faults", "svo.interval", "polytopes"):
        loaded = importlib.import_module(module)
        assert loaded.__all__ == sorted(loaded.__all__)
        assert all(hasattr(loaded, name) for name in loaded.__all__)


def test_the_example_of_the_contract_runs() -> None:
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], E=[[1.0]], w=([-0.1], [0.1]), n=[0.1], Ts=0.1)
    initial = HPolytope.box([-1.0], [1.0])
    fault = SensorFault(0, "bias", 2.0, Step(0.2))
    observers = [WindowObserver(m, initial=initial, horizon=10, template="box") for m in (model, fault.model(model))]
    bank = ArchitectureI(nominal=observers[0], faults={"sensor": observers[1]})
    log = model.simulate([0.0], np.zeros((4, 1)), np.random.default_rng(0))
    y = fault.corrupt(log.time, log.y)
    bank.update(y[0])
    for k in range(1, 4):
        v = bank.step(log.u[k - 1], y[k])
    assert (v.state, v.fault, v.alive, v.detected_at, v.isolated_at) == ("isolated", "sensor", ("sensor",), 2, 2)
    step = v.steps["sensor"]
    assert step.verdict == "consistent"
    assert step.set.contains(log.x[3], tol=1e-9)
    assert step.box[0] <= step.box[1]
    assert step.certificate is None
    assert step.seconds > 0


def test_importing_the_package_loads_nothing_heavy() -> None:
    heavy = ("cvxpy", "clarabel", "pandas", "pyarrow", "matplotlib", "scipy.optimize", "highspy", "typer", "rich")
    code = f"import sys, svo; print([m for m in {heavy!r} if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
