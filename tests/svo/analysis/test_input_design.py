"""Designed inputs: against closed forms, an independent search, and long simulation of the falsified observer."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver, design_input, distinguishability
from svo.analysis.model_pair import ModelPair
from svo.cli import app

POINT = HPolytope.box([0.0], [0.0])
LIMITS = ([-2.0], [2.0])


def integrator(gain: float = 1.0, w: float = 0.0) -> UncertainModel:
    return UncertainModel([[1.0]], [[gain]], [[1.0]], E=[[1.0]], w=[w], n=[0.1])


@pytest.mark.parametrize("samples", [2, 3, 5])
def test_half_the_gain_of_an_integrator_needs_a_known_least_energy(samples: int) -> None:
    # Outputs differ by half of the sum of the inputs, the noises bridge 0.2: the inputs share 0.4 equally.
    design = design_input(integrator(), integrator(0.5), samples, initial=POINT, limits=LIMITS, margin=1e-3)
    assert design.u is not None
    assert design.energy == pytest.approx((0.4 * 1.001) ** 2 / (samples - 1), rel=1e-3)
    assert design.horizon == samples
    assert design.separation == pytest.approx(1e-3, abs=1e-5)


def test_a_hold_keeps_the_deviation_constant_and_energy_counts_from_the_reference() -> None:
    reference = np.array([[0.1], [0.0], [0.1], [0.0], [0.0]])
    design = design_input(
        integrator(), integrator(0.5), 5, initial=POINT, limits=LIMITS, reference=reference, hold=2, margin=1e-3
    )
    assert design.u is not None
    deviation = (design.u - reference).ravel()
    np.testing.assert_allclose(deviation[[0, 2]], deviation[[1, 3]], atol=1e-12)
    # The reference adds up to 0.2 already, so that four deviations share another 0.2 (or -0.6).
    assert design.energy == pytest.approx((0.4 * 1.001 - 0.2) ** 2 / 4, rel=1e-2)


def test_no_input_within_the_limits_is_an_answer() -> None:
    design = design_input(integrator(), integrator(0.5), 3, initial=POINT, limits=([-0.1], [0.1]))
    assert (design.u, design.energy, design.horizon, design.checks) == (None, None, None, ())
    assert design.separation == pytest.approx(-0.5, abs=1e-3)  # 0.1 apart at most, against 0.2


def test_every_observer_of_several_is_falsified() -> None:
    observers = [integrator(0.5), integrator(1.5), integrator(0.8)]
    design = design_input(integrator(), observers, 4, initial=POINT, limits=LIMITS, margin=1e-3)
    assert design.u is not None
    assert all(check.horizon is not None for check in design.checks)
    assert len(design.checks) == 3
    assert design.energy == pytest.approx((0.2 * 1.001 / 0.2) ** 2 / 3, rel=1e-2)  # the last one needs a sum of 1


def oscillator(damping: float) -> UncertainModel:
    A = np.array([[1.0, 0.2], [-0.2, 1.0 - damping]])
    return UncertainModel(A, [[0.0], [0.2]], [[1.0, 0.0]], E=[[0.0], [1.0]], w=[0.005], n=[0.05])


def test_no_input_of_a_grid_is_much_cheaper() -> None:
    # Independent search: the separation of every input of a grid, without any use of multipliers.
    plant, observer, X = oscillator(0.1), oscillator(0.6), HPolytope.box([-0.02] * 2, [0.02] * 2)
    samples, limits = 8, ([-2.0], [2.0])
    design = design_input(plant, observer, samples, initial=X, limits=limits, hold=4, margin=1e-2)
    assert design.u is not None
    assert design.energy is not None
    pair = ModelPair(plant, observer, samples, X, X, np.zeros((samples, 1)), None)
    cheapest = np.inf
    for first, second in itertools.product(np.linspace(-2.0, 2.0, 17), repeat=2):
        u = np.repeat([first, second], 4)[:, None]
        energy = float(np.sum(u**2))
        if energy < cheapest and pair.with_inputs(u).solve(samples).separation >= 1e-2:
            cheapest = energy
    assert design.energy <= cheapest * (1 + 1e-6)
    assert design.energy >= 0.5 * cheapest  # one step of the grid


def two_inputs(gains: list[float]) -> UncertainModel:
    return UncertainModel([[0.5]], [gains], [[1.0]], n=[0.1])


CROSS = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]]  # no input alone tells all of these from no effect


@pytest.mark.parametrize(
    ("limit", "found"),
    [(0.42, True), *(pytest.param(*case, marks=pytest.mark.slow) for case in ((0.33, False), (2.0, True)))],
)
def test_inputs_that_separate_only_together_are_found_at_least_energy(limit: float, found: bool) -> None:
    """Five models, two inputs: one input at a time has no slope for some pair. Each |gain' u| must reach 0.2."""
    observers = [two_inputs(gains) for gains in CROSS]
    limits = ([-limit] * 2, [limit] * 2)
    design = design_input(two_inputs([0.0, 0.0]), observers, 2, initial=POINT, limits=limits, margin=1e-2)
    assert (design.u is not None) == found
    if found:
        assert design.energy == pytest.approx(0.202**2 + 0.404**2, rel=1e-3)
        assert design.horizon == 2
    else:
        assert design.separation == pytest.approx(-0.175, abs=0.03)  # (0.33 - 0.165) / 0.2 - 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_five_random_models_of_two_inputs_are_separated_near_the_least_energy(seed: int) -> None:
    """Wherever one of 2000 random inputs separates them; the cheapest of a fine random search is no cheaper."""
    rng = np.random.default_rng(seed)
    models = [
        UncertainModel([[0.8, 0.2], [-0.1, 0.7]], rng.normal(size=(2, 2)), np.eye(2), n=[0.15, 0.15]) for _ in range(5)
    ]
    X, limits, samples = HPolytope.box([0.0] * 2, [0.0] * 2), ([-1.0] * 2, [1.0] * 2), 3
    pairs = [ModelPair(models[0], model, samples, X, X, np.zeros((samples, 2)), None) for model in models[1:]]
    cheapest = np.inf
    for _ in range(2000):
        u = rng.uniform(-1, 1, (samples, 2)) * rng.uniform(0.2, 1)
        u[-1] = 0.0  # of no effect within the horizon
        if np.sum(u**2) < cheapest:
            separation = min(pair.with_inputs(u).solve(samples, least=-1.0).separation for pair in pairs)
            cheapest = float(np.sum(u**2)) if separation >= 1e-2 else cheapest
    design = design_input(models[0], models[1:], samples, initial=X, limits=limits, margin=1e-2)
    assert (design.u is not None) or not np.isfinite(cheapest)
    if design.energy is not None:
        assert design.energy <= 1.001 * cheapest


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))])
def test_the_observer_is_falsified_within_the_horizon_whatever_happens(seed: int) -> None:
    # The observer's Delta multiplies input and state, and the factor of the input changes sign with it.
    rng = np.random.default_rng(seed)
    observer = oscillator(0.3).replace(
        uncertainties=[Uncertainty(A=[[0, 0], [0, 0.1]], bounds=(-1, 1)), Uncertainty(B=[[0], [0.05]], bounds=(0, 1))]
    )
    plant, X = oscillator(0.3).replace(B=[[0.0], [0.1]]), HPolytope.box([-0.02] * 2, [0.02] * 2)
    samples = 10
    design = design_input(plant, observer, samples, initial=X, limits=([-3.0], [3.0]), reference=np.full((12, 1), 0.1))
    assert design.horizon is not None
    assert design.u is not None
    for corners in (False, True):
        log = plant.simulate(rng.uniform(-0.02, 0.02, 2), design.u, rng, corners=corners)
        verdicts = WindowObserver(observer, X, horizon=None).run(log).verdicts
        assert "falsified" in verdicts[: design.horizon]


