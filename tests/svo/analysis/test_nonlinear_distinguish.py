"""Nonlinear models told apart: where "separated within N" is said, no simulated pair of runs has a common output."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, WindowObserver, design_input, distinguishability
from svo.checks import Array
from svo.functions import sin, sqrt
from svo.logs.drive import drive
from svo.models.nonlinear import NonlinearModel
from tests.svo.models.nonlinear_plants import CASES, Case, crane, pendulum

SEED = 20_261_203


def first(case: Case) -> HPolytope:
    return HPolytope.box(case.x0 - case.spread, case.x0 + case.spread)


def leaking(name: str) -> Any:
    """A leak of the first tank, at the root of its level."""
    f = CASES[name]().model.f
    per_area = {"tank": 0.03 / 28.0, "three tanks": 0.1 / 154.0}[name]

    def faulty(h, u, w):
        first, *others = f(h, u, w)
        return [first - per_area * sqrt(1962.0 * h[0]), *others]

    return faulty


FAULTS: dict[str, dict[str, Any]] = {
    "tank": {"f": leaking("tank")},
    "three tanks": {"f": leaking("three tanks")},
    "pendulum": {"f": lambda x, u, w: [x[1], -9.81 * sin(x[0]) - 0.3 * x[1] + 0.5 * u[0] + w[0]]},
    "crane": {"f": lambda x, u, w, p: crane().model.f(x, 0.1 * u, w, p)},
    "servo": {"f": lambda x, u: [8.0 * (u[0] - x[0])]},
}


def outputs(model: NonlinearModel, case: Case, u: Array, runs: int, rng: np.random.Generator) -> Array:
    """Noise-free outputs (runs, samples, ny) from corners of the first set and inside, with w and p at corners."""
    exact = model.replace(n=np.zeros(model.n_outputs))
    found = []
    for run in range(runs):
        ends = rng.choice([-1, 1], len(case.x0)) if run % 3 else rng.uniform(-1, 1, len(case.x0))
        found.append(exact.simulate(case.x0 + case.spread * ends, u, rng, corners=bool(run % 2), substeps=8).y)
    return np.array(found)


def has_common_output(one: Array, other: Array, room: Array) -> bool:
    """Whether some noise gives a run of each the same readings."""
    gap = np.abs(one[:, None] - other[None])
    return bool((gap <= room).all(axis=(2, 3)).any())


@pytest.mark.parametrize("name", FAULTS)
def test_no_two_runs_have_a_common_output_over_the_horizon(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    faulty, u = case.model.replace(**FAULTS[name]), case.inputs(25)
    found = distinguishability(faulty, case.model, 25, initial=first(case), u=u)
    assert found.horizon is not None
    assert not found.exact
    assert found.witness is None
    own, other = (outputs(m, case, u[: found.horizon], 12, rng) for m in (faulty, case.model))
    assert not has_common_output(own, other, faulty.noise + case.model.noise)
    back = distinguishability(case.model, faulty, 25, initial=first(case), u=u)
    assert back.horizon == found.horizon


@pytest.mark.parametrize("name", ["tank", "pendulum", "crane"])
def test_an_observer_that_keeps_all_data_is_falsified_within_the_horizon(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    faulty, u = case.model.replace(**FAULTS[name]), case.inputs(25)
    horizon = distinguishability(faulty, case.model, 25, initial=first(case), u=u).horizon
    assert horizon is not None
    for run in range(6):
        x0 = case.x0 + case.spread * rng.choice([-1, 1], len(case.x0))
        log = faulty.simulate(x0, u[:horizon], rng, corners=bool(run % 2), substeps=8)
        verdicts = [s.verdict for s in drive(WindowObserver(case.model, first(case), horizon=None), log)]
        assert verdicts[-1] == "falsified"


def test_a_model_is_never_separated_from_itself_or_from_what_contains_it() -> None:
    for name in ("crane", "pendulum", "cstr"):
        case = CASES[name]()
        wider = case.model.replace(n=1.5 * case.model.noise)
        for model in (case.model, wider):
            found = distinguishability(case.model, model, 12, initial=first(case), u=case.inputs(12))
            assert found.horizon is None
            assert 1 <= found.searched <= 12


def test_a_linear_plant_is_told_apart_as_its_linear_model_is() -> None:
    A, B = np.array([[0.0, 1.0], [-4.0, -0.4]]), np.array([[0.0], [1.0]])
    common: dict[str, Any] = {"Ts": 0.1, "n": [0.02], "w": [0.3]}
    linear = UncertainModel.from_continuous(A, B, [[1.0, 0.0]], E=B, **common)

    def plant(gain: float) -> NonlinearModel:
        return NonlinearModel(
            lambda x, u, w: A @ x + B @ (gain * u + w), lambda x: [x[0]], states=["s", "v"], inputs=["u"],
            disturbances=["w"], largest=([-9, -9], [9, 9]), **common,
        )  # fmt: skip

    u, start = 2.0 * np.ones((30, 1)), HPolytope.box([0.0, -0.1], [0.1, 0.1])
    weak = UncertainModel.from_continuous(A, 0.4 * B, [[1.0, 0.0]], E=B, **common)
    expected = distinguishability(weak, linear, 30, initial=start, u=u)
    assert expected.horizon is not None
    for own, other in ((plant(0.4), plant(1.0)), (weak, plant(1.0)), (plant(0.4), linear)):
        found = distinguishability(own, other, 30, initial=start, u=u)
        assert found.horizon == expected.horizon
        assert found.separation == pytest.approx(expected.separation, rel=1e-4)


def test_a_tube_that_grows_beyond_what_is_enclosed_says_how_far_it_was() -> None:
    """Of x' = x^2, which from .6 on is infinite after 17 samples."""
    model = NonlinearModel(
        lambda x, w: [x[0] * x[0] + w[0]], lambda x: [x[0]], states=["x"], disturbances=["w"], w=[0.001], Ts=0.1,
        n=[0.1], largest=([-1e3], [1e3]),
    )  # fmt: skip
    u, start = np.zeros((30, 0)), HPolytope.box([0.5], [0.6])
    found = distinguishability(model.replace(w=[0.002]), model, 30, initial=start, u=u)
    assert found.horizon is None
    assert 5 < found.searched < 17


