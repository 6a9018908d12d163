from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from typer.testing import CliRunner

from polytopes import HPolytope
from svo import Distinguishability, UncertainModel, Uncertainty, WindowObserver, distinguishability
from svo.analysis.model_pair import Explanation, ModelPair
from svo.cli import app
from tests.svo.observers.random_plants import random_plant

Array = NDArray[np.float64]


def integrator(noise: float = 0.1, w: float = 0.0, drift: float = 0.0) -> UncertainModel:
    return UncertainModel([[1.0]], [[1.0]], [[1.0]], E=[[1.0]], w=[w], n=[noise], a=[drift])


POINT = HPolytope.box([0.0], [0.0])


def is_real(model: UncertainModel, u: Array, y: Array, found: Explanation, initial: HPolytope) -> None:
    """Simulate an explanation from its own first state, disturbance and Delta; it must give y within every bound."""
    lower, upper, noise = model.bounds()
    limits = np.array([q.bounds for q in model.uncertainties]).reshape(-1, 2)
    tol = 1e-5
    assert initial.contains(found.x[0], tol=tol)
    assert (found.delta >= limits[:, 0]).all()
    assert (found.delta <= limits[:, 1]).all()
    x = found.x[0]
    for k in range(len(y)):
        assert (found.w[k] >= lower - tol).all()
        assert (found.w[k] <= upper + tol).all()
        total = np.tensordot(np.concatenate([[1.0], found.delta[k]]), model.stack(), axes=1)
        image = total @ np.concatenate([x, u[k], [1.0], found.w[k]])
        assert (np.abs(y[k] - image[model.n_states :]) <= noise + tol * (1 + np.abs(y[k]))).all()
        x = image[: model.n_states]


def check_witness(answer: Distinguishability, plant: UncertainModel, observer: UncertainModel, X: HPolytope) -> None:
    witness = answer.witness
    assert witness is not None
    for model, found in ((plant, witness.plant), (observer, witness.observer)):
        is_real(model, witness.u, witness.y, found, X)


def test_a_bias_beyond_both_noises_is_seen_at_once() -> None:
    faulty = integrator().replace(c=[0.25])
    answer = distinguishability(faulty, integrator(), 10, initial=POINT, u=np.zeros((10, 1)))
    assert (answer.horizon, answer.exact, answer.witness) == (1, True, None)
    assert answer.separation == pytest.approx(0.25)  # 0.25 against 0.1 + 0.1


def test_a_drift_is_seen_when_it_has_left_both_noises() -> None:
    # After k steps the outputs are 0.03 k apart, the noises bridge 0.2: k = 7, that is the 8th sample.
    faulty = integrator(drift=0.03)
    answer = distinguishability(faulty, integrator(), 40, initial=POINT, u=np.zeros((40, 1)))
    assert answer.horizon == 8
    assert answer.witness is not None
    assert len(answer.witness.y) == 7
    check_witness(answer, faulty, integrator(), POINT)


def test_disturbances_that_undo_the_drift_hide_it_for_ever() -> None:
    faulty, observer = integrator(w=0.01, drift=0.015), integrator(w=0.01)
    answer = distinguishability(faulty, observer, 40, initial=POINT, u=np.zeros((40, 1)))
    assert (answer.horizon, answer.searched, answer.exact) == (None, 40, True)
    check_witness(answer, faulty, observer, POINT)


def test_an_unknown_first_state_hides_a_bias_and_two_sets_may_differ() -> None:
    faulty, u, wide = integrator().replace(c=[0.25]), np.zeros((10, 1)), HPolytope.box([-1.0], [1.0])
    assert distinguishability(faulty, integrator(), 10, initial=wide, u=u).horizon is None
    assert distinguishability(faulty, integrator(), 10, initial=POINT, observer_initial=wide, u=u).horizon is None
    apart = HPolytope.box([2.0], [3.0])
    assert distinguishability(integrator(), integrator(), 10, initial=POINT, observer_initial=apart, u=u).horizon == 1


def test_half_an_actuator_needs_an_input_that_shows_it() -> None:
    faulty = integrator().replace(B=[[0.5]])
    still, moving = np.zeros((10, 1)), np.full((10, 1), 0.15)
    assert distinguishability(faulty, integrator(), 10, initial=POINT, u=still).horizon is None
    # 0.075 k > 0.2 from k = 3 on
    assert distinguishability(faulty, integrator(), 10, initial=POINT, u=moving).horizon == 4
    # For every input of a set: with zero in it nothing is certain, without it the smallest input decides.
    any_input, large = HPolytope.box([-1.0], [1.0]), HPolytope.box([0.15], [1.0])
    assert distinguishability(faulty, integrator(), 10, initial=POINT, u=any_input).horizon is None
    assert distinguishability(faulty, integrator(), 10, initial=POINT, u=large).horizon == 4


