"""Tables, pieces as text, and parameters that never change: enclosed at every point, and estimated."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from polytopes import HPolytope
from svo import WindowObserver, calibrate, distinguishability
from svo import functions as F
from svo.faults import ParameterFault, SensorFault, Step
from svo.logs.drive import drive
from svo.models.nonlinear import NonlinearModel
from svo.plant.description import read_description

SEED = 20_261_204
TANKS = Path(__file__).parents[3] / "docs" / "examples" / "two_tanks.toml"


def scalar(f, h="x", **changes) -> NonlinearModel:
    return NonlinearModel({"x": f}, {"y": h}, states=["x"], n=0.1, largest=([-9], [9]), **changes)


# -- tables --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [2.0**-30, 1.0, 2.0**40])
def test_a_table_is_enclosed_over_every_box_and_exact_over_a_piece(scale: float) -> None:
    rng = np.random.default_rng(SEED)
    for _ in range(40):
        count = int(rng.integers(2, 9))
        points = np.sort(rng.uniform(-5, 5, count)) * scale
        values = rng.uniform(-3, 3, count)
        if (np.diff(points) <= 0).any():
            continue
        text = scalar(f"table(x, {points.tolist()}, {values.tolist()})").flow.tape
        tape = NonlinearModel(
            lambda x, p=points, v=values: F.table(x, p, v), lambda x: x, states=["x"], n=0.1, largest=([-9], [9])
        ).flow.tape
        z = np.append(rng.uniform(-8, 8, 200) * scale, points)[:, None]
        assert tape.values(z)[:, 0] == pytest.approx(np.interp(z[:, 0], points, values), abs=1e-9)
        assert np.array_equal(text.values(z), tape.values(z))
        for width in (0.0, 0.1, 3.0, 20.0):
            low = rng.uniform(-8, 8) * scale
            high = low + width * scale
            form = tape.forms(np.array([low]), np.array([high]), 1)
            inside = np.append(rng.uniform(low, high, 50), points[(points >= low) & (points <= high)])
            true = np.interp(inside, points, values)
            rest = true - form.k[0] - form.g[0, 0] * (inside - form.centre[0])
            assert (form.low[0] - 1e-12 <= rest).all()
            assert (rest <= form.high[0] + 1e-12).all()
        i = int(rng.integers(count - 1))
        low, high = points[i] + 0.1 * (points[i + 1] - points[i]), points[i] + 0.9 * (points[i + 1] - points[i])
        form = tape.forms(np.array([low]), np.array([high]), 1)
        slope = (values[i + 1] - values[i]) / (points[i + 1] - points[i])
        assert form.g[0, 0] == pytest.approx(slope, rel=1e-9, abs=1e-9 / scale)
        assert form.high[0] - form.low[0] < 1e-8 * (1.0 + abs(slope) * scale)


def test_a_table_of_numbers_is_an_interpolation() -> None:
    assert F.table(1.5, [0, 1, 2], [0, 10, 30]) == 20.0
    assert F.table(np.array([-1.0, 5.0]), [0, 1], [2, 3]).tolist() == [2.0, 3.0]


def test_a_plant_with_a_pump_curve_keeps_the_truth_inside() -> None:
    model = NonlinearModel(
        {"h": "table(h, [0, 1, 2, 4], [1.5, 1.4, 0.9, 0]) * u - 0.4 * piecewise(h, [1.5], [sqrt(h), 0.3 + h / 2]) + d"},
        {"level": "h"}, states=["h"], inputs=["u"], disturbances=["d"], w=[0.05], n=0.05, Ts=0.2, physical=([0], [5]),
    )  # fmt: skip
    u = 1.0 + np.sin(0.2 * np.arange(50))[:, None]
    log = model.simulate([1.4], u, np.random.default_rng(SEED), corners=True)
    for k, step in enumerate(drive(WindowObserver(model, HPolytope.box([1.0], [2.0])), log)):
        assert step.verdict == "consistent", step.reason
        assert step.box[0][0] - 1e-9 <= log.x[k, 0] <= step.box[1][0] + 1e-9


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("table(x, [0, 1], [1])", "table has 2 points and 1 values; expected at least two increasing points"),
        ("table(x, [1, 0], [1, 2])", "expected at least two increasing points"),
        ("table(x)", "table takes an expression and two lists, such as table"),
        ("table(x, [0, x], [1, 2])", "'x' is no number, which stands in a list of them .column 14"),
        ("table(x, [v for v in x], [1, 2])", "table takes an expression and two lists"),
        ("piecewise(x, [1], [x])", "piecewise has breaks .* and 1 pieces"),
        ("piecewise(x, [1], [x, q])", "unknown symbol 'q'"),
        ("piecewise(x, [1], [x, 1 / 0])", "of a constant has no value"),
    ],
)
def test_a_wrong_list_is_one_error_with_its_place(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=f"f, row x: .*{why}"):
        scalar(text)


@pytest.mark.parametrize("values", ["ab", 3, [1.0, np.nan], [1.0], [1.0, "a"]])
def test_a_wrong_table_is_one_error(values) -> None:
    with pytest.raises((TypeError, ValueError), match=r"values|points"):
        F.table(1.0, [0.0, 1.0], values)


# -- constant parameters ------------------------------------------------------------------------------------------


def tank(constant, **changes) -> NonlinearModel:
    given = {"parameters": {"a": (0.5, 1.5), "S": 2.0, "b": (0.9, 1.1)}, "Ts": 0.5, "physical": ([0], [50])}
    return NonlinearModel(
        {"h": "(Q - a * sqrt(h)) / S + d"}, {"y": "b * h"}, states=["h"], inputs=["Q"], disturbances=["d"], w=[0.01],
        n=0.05, constant=constant, **(given | changes),
    )  # fmt: skip


INPUTS = 3.0 + 2.0 * np.sin(0.3 * np.arange(60))[:, None]
FIRST = HPolytope.box([3.0], [5.0])


@pytest.mark.parametrize("corners", [True, False])
def test_a_constant_parameter_is_estimated_and_never_lost(corners: bool) -> None:
    model = tank(["a"])
    log = model.simulate([4.0], INPUTS, np.random.default_rng(SEED), corners=corners)
    assert log.x.shape == (60, 2)
    assert (log.x[:, 1] == log.x[0, 1]).all()
    widths = []
    for k, step in enumerate(drive(WindowObserver(model, FIRST), log)):
        assert step.verdict == "consistent"
        lower, upper = step.box
        assert (lower - 1e-9 <= log.x[k]).all()
        assert (log.x[k] <= upper + 1e-9).all()
        widths.append(upper[1] - lower[1])
    assert widths[0] == pytest.approx(1.0, abs=1e-6)
    assert widths[-1] < 0.25


def test_all_that_are_not_numbers_are_kept_and_named() -> None:
    model = tank(True)
    assert model.kept == ("a", "b")
    assert model.free == ("S",)
    assert model.names["states"] == ("h", "a", "b")
    assert model.n_states == 3
    assert model.physical_range.upper.tolist() == [50.0, 1.5, 1.1]
    again = pickle.loads(pickle.dumps(model)).replace(constant="b")
    assert again.kept == ("b",)
    assert again.free == ("a", "S")


def test_in_discrete_time_it_stays_too() -> None:
    model = NonlinearModel(
        lambda x, p: [p[0] * x[0] + 0.1], lambda x: [x[0]], states=["x"], n=0.01, parameters={"r": (0.5, 0.95)},
        constant=True, continuous=False, largest=([-9], [9]),
    )  # fmt: skip
    log = model.simulate([3.0], np.zeros((30, 0)), np.random.default_rng(SEED))
    steps = list(drive(WindowObserver(model, HPolytope.box([2.9], [3.1])), log))
    assert {step.verdict for step in steps} == {"consistent"}
    lower, upper = steps[-1].box
    assert upper[1] - lower[1] < 0.1
    assert lower[1] - 1e-9 <= log.x[0, 1] <= upper[1] + 1e-9


def test_a_state_of_a_plant_with_constant_parameters_goes_on() -> None:
    model = tank(True)
    log = model.simulate([4.0], INPUTS, np.random.default_rng(SEED))
    one = WindowObserver(model, FIRST)
    steps = drive(one, log)
    for _ in range(20):
        next(steps)
    other = WindowObserver.from_state_dict(tank(True), one.state_dict())
    with pytest.raises(ValueError, match="state does not belong"):
        WindowObserver.from_state_dict(tank("a"), one.state_dict())
    for k in range(20, 30):
        step = other.step(log.u[k - 1], log.y[k])
        assert np.array_equal(step.box, next(steps).box)
    one.reset(FIRST)
    one.update(log.y[0])
    with pytest.raises(ValueError, match="dimension"):
        one.reset(HPolytope.box([0, 0], [1, 1]))


def test_faults_and_analysis_take_them() -> None:
    model = tank(True)
    moved = ParameterFault("a", 1.0, Step(5.0)).model(model)
    assert moved.kept == ("b",)
    frozen = SensorFault(0, "hard", 3.0, Step(5.0)).model(model)
    assert frozen.kept == ("a", "b")
    log = model.simulate([4.0], INPUTS[:12], np.random.default_rng(SEED))
    assert calibrate(model, log, FIRST).widenings == ()
    found = calibrate(model.replace(n=0.02), log, FIRST, bounds=["noise"])
    assert found.model.kept == ("a", "b")
    flooded = model.replace(f={"h": "(9 * Q - a * sqrt(h)) / S + d"})
    assert distinguishability(flooded, model, 10, initial=FIRST, u=INPUTS).horizon is not None
    assert distinguishability(model, model, 10, initial=FIRST, u=INPUTS).horizon is None


def test_a_description_says_which_are_constant(tmp_path: Path) -> None:
    text = TANKS.read_text(encoding="utf-8").replace("pipe = 0.25 ", "pipe = [0.2, 0.3] ").replace(
        "parameters = { pipe = [0.1, 0.25] }", "parameters = { pipe = [0.1, 0.3] }"
    )  # fmt: skip
    path = tmp_path / "tanks.toml"
    path.write_text(text.replace("[model.dynamics]", 'constant = ["pipe"]\n[model.dynamics]'), encoding="utf-8")
    plant = read_description(path)
    assert plant.model.kept == ("pipe",)
    assert plant.faults["leak"].model.kept == ("pipe",)
    assert plant.faults["blockage"].model.kept == ()  # it moves there
    assert all(fault.contains_nominal for fault in plant.faults.values())
    plant.bank("stated").update([30.0, 12.0])
    path.write_text(text.replace("[model.dynamics]", 'constant = "pip"\n[model.dynamics]'), encoding="utf-8")
    with pytest.raises(ValueError, match="constant is 'pip'; expected any of the parameters area, pipe"):
        read_description(path)


@pytest.mark.parametrize(
    ("constant", "error", "why"),
    [
        ("c", ValueError, "constant is 'c'; expected any of the parameters a, S, b"),
        (["a", 3], TypeError, "constant is .*; expected a list of names"),
        (3, TypeError, "constant is a int; expected True, a name"),
    ],
)
def test_a_wrong_constant_is_one_error(constant, error, why) -> None:
    with pytest.raises(error, match=why):
        tank(constant)


def test_what_is_constant_does_not_vary() -> None:
    with pytest.raises(ValueError, match="varying names 'a'"):
        tank("a", varying="a")