def test_affine_bounds_lie_below_the_separation_of_other_inputs() -> None:
    rng = np.random.default_rng(0)
    plant, observer, X = oscillator(0.1), oscillator(0.6), HPolytope.box([-0.02] * 2, [0.02] * 2)
    pair = ModelPair(plant, observer, 6, X, X, np.zeros((6, 1)), None)
    for _ in range(10):
        u, v = rng.uniform(-2, 2, (2, 6, 1))
        at, other = (pair.with_inputs(z).solve(6, least=-1.0) for z in (u, v))
        assert at.separation + np.sum(at.input_slope * (v - u)) <= other.separation + 1e-6


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"horizon": 0}, "horizon is 0; expected a number of samples >= 1"),
        ({"hold": 0}, "hold is 0; expected a number of samples >= 1"),
        ({"margin": 0.0}, "margin is 0.0; expected a separation above 1e-06"),
        ({"limits": ([1.0], [-1.0])}, "a lower one is above its upper one"),
        ({"limits": ([-1.0, 0.0], [1.0, 1.0])}, "limits is .* expected .lower, upper., each of shape"),
        ({"limits": ([-np.inf], [1.0])}, "limit contains an infinity"),
        ({"reference": np.zeros((2, 1))}, r"reference has shape \(2, 1\); expected .* \(K, 1\) with K >= 3"),
        ({"weight": [0.0]}, "weight is .* expected 1 positive numbers"),
        ({"observer_initial": [POINT, POINT]}, "observer_initial has 2 sets; expected 1"),
        ({"plant_model": UncertainModel([[1.0]], None, [[1.0]])}, "plant_model has no inputs"),
    ],
)
def test_a_wrong_argument_is_named(changes: dict[str, Any], message: str) -> None:
    arguments = {
        "plant_model": integrator(), "observer_models": integrator(0.5), "horizon": 3, "initial": POINT,
        "limits": LIMITS, **changes,
    }  # fmt: skip
    with pytest.raises(ValueError, match=message):
        design_input(**arguments)


