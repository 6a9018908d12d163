"""Window observers of nonlinear models: the truth stays inside, nothing is falsified, faults are found and proven."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from polytopes import HPolytope
from svo import PolytopeObserver, WindowObserver
from svo.functions import sqrt
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.nonlinear import NonlinearModel
from svo.observers.base import Step
from tests.svo.models.nonlinear_plants import CASES, Case, cstr, oscillator, pendulum, tank

SEED = 20_261_129


def start(case: Case, horizon: int | None = 10) -> WindowObserver:
    initial = HPolytope.box(case.x0 - case.spread, case.x0 + case.spread)
    return WindowObserver(case.model, initial, horizon=horizon)


def driven(case: Case, log: Log) -> Iterator[tuple[int, Step]]:
    yield from enumerate(drive(start(case), log))


def contains(step: Step, x: np.ndarray) -> bool:
    lower, upper = step.box
    room = 1e-9 * (upper - lower) + 1e-13 * np.abs(x)
    return bool((x >= lower - room).all() and (x <= upper + room).all())


@pytest.mark.parametrize(("name", "corners"), [*((name, True) for name in CASES), ("cstr", False), ("crane", False)])
def test_the_truth_stays_inside_and_nothing_is_falsified(name: str, corners: bool) -> None:
    case, rng = CASES[name](), np.random.default_rng(SEED)
    log = case.model.simulate(case.x0, case.inputs(15), rng, corners=corners, substeps=10 if case.smooth else 15)
    for k, step in driven(case, log):
        assert step.verdict == "consistent", (k, step.reason)
        assert contains(step, log.x[k]), k


def test_gaps_and_late_readings_keep_the_truth_inside() -> None:
    case = tank()
    log = case.model.simulate(case.x0, case.inputs(24), np.random.default_rng(SEED))
    y = log.y.copy()
    y[5:16] = np.nan
    y[18, 0] = np.nan
    observer = start(case)
    for k, step in enumerate(drive(observer, replace(log, y=y))):
        assert step.verdict == "consistent"
        assert contains(step, log.x[k])
        if k == 19:
            late = observer.late_update([log.y[18, 0], np.nan], 18)
            assert late.verdict == "consistent"
            assert contains(late, log.x[k])


def test_a_disturbance_that_a_sensor_reads_is_shared_with_the_state() -> None:
    """A flow meter narrows the level, unless the flow may move inside a sample."""

    def model(varying):
        return NonlinearModel(
            lambda h, w: [w[0] - sqrt(h[0])], lambda h, w: [h[0], w[0] ** 2], states=["h"], disturbances=["flow"],
            Ts=0.5, n=[0.5, 0.01], w=([1.0], [3.0]), varying=varying, physical=([0], [20]),
        )  # fmt: skip

    widths = []
    for varying in ((), "flow"):
        plant = model(varying)
        log = plant.simulate([4.0], np.zeros((25, 0)), np.random.default_rng(SEED), corners=True)
        record = [
            (step.verdict, step.box, k)
            for k, step in enumerate(drive(WindowObserver(plant, HPolytope.box([3], [5])), log))
        ]
        assert {verdict for verdict, _, _ in record} == {"consistent"}
        assert all(low[0] <= log.x[k, 0] <= high[0] for _, (low, high), k in record)
        widths.append(np.mean([high[0] - low[0] for _, (low, high), k in record if k > 10]))
    assert widths[0] < 0.3 * widths[1]


def test_a_linear_plant_is_observed_as_a_linear_model_observes_it() -> None:
    linear, nonlinear = oscillator()
    log = linear.simulate([1.0, 0.0], np.ones((30, 1)), np.random.default_rng(SEED))
    first = HPolytope.box([0.5, -1.0], [1.5, 1.0])
    one, other = (WindowObserver(model, first).run(log) for model in (linear, nonlinear))
    assert one.lower == pytest.approx(other.lower, abs=1e-7)
    assert one.upper == pytest.approx(other.upper, abs=1e-7)


def test_a_weaker_catalyst_is_found_and_proven() -> None:
    """The reactor at its unstable set-point, under a proportional controller, loses 5 % of its rate constant."""

    def weak(x, w, u):
        healthy = case.model.f(x, w, u)
        k = 1.0 - x[0] + w[0] - healthy[0]
        return [healthy[0] + 0.05 * k, healthy[1] - 209.2 * 0.05 * k]

    case = cstr()
    faulty = NonlinearModel(
        weak, case.model.h, states=["Ca", "T"], inputs=["Tc"], disturbances=["w1", "w2"], Ts=0.05, n=[0.2],
        w=[0.005, 0.5], physical=case.model.physical, largest=case.model.largest,
    )  # fmt: skip
    rng = np.random.default_rng(SEED)
    healthy = case.model.simulate(case.x0, case.inputs(10), rng)
    after = faulty.simulate(healthy.x[-1], case.inputs(20), rng)
    log = Log(
        np.arange(29) * 0.05, np.vstack([healthy.u, after.u[1:]]), np.vstack([healthy.y, after.y[1:]]),
        x=np.vstack([healthy.x, after.x[1:]]),
    )  # fmt: skip
    verdicts = [(k, step) for k, step in driven(case, log) if step.verdict != "consistent"]
    k, step = verdicts[0]
    assert step.verdict == "falsified"
    assert 10 <= k <= 20
    assert step.certificate.verify()


def test_where_the_equations_do_not_hold_it_is_undecided_and_starts_again() -> None:
    case = pendulum(valid=([-1.2, -9.0], [1.2, 9.0]))
    log = pendulum().model.simulate(case.x0, np.tile([[8.5]], (70, 1)), np.random.default_rng(SEED))
    outside = np.abs(log.x[:, 0]) > 1.2
    assert outside.any()
    undecided = []
    for k, step in driven(case, log):
        assert step.verdict != "falsified"
        assert contains(step, log.x[k])
        if step.verdict == "undecided":
            assert step.reason.startswith(f"outside: at sample {k}, angle may be in ")
            undecided.append(k)
    assert undecided
    assert not set(np.flatnonzero(outside[:-1]) + 1) - set(undecided)  # nothing is claimed of what has left it


def test_an_alarm_after_a_new_start_rests_on_largest() -> None:
    case = tank(valid=([1.0] * 4, [25.0] * 4), largest=([1.0] * 4, [20.0] * 4))
    observer = start(case)
    log = case.model.simulate(case.x0, case.inputs(30), np.random.default_rng(SEED))
    observer.update(log.y[0])
    observer.step(log.u[0], log.y[1])
    step = observer.step([-60.0, 0.0], log.y[2])  # pumps that would drain the tanks beyond where the equations hold
    assert step.verdict == "undecided"
    assert step.reason.startswith("outside: at sample 2, h")
    assert observer.largest_at == 2
    for k in range(3, 12):
        step = observer.step(log.u[k - 1], [22.0 + 2 * (k % 2), 5.0])
        if step.verdict == "falsified":
            break
    assert step.verdict == "falsified"
    assert step.certificate.verify()
    assert step.certificate.largest_at == observer.largest_at >= 2


def test_equations_as_text_are_those_as_functions() -> None:
    common = {
        "states": ["h1", "h2"], "inputs": ["Q"], "disturbances": ["leak"], "w": [0.1], "n": 0.1,
        "parameters": {"a": (0.9, 1.1), "S": 2.0}, "largest": ([0, 0], [9, 9]),
    }  # fmt: skip
    text = NonlinearModel(
        {"h2": "a * (sqrt(h1) - sqrt(h2)) / S", "h1": "(Q - a * sqrt(h1)) / S + leak"}, {"level": "h2"}, **common
    )
    functions = NonlinearModel(
        lambda x, u, w, p: [(u[0] - p[0] * sqrt(x[0])) / p[1] + w[0], p[0] * (sqrt(x[0]) - sqrt(x[1])) / p[1]],
        lambda x: [x[1]], outputs=["level"], **common,
    )  # fmt: skip
    one, other = (model.transition([1.0, 2.0], [1.5, 2.5], [0.3]) for model in (text, functions))
    assert text.outputs == functions.outputs == ("level",)
    assert text.reads == (1,)
    for name in ("A", "a", "E", "R"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert not one.E[:, 2].any()  # S is a constant


@pytest.mark.parametrize(
    ("changes", "error", "why"),
    [
        ({"f": {"h1": "h2"}}, ValueError, "f has no row for h2"),
        ({"f": {"h1": "h2", "h2": "h1", "h3": "h1"}}, ValueError, "f has a row for 'h3'; expected one each for h1, h2"),
        ({"f": {"h1": "h2", "h2": "Q2"}}, ValueError, "f, row h2: unknown symbol 'Q2'.*column 1 of 'Q2'"),
        ({"h": {"level": "h2 +"}}, ValueError, "h, row level: invalid syntax"),
        ({"f": lambda x, u: [x[0]]}, ValueError, "f returned 1 rows; expected 2, one each for h1, h2"),
        (
            {"f": lambda x, u: [x[0], x[2]]},
            ValueError,
            "f reads an entry that is not there.*there are 2 states, 1 inputs",
        ),
        ({"f": lambda x, v: [x[0], v[0]]}, TypeError, r"f has the arguments \(x, v\); expected any of u \(inputs\)"),
        ({"f": lambda x, p: [x[0], p[0]]}, ValueError, "f has an argument 'p', but the model has no parameters"),
        ({"f": lambda x: [x[0], "a"]}, TypeError, "f, row h2: 'a' is used in an expression"),
        ({"f": lambda x: [x[0], x[0] if x[1] > 0 else 0.0]}, TypeError, "f: an expression has no truth value"),
        ({"f": 3}, TypeError, "f is a int; expected a function"),
        ({"h": lambda x: 1j}, TypeError, r"h, row y\[0\]: 1j is used in an expression"),
        ({"largest": None}, ValueError, "largest is missing, and physical is not bounded"),
        ({"largest": ([0, 0], [np.inf, 1])}, ValueError, "largest"),
        ({"w": None}, ValueError, "w is None; expected bounds of the 1 disturbances"),
        ({"w": [1.0, 2.0]}, ValueError, "w"),
        ({"n": [0.1, 0.1]}, ValueError, "n has shape"),
        ({"varying": "noise"}, ValueError, "varying names 'noise'; expected any of all, w, p, leak"),
        ({"disturbances": ["Q"]}, ValueError, "the name 'Q' stands for two things"),
        ({"states": "h1"}, TypeError, "states is 'h1'; expected a list of names"),
        ({"parameters": {"a": (2.0, 1.0)}}, ValueError, r"a is between 2\.0 and 1\.0; expected lower <= upper"),
    ],
)
def test_errors_at_construction_name_the_place(changes, error, why) -> None:
    arguments = {
        "f": lambda x, u, w: [u[0] - sqrt(x[0]) + w[0], sqrt(x[0]) - sqrt(x[1])], "h": lambda x: [x[1]],
        "states": ["h1", "h2"], "inputs": ["Q"], "disturbances": ["leak"], "w": [0.1], "n": 0.1,
        "largest": ([0, 0], [9, 9]),
    }  # fmt: skip
    with pytest.raises(error, match=why):
        NonlinearModel(**(arguments | changes))


@pytest.mark.parametrize(
    ("changes", "initial", "why"),
    [
        ({"valid": ([0, 0], [5, 5])}, ([1, 1], [2, 6]), r"initial: h2 may be in \[1, 6\], outside valid = \[0, 5\]"),
        ({}, ([1, -1], [2, 1]), "initial: the equation of h2 is not enclosed, in sqrt: its argument may be negative"),
        ({"h": lambda x: [x[0], 1.0 / (x[1] - 1.5)]}, ([1, 1], [2, 2]), r"initial: the output y\[1\] .* contains zero"),
        ({"physical": ([3, 3], [4, 4])}, ([1, 1], [2, 2]), "no common point"),
    ],
)
def test_a_first_set_without_values_is_refused(changes, initial, why) -> None:
    arguments = {
        "f": lambda x, u: [u[0] - sqrt(x[0]), sqrt(x[0]) - sqrt(x[1])], "h": lambda x: [x[1]], "states": ["h1", "h2"],
        "inputs": ["Q"], "n": 0.1, "largest": ([0, 0], [9, 9]),
    }  # fmt: skip
    with pytest.raises(ValueError, match=why):
        WindowObserver(NonlinearModel(**(arguments | changes)), HPolytope.box(*initial))


def test_what_a_nonlinear_model_cannot_do_is_one_error() -> None:
    case = pendulum()
    observer = start(case)
    with pytest.raises(ValueError, match="schedule is given; a nonlinear model takes none"):
        observer.update([0.4], schedule=1.0)
    observer.update([0.4])
    with pytest.raises(TypeError, match="model is a NonlinearModel; expected an UncertainModel"):
        PolytopeObserver(case.model, HPolytope.box(case.x0, case.x0))
