from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from polytopes import HPolytope
from svo import Calibration, Log, UncertainModel, Uncertainty, WindowObserver, calibrate
from svo.cli import app
from svo.detection.log_calibration import rounded_up
from svo.observers.zonotope.observer import ConstrainedZonotopeObserver
from tests.svo.observers.other_units import Units
from tests.svo.observers.random_plants import random_plant

Array = NDArray[np.float64]
NAMES = {"outputs": ("level", "flow"), "disturbances": ("rain", "leak")}


def model(**changes: Any) -> UncertainModel:
    return UncertainModel(
        [[0.9, 0.1], [0.0, 0.8]], [[0.0], [1.0]], np.eye(2), E=np.eye(2), w=[0.01, 0.01], n=[0.1, 0.2], names=NAMES
    ).replace(**changes)


START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def healthy(plant: UncertainModel, samples: int = 60, seed: int = 0) -> Log:
    rng = np.random.default_rng(seed)
    schedule = np.linspace(1.0, 2.0, samples) if plant.is_scheduled else None
    return plant.simulate(np.zeros(plant.n_states), np.full((samples, plant.n_inputs), 0.3), rng, schedule=schedule)


def disturbed(log: Log, sample: int, sensor: int, amount: float) -> Log:
    y = log.y.copy()
    y[sample, sensor] += amount
    return replace(log, y=y)


def is_explained(plant: UncertainModel, log: Log, start: HPolytope = START) -> bool:
    return set(WindowObserver(plant, start, horizon=None).run(log).verdicts) == {"consistent"}


def test_a_log_inside_the_bounds_needs_no_widening() -> None:
    found = calibrate(model(), healthy(model()), START)
    assert found.widenings == ()
    assert found.smallest
    assert found.chosen == ("noise level", "noise flow", "disturbance rain", "disturbance leak")


def test_noise_beyond_its_bound_is_named_with_its_amount_and_its_sample() -> None:
    # Exact dynamics from a known state: the only explanation of an error of 0.24 is a bound of 0.24, 20 % more.
    exact = model(w=[0.0, 0.0])
    log = Log(time=np.arange(30.0), u=np.zeros((30, 1)), y=np.zeros((30, 2)))
    log = disturbed(disturbed(log, 17, 1, 0.24), 5, 1, 0.19)
    found = calibrate(exact, log, HPolytope.box([0.0, 0.0], [0.0, 0.0]), bounds=["noise"])
    (widening,) = found.widenings
    assert (widening.bound, widening.sample) == ("noise flow", 17)
    assert widening.amount == pytest.approx(0.04, abs=1e-6)
    assert widening.relative == pytest.approx(0.2, abs=1e-5)
    assert found.model.bounds()[2] == pytest.approx([0.1, 0.24], abs=1e-6)


def test_a_falsified_log_is_accepted_after_widening() -> None:
    log = disturbed(healthy(model()), 31, 1, 0.9)
    assert not is_explained(model(), log)
    found = calibrate(model(), log, START)
    assert [w.bound for w in found.widenings] == ["noise flow"]
    assert found.widenings[0].sample == 31
    assert is_explained(found.model, log)


def test_less_than_the_answer_does_not_do() -> None:
    log = disturbed(healthy(model()), 31, 1, 0.9)
    (widening,) = calibrate(model(), log, START, bounds=["noise flow"]).widenings
    assert is_explained(model(n=[0.1, 0.2 + widening.amount]), log)
    assert not is_explained(model(n=[0.1, 0.2 + 0.999 * widening.amount]), log)


def test_a_gust_is_a_disturbance_when_the_sensors_are_trusted() -> None:
    states = np.zeros((20, 2))
    states[11:, 1] = 0.5 * 0.8 ** np.arange(9)  # a jump of 0.5 between samples 10 and 11
    for k in range(11, 19):
        states[k + 1, 0] = 0.9 * states[k, 0] + 0.1 * states[k, 1]
    log = Log(time=np.arange(20.0), u=np.zeros((20, 1)), y=states)
    at_rest = HPolytope.box([0.0, 0.0], [0.0, 0.0])
    (widening,) = calibrate(model(n=[0.001, 0.001]), log, at_rest, bounds=["disturbances"]).widenings
    assert (widening.bound, widening.sample) == ("disturbance leak", 11)
    assert widening.amount == pytest.approx(0.49, abs=0.01)


