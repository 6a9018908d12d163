"""What Architecture I asks of its fault models, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, ArchitectureII, UncertainModel, Uncertainty, WindowObserver
from svo.faults import ActuatorFault, PlantFault, SensorFault, Step
from svo.isolation.containment import excludes

CART = UncertainModel(
    [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]], E=[[0.0], [0.1]], w=[0.2], n=[0.05], Ts=0.1,
    uncertainties=[Uncertainty(B=[[0.0], [0.01]])],
)  # fmt: skip
START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def watched(model: UncertainModel) -> WindowObserver:
    return WindowObserver(model, START)


def loss(least: float, most: float) -> UncertainModel:
    """A motor that gives between 1 - most and 1 - least of its force."""
    lost = Uncertainty(B=[[0.0], [-0.1]], bounds=(least, most))
    return CART.replace(uncertainties=[*CART.uncertainties, lost])


def test_no_fault_is_called_global() -> None:
    for name in ("global", "nominal", " "):
        with pytest.raises(ValueError, match=f"faults has the name '{name}'; .* not 'nominal' or 'global'"):
            ArchitectureI(watched(CART), {name: watched(CART)})


NOT_CONTAINED = {
    "half of the force at most": loss(0.5, 1.0),
    "a little less force": CART.replace(B=[[0.0], [0.08]]),
    "another sign": CART.replace(B=[[0.0], [-0.1]]),
    "another gain of the sensor": CART.replace(C=[[1.3, 0.0]]),
    "another plant": CART.replace(A=[[1.0, 0.1], [0.0, 0.9]]),
    "feedthrough": CART.replace(D=[[0.01]]),
}
CONTAINED = {
    "up to all of the force": loss(0.0, 1.0),
    "a wider disturbance": CART.replace(w=[0.4]),
    "less force, made up for by a disturbance": CART.replace(B=[[0.0], [0.05]], w=[0.9]),
    "another plant by a schedule": CART.replace(A=lambda s: [[1.0, 0.1], [0.0, s]], schedule=0.9),
    "uncertain A": CART.replace(uncertainties=[*CART.uncertainties, Uncertainty(A=[[0.0, 0.0], [0.0, 0.1]])]),
    **{kind: SensorFault(0, kind, 0.3, Step()).model(CART) for kind in ("bias", "drift", "scaling", "hard")},
    "actuator loss": ActuatorFault(0, "loss", 1.0, Step()).model(CART),
    "actuator runaway": ActuatorFault(0, "runaway", 1.0, Step(), travel=(-1.0, 1.0)).model(CART),
    "plant": PlantFault(Uncertainty(A=[[0.0, 0.0], [0.0, -0.1]]), 1.0, Step()).model(CART),
}  # fmt: skip


@pytest.mark.parametrize("name", NOT_CONTAINED)
@pytest.mark.parametrize("unit", [1.0, 2.0**-30, 2.0**30])
def test_a_fault_model_without_the_nominal_plant_is_refused(name: str, unit: float) -> None:
    scaled = [in_units(model, unit) for model in (CART, NOT_CONTAINED[name])]
    start = HPolytope.box([-1.0, -unit], [1.0, unit])
    nominal, fault = (WindowObserver(model, start) for model in scaled)
    with pytest.raises(ValueError, match=r"'motor' does not contain the nominal plant.*ArchitectureII with global_="):
        ArchitectureI(nominal, {"motor": fault})
    ArchitectureII(nominal, {"motor": fault}, start)


@pytest.mark.parametrize("name", CONTAINED)
@pytest.mark.parametrize("unit", [1.0, 2.0**-30, 2.0**30])
def test_a_fault_model_that_contains_it_or_may_is_taken(name: str, unit: float) -> None:
    assert not excludes(in_units(CONTAINED[name], unit), in_units(CART, unit))


def in_units(model: UncertainModel, unit: float) -> UncertainModel:
    """The model with its second state and its input in units ``unit`` times as small."""
    if model.is_scheduled:
        return model
    x, u = np.array([1.0, unit]), 2.0 * unit

    def scaled(item: Any) -> dict[str, Any]:
        changes = {
            "A": (x[:, None], x),
            "B": (x[:, None], u),
            "a": (x, 1.0),
            "E": (x[:, None], 1.0),
            "C": (1.0, x),
            "D": (1.0, u),
        }
        return {
            key: np.asarray(value) * left / right
            for key, (left, right) in changes.items()
            if (value := getattr(item, key)) is not None
        }

    others = [
        Uncertainty(**{**{k: getattr(q, k) for k in "cF"}, **scaled(q)}, bounds=q.bounds) for q in model.uncertainties
    ]
    return model.replace(**scaled(model), uncertainties=others)


@pytest.mark.parametrize(("off", "refused"), [(1e-7, True), (1e-11, False)])
def test_a_difference_beyond_rounding_is_one(off: float, refused: bool) -> None:
    nominal = CART.replace(uncertainties=[])
    assert excludes(nominal.replace(B=[[0.0], [0.1 * (1.0 + off)]]), nominal) is refused


def test_random_models_that_contain_the_nominal_plant_are_never_refused() -> None:
    """60 models, seed 0: the nominal one is a member of the fault's, in its middle, at a corner, or anywhere."""
    rng = np.random.default_rng(0)
    for trial in range(60):
        n, nu, ny, items = (int(v) for v in rng.integers(1, 4, 4))
        A, B = rng.standard_normal((n, n)), rng.standard_normal((n, nu))
        C, D = rng.standard_normal((ny, n)), rng.standard_normal((ny, nu))
        own = [
            Uncertainty(B=10.0 ** rng.uniform(-3, 3) * rng.standard_normal((n, nu)), D=rng.standard_normal((ny, nu)))
            for _ in range(items)
        ]
        delta = rng.choice([-1.0, 1.0], items) if trial % 2 else rng.uniform(-1, 1, items)
        given = {"B": B, "D": D}
        for q, d in zip(own, delta, strict=True):
            given = {key: given[key] + d * getattr(q, key) for key in "BD"}
        nominal = UncertainModel(A, given["B"], C, D=given["D"], n=np.ones(ny))
        assert not excludes(UncertainModel(A, B, C, D=D, n=np.ones(ny), uncertainties=own), nominal), trial


def test_what_is_refused_is_falsified_by_a_healthy_run() -> None:
    """The claim itself: an impulse that is large enough shows every one of them."""
    u = np.zeros((12, 1))
    u[0] = 1e4
    log = CART.simulate([0.0, 0.0], u, np.random.default_rng(0))
    for name, model in NOT_CONTAINED.items():
        bank = ArchitectureII(watched(CART), {"motor": watched(model)}, START, class_one=["motor"])
        record = bank.run(log)
        assert record.died_at["nominal"] is None, name
        assert record.died_at["motor"] is not None, name


@pytest.mark.parametrize("deadline", [float("nan"), -1.0])
def test_a_deadline_is_a_number_of_seconds(deadline: float) -> None:
    observer, bank = watched(CART), ArchitectureI(watched(CART), {})
    for asked in (observer, bank):
        asked.update(y0=[0.0])
        with pytest.raises(ValueError, match=f"deadline is {deadline}; expected"):
            asked.step(u=[0.0], y=[0.0], deadline=deadline)
        assert asked.step(u=[0.0], y=[0.0]) is not None