def test_a_product_of_one_sign_is_exact() -> None:
    # x+ = (1 + Delta) x, Delta in [0, 0.1], x > 0, against a plant with Delta = 0.2 always: 1.2^k - 1.1^k > 0.2.
    base = UncertainModel([[1.0]], None, [[1.0]], n=[0.1])
    observer = base.replace(uncertainties=[Uncertainty(A=[[1.0]], bounds=(0.0, 0.1))])
    plant = base.replace(uncertainties=[Uncertainty(A=[[1.0]], bounds=(0.2, 0.2))])
    start = HPolytope.box([1.0], [1.0])
    answer = distinguishability(plant, observer, 10, initial=start)
    assert (answer.horizon, answer.exact) == (3, True)  # 1.44 - 1.21 = 0.23 > 0.2; one step: 0.1
    check_witness(answer, plant, observer, start)


def test_a_product_of_either_sign_is_relaxed_and_says_so() -> None:
    base = UncertainModel([[0.5]], None, [[1.0]], E=[[1.0]], w=[1.0], n=[0.1])
    observer = base.replace(uncertainties=[Uncertainty(A=[[1.0]])])
    far = base.replace(c=[10.0])
    around = HPolytope.box([-1.0], [1.0])
    assert not distinguishability(base, observer, 5, initial=around).exact
    assert distinguishability(base, observer, 5, initial=around).horizon is None
    assert distinguishability(far, observer, 5, initial=around).horizon == 1


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_model_never_differs_from_itself_nor_from_one_that_contains_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=3)
    start = HPolytope.box(-np.ones(model.n_states), np.ones(model.n_states))
    u = rng.normal(size=(6, model.n_inputs))
    wider = model.replace(n=model.bounds()[2] + 0.1)
    assert distinguishability(model, model, 6, initial=start, u=u).horizon is None
    answer = distinguishability(model, wider, 6, initial=start, u=u)
    assert answer.horizon is None
    if answer.exact:
        check_witness(answer, model, wider, start)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
@example(seed=32074)  # the bound by weak duality was lost to rounding
def test_more_noise_never_makes_it_sooner(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=2)
    start = HPolytope.box(-np.ones(model.n_states), np.ones(model.n_states))
    u = rng.normal(size=(8, model.n_inputs))
    plant = model.replace(c=model.block("c") + rng.uniform(0, 4, model.n_outputs))
    found = []
    for more in (0.0, 0.3, 1.0):
        observer = model.replace(n=model.bounds()[2] + more)
        found.append(distinguishability(plant, observer, 8, initial=start, u=u).horizon or 99)
    assert found == sorted(found)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), corners=st.booleans())
def test_an_observer_is_falsified_within_the_horizon_on_every_run(seed: int, corners: bool) -> None:
    rng = np.random.default_rng(seed)
    noise, w = rng.uniform(0.02, 0.06, 2), rng.uniform(0, 0.005, 2)
    turn = np.array([[0.9, 0.2], [-0.1, 0.8]])
    uncertainty = Uncertainty(A=[[0.0, 0.0], [0.05, 0.0]], bounds=(-0.5, 1.0))
    observer = UncertainModel(turn, [[0.0], [1.0]], np.eye(2), E=np.eye(2), w=w, n=noise, uncertainties=[uncertainty])
    size = float(rng.uniform(1.2, 3.0))
    plant = observer.replace(B=[[0.0], [0.5]], uncertainties=[replace(uncertainty, bounds=(size, size))])
    start, u = HPolytope.box([0.5, -0.1], [0.7, 0.1]), rng.uniform(0.3, 0.6, (12, 1))
    answer = distinguishability(plant, observer, 12, initial=start, u=u)
    log = plant.simulate(rng.uniform([0.5, -0.1], [0.7, 0.1]), u, rng, corners=corners)
    verdicts = WindowObserver(observer, start, horizon=None).run(log).verdicts
    assert answer.horizon is not None
    assert "falsified" in verdicts[: answer.horizon]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"horizon": 0}, "horizon is 0; expected a number of samples >= 1"),
        ({"u": None}, r"u is missing; expected an array \(5, 1\)"),
        ({"u": np.zeros((4, 1))}, r"u has shape \(4, 1\); expected \(K, 1\) with K >= 5"),
        ({"u": np.full((5, 1), np.nan)}, "u contains NaN at"),
        ({"u": HPolytope.whole_space(1)}, "u is unbounded"),
        ({"initial": HPolytope.box([0, 0], [1, 1])}, "initial has dimension 2; expected 1"),
        ({"observer_initial": HPolytope.empty(1)}, "observer_initial is empty"),
        ({"observer_model": integrator().replace(Ts=2.0)}, "observer_model has Ts = 2.0 s; expected 1.0 s"),
        ({"observer_model": UncertainModel([[1.0]], None, [[1.0]])}, "observer_model has 0 inputs"),
        ({"observer_model": integrator().replace(c=lambda s: [s], schedule=1.0)}, "schedule is missing"),
    ],
)
def test_a_wrong_argument_is_named(changes: dict[str, Any], message: str) -> None:
    arguments = {
        "plant_model": integrator(), "observer_model": integrator(), "horizon": 5, "initial": POINT,
        "u": np.zeros((5, 1)), **changes,
    }  # fmt: skip
    with pytest.raises(ValueError, match=message):
        distinguishability(**arguments)