def test_a_delta_that_scales_the_input_can_be_widened() -> None:
    plant = model(
        w=[0.0, 0.0], n=[0.0, 0.0], uncertainties=[Uncertainty(B=[[0.0], [1.0]], bounds=(-0.1, 0.1), name="gain")]
    )
    stronger = plant.replace(B=[[0.0], [1.25]], uncertainties=[])
    log = healthy(stronger)
    found = calibrate(plant, log, START, bounds=["deltas"])
    (widening,) = found.widenings
    assert (widening.bound, widening.sample) == ("Delta gain", 1)
    assert widening.amount == pytest.approx(0.15, abs=1e-4)
    assert found.model.uncertainties[0].bounds == pytest.approx((-0.25, 0.25), abs=1e-4)
    assert is_explained(found.model, log)


def test_a_long_log_is_explained_by_one_trajectory_in_pieces() -> None:
    log = disturbed(disturbed(healthy(model(), samples=120), 90, 1, 0.9), 20, 0, 0.6)
    found = calibrate(model(), log, START, bounds=["noise"], window=40)
    assert not found.smallest
    assert {w.bound: w.sample for w in found.widenings} == {"noise flow": 90, "noise level": 20}
    assert is_explained(found.model, log)


def random_case(seed: int) -> tuple[UncertainModel, HPolytope, Log]:
    """A random plant and a healthy log at the corners of every bound, but for one reading that is off by 3."""
    rng = np.random.default_rng(seed)
    plant = random_plant(rng, largest=3)
    start = HPolytope.box(-np.ones(plant.n_states), np.ones(plant.n_states))
    u = rng.normal(size=(12, plant.n_inputs))
    log = plant.simulate(rng.uniform(-1, 1, plant.n_states), u, rng, corners=True)
    sensor = int(rng.integers(plant.n_outputs))
    return plant, start, disturbed(log, int(rng.integers(12)), sensor, 3.0)


def typed_in(plant: UncertainModel, found: Calibration) -> UncertainModel:
    """The model with the printed figures added to its noise, as a user would."""
    n = plant.bounds()[2].copy()
    for w in found.widenings:
        n[int(w.bound.split()[1])] += float(rounded_up(w.amount, 4))
    return plant.replace(n=n)


def check_explained(seed: int) -> None:
    plant, start, log = random_case(seed)
    found = calibrate(plant, log, start, bounds=["noise"])
    assert all(w.amount > 0 for w in found.widenings)
    for wider in (found.model, typed_in(plant, found)):
        assert is_explained(wider, log, start), seed


# In 505, 521 and 530 an uncertainty of rank two came apart in one way here and in another in the widened model.
@pytest.mark.parametrize("seed", [505, 521, 530, *range(531, 551)])
def test_whatever_the_plant_the_widened_model_explains_the_log(seed: int) -> None:
    check_explained(seed)


@pytest.mark.slow
def test_200_widened_plants_explain_their_logs() -> None:
    for seed in range(500, 700):
        check_explained(seed)


@pytest.mark.parametrize("seed", [514, 521, 530])
def test_what_explains_a_log_does_so_for_observers_in_all_units_and_of_all_kinds(seed: int) -> None:
    """They take an uncertainty of rank two apart in different ways; a trajectory of the model is in all their sets."""
    plant, start, log = random_case(seed)
    wider = calibrate(plant, log, start, bounds=["noise"]).model
    rng = np.random.default_rng(seed)
    for k in range(2):
        units = Units.random(rng, wider, 4)
        y = units.log(log)
        for observer in (
            WindowObserver(units.model(wider), units.set("x", start), horizon=None if k else 3),
            ConstrainedZonotopeObserver(units.model(wider), units.set("x", start)),
        ):
            assert "falsified" not in observer.run(y).verdicts


@pytest.mark.parametrize("seed", [802, 804, 807, 811, 812])
def test_a_healthy_log_of_an_uncertain_plant_needs_no_widening(seed: int) -> None:
    """With signs of s taken from Deltas at their centre alone, noise of up to 3.8 times its bound was asked for."""
    rng = np.random.default_rng(seed)
    plant = random_plant(rng, largest=3)
    start = HPolytope.box(-np.ones(plant.n_states), np.ones(plant.n_states))
    u = rng.normal(size=(12, plant.n_inputs))
    log = plant.simulate(rng.uniform(-1, 1, plant.n_states), u, rng, corners=True)
    assert calibrate(plant, log, start, bounds=["noise"]).widenings == ()