@pytest.mark.parametrize(("name", "horizon", "limit"), [("pendulum", 8, 10.0), ("servo", 6, 0.4)])
def test_a_designed_input_is_accepted_by_its_proof_only(name: str, horizon: int, limit: float) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    faulty = case.model.replace(**FAULTS[name])
    idle = distinguishability(faulty, case.model, horizon, initial=first(case), u=np.zeros((horizon, 1)))
    assert idle.horizon is None
    found = design_input(faulty, case.model, horizon, initial=first(case), limits=([-limit], [limit]))
    assert found.u is not None
    assert found.horizon is not None
    assert (np.abs(found.u) <= limit + 1e-9).all()
    assert found.energy == pytest.approx(np.sum(found.u**2))
    again = distinguishability(faulty, case.model, horizon, initial=first(case), u=found.u)
    assert again.horizon == found.horizon
    own, other = (outputs(m, case, found.u[: found.horizon], 12, rng) for m in (faulty, case.model))
    assert not has_common_output(own, other, faulty.noise + case.model.noise)


def test_no_input_is_said_to_separate_what_no_input_can() -> None:
    case = pendulum()
    found = design_input(case.model, case.model, 4, initial=first(case), limits=([-1.0], [1.0]))
    assert found.u is None
    assert found.horizon is None
    assert found.separation <= 0.0


@pytest.mark.parametrize(
    ("changes", "error", "why"),
    [
        ({"u": None}, ValueError, "u is None; expected inputs"),
        ({"u": HPolytope.box([-1], [1])}, TypeError, r"u is a set; expected inputs \(K, nu\), along which"),
        ({"u": np.zeros((3, 1))}, ValueError, "at least 9 samples"),
        ({"u": np.zeros((9, 2))}, ValueError, "u has shape"),
        ({"horizon": 0}, ValueError, "horizon is 0"),
        ({"initial": HPolytope.box([0], [1])}, ValueError, "initial"),
        ({"observer_model": CASES["tank"]().model}, ValueError, "observer_model has 2 inputs and 2 outputs"),
        ({"observer_model": "pendulum"}, TypeError, "observer_model is a str"),
        ({"plant_model": pendulum(valid=([-0.2, -9], [0.2, 9])).model}, ValueError, "outside valid"),
    ],
)
def test_what_cannot_be_asked_is_one_error(changes: dict[str, Any], error: type[Exception], why: str) -> None:
    case = pendulum()
    given: dict[str, Any] = {"plant_model": case.model, "observer_model": case.model, "horizon": 9}
    given |= {"initial": first(case), "u": np.zeros((9, 1))} | changes
    with pytest.raises(error, match=why):
        distinguishability(**given)