def test_a_scheduled_model_uses_the_schedule_of_each_sample() -> None:
    # The bias appears in the plant at the fourth sample only.
    plant = integrator().replace(c=lambda s: [s], schedule=0.0)
    schedule = np.array([0.0, 0.0, 0.0, 0.5, 0.0])
    answer = distinguishability(plant, integrator(), 5, initial=POINT, u=np.zeros((5, 1)), schedule=schedule)
    assert answer.horizon == 4


def test_the_command_prints_the_table_of_the_eclipse() -> None:
    result = CliRunner().invoke(app, ["distinguish", "eclipse", "--horizon", "4", "--noise", "quiet", "--json"])
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    alpha = answer["faults"]["alpha"]
    assert alpha["description"] == "alpha reads 3 deg too much"
    assert alpha["observers"]["nominal"]["horizon"] == 1  # the paper's "single measurement"
    assert all(case["observers"][name]["horizon"] is None for name, case in answer["faults"].items())


def test_the_command_refuses_a_plant_that_states_no_faults(registered_tank: str) -> None:
    result = CliRunner().invoke(app, ["distinguish", "tank"])
    assert result.exit_code == 1
    assert "'tank' has no method stated_faults" in result.stderr


def test_the_command_refuses_a_horizon_beyond_the_flight() -> None:
    result = CliRunner().invoke(app, ["distinguish", "eclipse", "--horizon", "2000"])
    assert result.exit_code == 1
    assert "horizon is 2000; expected 1 to 950" in result.stderr


@pytest.mark.parametrize("command", ["distinguish", "calibrate"])
def test_help_has_an_example(command: str) -> None:
    result = CliRunner().invoke(app, [command, "--help"])
    assert f"Example: svo {command} eclipse" in " ".join(result.stdout.split())


@pytest.mark.parametrize("share", [1e-4, 1e-5])
def test_a_separation_of_a_ten_thousandth_of_the_noise_is_seen(share: float) -> None:
    faulty = integrator().replace(c=[0.2 * (1.0 + share)])
    answer = distinguishability(faulty, integrator(), 3, initial=POINT, u=np.zeros((3, 1)))
    assert (answer.horizon, answer.exact, answer.witness) == (1, True, None)
    assert answer.separation == pytest.approx(share, rel=1e-2)


@pytest.mark.parametrize("seed", range(6))
def test_an_uncertainty_of_rank_two_comes_apart_as_in_the_observer(seed: int) -> None:
    """Each of its terms has a Delta of its own, so that other terms would promise what this observer does not keep."""
    rng = np.random.default_rng(seed)
    item = Uncertainty(A=rng.normal(size=(3, 3)), C=rng.normal(size=(1, 3)))
    observer = UncertainModel(
        np.eye(3), None, np.ones((1, 3)), E=np.eye(3), w=[0.1] * 3, n=[30.0], uncertainties=[item]
    )
    plant = observer.replace(n=[0.01], uncertainties=[])
    start = HPolytope.box([-1e-3, -1.0, -50.0], [1e-3, 1.0, 50.0])
    pair = ModelPair(plant, observer, 1, start, start, None, None)
    channels = pair.solve(1).observer.samples[0].channels
    window = WindowObserver(observer, start)
    window.update([0.0])
    form, arrays = window._form, window._window.memory.arrays
    own = pair._forms[1].exponents
    rows, columns = form.exponents.rows - own.rows, form.exponents.columns - own.columns
    assert rows[3] != 0  # the outputs have other units than in the pair
    assert len(channels) == 3
    for q, channel in enumerate(channels):
        np.testing.assert_array_equal(channel.gain, np.ldexp(arrays["gain"][0, q], rows))
        np.testing.assert_array_equal(channel.functional, np.ldexp(arrays["functional"][0, q], -columns))