@pytest.mark.parametrize("beyond", [1e-8, 3e-8, 1e-5])
def test_no_widening_is_too_small_to_be_named(beyond: float) -> None:
    exact = model(w=[0.0, 0.0])
    log = Log(time=np.arange(5.0), u=np.zeros((5, 1)), y=np.zeros((5, 2)))
    log.y[3, 1] = 0.2 * (1.0 + beyond)
    at_rest = HPolytope.box([0.0, 0.0], [0.0, 0.0])
    assert not is_explained(exact, log, at_rest)
    found = calibrate(exact, log, at_rest, bounds=["noise"])
    assert [w.bound for w in found.widenings] == ["noise flow"]
    assert 0.5 * beyond <= found.widenings[0].relative <= beyond
    assert is_explained(found.model, log, at_rest)


def test_bounds_of_zero_are_measured_by_the_plant_and_not_by_its_units() -> None:
    plant = model(n=[0.0, 0.2], w=[0.01, 0.0])
    log = disturbed(healthy(plant), 31, 1, 0.9)
    units = Units(np.array([20, -30]), np.array([7]), np.array([20, -30]), np.array([-11, 40]))
    a = calibrate(plant, log, START)
    b = calibrate(units.model(plant), units.log(log), units.set("x", START))
    assert [(w.bound, w.sample) for w in a.widenings] == [(w.bound, w.sample) for w in b.widenings]
    scale = {"noise level": 20, "noise flow": -30, "disturbance rain": -11, "disturbance leak": 40}
    for one, two in zip(a.widenings, b.widenings, strict=True):
        assert np.ldexp(one.amount, scale[one.bound]) == pytest.approx(two.amount, rel=1e-6)
        assert one.relative == pytest.approx(two.relative, rel=1e-6)
    assert is_explained(a.model, log)
    gusts = calibrate(plant, log, START, bounds=["disturbances"]).widenings
    assert {w.bound: w.relative for w in gusts}["disturbance leak"] == np.inf


@pytest.mark.parametrize(
    "changes",
    [
        {"w": HPolytope([[1, 1], [-1, 0], [0, -1]], [0.01, 0.005, 0.005])},
        {"physical": ([-1.0, -1.0], [2.0, 2.0])},
        {"A": [[1.05, 0.1], [0.0, 0.8]]},
    ],
)
def test_the_trajectory_keeps_to_sets_of_w_and_of_states_and_to_unstable_models(
    changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = model(**changes)
    log = disturbed(healthy(plant, samples=70), 31, 1, 0.9)
    with monkeypatch.context() as patch:
        patch.setattr("svo.analysis.explanation.WindowObserver", None)  # the trajectory is proof enough
        found = calibrate(plant, log, START, bounds=["noise"], window=30)
    assert [w.bound for w in found.widenings] == ["noise flow"]
    assert is_explained(found.model, log)


def test_where_no_float_is_in_a_set_the_observer_decides() -> None:
    """First states on the line x0 = x1 / 3, which holds next to no pair of floats."""
    line = HPolytope([[0, 1], [0, -1]], [1.0, -0.1], [[1.0, -1.0 / 3.0]], [0.0])
    log = disturbed(model().simulate([0.1, 0.3], np.full((20, 1), 0.3), np.random.default_rng(0)), 7, 1, 0.9)
    found = calibrate(model(), log, line)
    assert [w.bound for w in found.widenings] == ["noise flow"]
    assert is_explained(found.model, log, line)


def test_missing_sensors_and_scheduled_bounds() -> None:
    plant = model(n=lambda s: np.array([0.1, 0.2]) * s, schedule=1.0)
    log = disturbed(healthy(plant), 31, 1, 2.0)
    y = log.y.copy()
    y[10:20, 0] = np.nan
    log = replace(log, y=y)
    found = calibrate(plant, log, START, bounds=["noise"])
    assert [(w.bound, w.sample) for w in found.widenings] == [("noise flow", 31)]
    assert is_explained(found.model, log)
    assert calibrate(plant, disturbed(log, 31, 1, np.nan), START).widenings == ()


@pytest.mark.parametrize("missing", [[0], [3, 4, 5], [29], list(range(1, 29))])
def test_missing_readings_ask_for_nothing_of_a_noise_that_must_widen(missing: list[int]) -> None:
    """With a single gap the noise became NaN: "could not be held in floats"."""
    log = healthy(model(), 30)
    beyond = next(k for k in (15, 0) if k not in missing)
    y = disturbed(log, beyond, 1, 3.0).y
    y[missing] = np.nan
    log = replace(log, y=y)
    found = calibrate(model(), log, START)
    assert [(w.bound, w.sample) for w in found.widenings][:1] == [("noise flow", beyond)]
    assert np.isfinite([w.amount for w in found.widenings]).all()
    assert is_explained(found.model, log)


@pytest.mark.parametrize("value", [1e20, 1e30, 1e300])
def test_an_input_that_no_program_can_hold_is_named(value: float) -> None:
    """1e30 is an infinite bound to HiGHS, and its interior-point method never ended."""
    log = healthy(model())
    log.u[7, 0] = value
    with pytest.raises(ValueError, match=r"u of the log has the value \S+ of input 0 at sample 7"):
        calibrate(model(), log, START)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bounds": ["gusts"]}, "bounds contains 'gusts'; expected any of noise, disturbances, deltas, noise level"),
        ({"window": 1}, "window is 1; expected a number of samples >= 2"),
        ({"initial": HPolytope.whole_space(2)}, "initial is unbounded"),
        ({"model": UncertainModel([[1.0]], None, [[1.0]])}, "u of the log has shape"),
        ({"model": model(w=HPolytope.box([0.0, 0.0], [1.0, 1.0]))}, "w is a polytope"),
        (
            {"model": model(uncertainties=[Uncertainty(A=np.eye(2), name="pole")]), "bounds": ["deltas"]},
            "Delta pole, which multiplies states or disturbances: its widening is not a linear program",
        ),
        ({"bounds": []}, "no widening of nothing explains samples 0 to 59; let bounds contain 'noise'"),
        ({"model": model(c=lambda s: [s, s], schedule=1.0)}, "schedule of the log is missing"),
    ],
)
def test_a_wrong_argument_is_named(changes: dict[str, Any], message: str) -> None:
    log = disturbed(healthy(model()), 31, 1, 0.9)
    arguments: dict[str, Any] = {"model": model(), "log": log, "initial": START, **changes}
    with pytest.raises(ValueError, match=message):
        calibrate(**arguments)