COMMAND = [
    "design-input", "eclipse", "--fault", "elevator", "--size", "0.3", "--horizon", "10", "--hold", "5",
    "--noise", "conservative",
]  # fmt: skip


@pytest.mark.slow
def test_the_command_isolates_a_small_loss_of_the_elevator(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, [*COMMAND, "--input", "elevator_deg", "--out", str(tmp_path / "u.csv"), "--json"])
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    assert answer["horizon"] <= 10
    assert all(case["horizon_without"] is None for case in answer["observers"].values())
    written = np.genfromtxt(tmp_path / "u.csv", delimiter=",", names=True)
    assert written.dtype.names == ("time_s", "elevator_deg", "thrust_command")
    np.testing.assert_array_equal(written["elevator_deg"], answer["inputs"]["elevator_deg"])
    assert (np.abs(written["elevator_deg"]) <= 25.0).all()


@pytest.mark.slow
def test_no_input_of_the_eclipse_shows_the_dynamics_fault() -> None:
    # The input enters plant and observer alike and M_u u hardly depends on the airspeed: docs/errata.md.
    options = ["--fault", "dynamics", "--horizon", "3", "--hold", "3", "--noise", "conservative"]
    result = CliRunner().invoke(app, ["design-input", "eclipse", *options])
    assert result.exit_code == 1
    assert "No input found" in result.stdout


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["--fault", "rudder"], "plant 'eclipse' states no fault 'rudder'; it has alpha, elevator, dynamics"),
        (["--input", "flaps"], "plant 'eclipse' has no input 'flaps'; it has elevator_deg, thrust_command"),
        (["--size", "2"], "size is 2.0; expected a fraction"),
    ],
)
def test_the_command_names_what_is_wrong(changes: list[str], message: str) -> None:
    result = CliRunner().invoke(app, [*COMMAND, *changes])
    assert result.exit_code == 1
    assert message in result.stderr


def test_figures_are_all_that_goes_to_standard_output() -> None:
    # HiGHS writes a banner to the process' standard output, past sys.stdout, if it is let.
    code = (
        "from polytopes import HPolytope\nfrom svo import UncertainModel, distinguishability\n"
        "m = UncertainModel([[1.0]], [[1.0]], [[1.0]], n=[0.1])\nX = HPolytope.box([0.0], [0.0])\n"
        "distinguishability(m.replace(c=[1.0]), m, 2, initial=X, u=[[0.0], [0.0]])\nprint('figures')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "figures\n"


def test_the_answer_is_checked_by_distinguishability() -> None:
    design = design_input(integrator(w=0.01), integrator(0.5, w=0.01), 4, initial=POINT, limits=LIMITS)
    assert design.u is not None
    answer = distinguishability(integrator(w=0.01), integrator(0.5, w=0.01), 4, initial=POINT, u=design.u)
    assert design.checks[0].horizon == answer.horizon
    assert answer.exact