@pytest.mark.parametrize("value", [3.4e38, 1e308])
def test_the_marker_of_a_missing_value_is_not_taken_for_a_measurement(value: float) -> None:
    log = healthy(model())
    log.y[4, 0] = value
    with pytest.raises(ValueError, match="leave the cell empty"):
        calibrate(model(), log, START)


def simulated(folder: Path) -> Path:
    path = folder / "log.csv"
    assert CliRunner().invoke(app, ["simulate", "tank", "--noise", "calm", "--out", str(path)]).exit_code == 0
    return path


def test_the_command_says_when_nothing_is_too_narrow(registered_tank: str, tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["calibrate", "tank", str(simulated(tmp_path))])
    assert result.exit_code == 0
    assert "Nothing to widen: the nominal model explains all 40 samples (calm noise)." in result.stdout


def test_the_command_names_bound_amount_and_sample(registered_tank: str, tmp_path: Path) -> None:
    path = simulated(tmp_path)
    rows = [line.split(",") for line in path.read_text().splitlines()]
    column = rows[0].index("gauge_2")
    rows[13][column] = repr(float(rows[13][column]) + 0.1)
    path.write_text("".join(",".join(row) + "\n" for row in rows))
    result = CliRunner().invoke(app, ["calibrate", "tank", str(path)])
    assert result.exit_code == 0
    assert "The smallest widening" in result.stdout
    assert "first needed at 1.2 s (sample 12)" in result.stdout
    answer = json.loads(CliRunner().invoke(app, ["calibrate", "tank", str(path), "--json"]).stdout)
    assert [w["bound"] for w in answer["widenings"]] == ["noise 1"]
    assert answer["widenings"][0]["time_s"] == pytest.approx(1.2)


def test_the_command_fails_clearly_without_a_log(registered_tank: str, tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["calibrate", "tank", str(tmp_path / "none.csv")])
    assert result.exit_code == 1
    assert "No such file" in result.stderr


@pytest.mark.parametrize("digits", [1, 3, 4, 9])
def test_printed_figures_are_rounded_up(digits: int) -> None:
    rng = np.random.default_rng(digits)
    for value in (*10.0 ** rng.uniform(-12, 12, 200), 0.5, 1.0, 1234.0, 9.9999999999):
        text = rounded_up(float(value), digits)
        assert value <= float(text) <= value * (1 + 10.0 ** (1 - digits))
        assert len(text.split("e")[0].replace(".", "").strip("0")) <= digits
