"""Readings whose time stamps are off by a stated bound."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ConstrainedZonotopeObserver,
    Log,
    NonlinearModel,
    PolytopeObserver,
    UncertainModel,
    Uncertainty,
    WindowObserver,
    calibrate,
    detect,
    distinguishability,
    verify,
)
from svo.logs.drive import drive
from svo.models.draws import draw
from svo.models.nonlinear import Span
from svo.models.nonlinear.simulation import integrated
from svo.models.stamps import StampErrors
from svo.plant.description import read_description
from tests.svo.models.nonlinear_plants import CASES
from tests.svo.observers.event_plants import EventCase, EventPlant
from tests.svo.observers.nonlinear_events import nonlinear_case
from tests.svo.observers.test_event_times import exclusions

Array = NDArray[np.float64]
CART: dict[str, Any] = {
    "A": [[0.0, 1.0], [0.0, 0.0]], "B": [[0.0], [1.0]], "C": np.eye(2), "E": [[0.0], [1.0]], "w": [0.1],
    "n": [0.01, 0.02], "Ts": 0.5,
}  # fmt: skip
FIRST = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def cart(jitter: Any = 0.1, **more: Any) -> UncertainModel:
    return UncertainModel.from_continuous(**CART | more, jitter=jitter)


def missed(case: EventCase) -> tuple[int, int]:
    return exclusions(WindowObserver(case.model, case.first), case.log)


# -- soundness ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 4, 7, 11])
@pytest.mark.parametrize("jitter", [0.01, 0.3])
def test_the_truth_is_inside_although_stamps_are_off(seed: int, jitter: float) -> None:
    case = EventPlant(np.random.default_rng([18, seed])).case(30, 0.3, jitter)
    assert missed(case) == (0, 0)


OTHERS = [ConstrainedZonotopeObserver, PolytopeObserver]
CASES_OF = {ConstrainedZonotopeObserver: ((4, 15), (7, 15), (11, 15)), PolytopeObserver: ((0, 6), (4, 6))}


@pytest.mark.parametrize("kind", OTHERS)
@pytest.mark.parametrize("jitter", [0.01, 0.3])
def test_the_truth_is_inside_the_sets_of_other_observers(kind: Any, jitter: float) -> None:
    for seed, samples in CASES_OF[kind]:
        case = EventPlant(np.random.default_rng([18, seed])).case(samples, 0.3, jitter)
        assert exclusions(kind(case.model, case.first), case.log) == (0, 0)


@pytest.mark.parametrize("kind", OTHERS)
def test_without_the_widening_other_observers_lose_it_too(kind: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StampErrors, "widening", lambda self, *_: np.zeros(len(self.jitter)))
    case = EventPlant(np.random.default_rng([18, 4])).case(10, 0.3, 0.3)
    assert exclusions(kind(case.model, case.first), case.log) != (0, 0)


@pytest.mark.parametrize("kind", [WindowObserver, *OTHERS])
def test_a_reading_is_worth_the_same_to_each_observer(kind: Any) -> None:
    observer = kind(cart(jitter=[0.1, 0.0], n=[0.01, 0.5]), FIRST)
    exact = kind(cart(None, n=[0.01, 0.5]), FIRST)
    boxes = [np.array(o.update([0.0, np.nan], u=[0.0]).box) for o in (observer, exact)]
    assert boxes[1][1, 0] == pytest.approx(0.01, rel=1e-6)
    assert boxes[0][1, 0] == pytest.approx(0.01 + 0.1 * 1.01, rel=1e-6)  # speed within 1, force within 0.1 for 0.1 s


@pytest.mark.parametrize("kind", [WindowObserver, *OTHERS])
def test_a_disturbance_of_one_side_in_an_output_is_taken_out_about_its_middle(kind: Any) -> None:
    """y = 1000 (x + w): with w from 0.2 to 0.4, y = 500 says that x is between 0.1 and 0.3."""
    output: dict[str, Any] = {"C": [[1000.0, 0.0], [0.0, 1.0]], "F": [[1000.0], [0.0]], "n": [10.0, 0.5]}
    observer = kind(cart(jitter=[1e-9, 0.0], w=([0.2], [0.4]), **output), FIRST)
    box = np.array(observer.update([500.0, np.nan], u=[0.0]).box)
    assert box[:, 0] == pytest.approx([0.09, 0.31], rel=1e-6)


@pytest.mark.parametrize("kind", OTHERS)
def test_other_observers_lose_and_find_their_set(kind: Any) -> None:
    lost = kind(cart(jitter=[0.1, 0.0]), FIRST)
    lost.lose_set()
    log = Log(0.5 * np.arange(6), np.zeros((6, 1)), np.zeros((6, 2)))
    assert {step.verdict for step in drive(lost, log)} == {"undecided"}
    known = kind(cart(jitter=[0.1, 0.0], largest=([-9, -9], [9, 9])), FIRST)
    known.lose_set()
    assert known.run(log).verdicts[-1] == "consistent"
    with pytest.raises(ValueError, match="input changes"):
        known.step([0.0], [0.0, 0.0], u_next=[1.0], dt=0.05)
    assert known.step([0.0], [0.0, 0.0], u_next=[0.0], dt=0.05).verdict == "consistent"


def test_without_the_widening_the_truth_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StampErrors, "widening", lambda self, *_: np.zeros(len(self.jitter)))
    lost = [missed(EventPlant(np.random.default_rng([18, seed])).case(30, 0.3, 0.3)) != (0, 0) for seed in (0, 4, 7)]
    assert all(lost)


@pytest.mark.parametrize("name", ["pendulum", "tank"])
def test_a_nonlinear_plant_whose_stamps_are_off(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case = nonlinear_case(name, np.random.default_rng(9), 25, jitter=0.5)
    assert missed(case) == (0, 0)
    monkeypatch.setattr("svo.models.nonlinear.model.stamped", lambda flow, tape, output, *_: output)
    assert missed(case) != (0, 0)


def test_the_widening_is_what_the_output_can_change() -> None:
    """Of a cart: J times the largest speed that it has within J, and J times the largest force."""
    model = cart(jitter=[0.1, 0.3])
    assert model.origin is not None
    stamps = model.origin.stamps
    assert stamps is not None
    x, u = (np.array([0.0, 2.0]), np.array([5.0, 3.0])), (np.array([-1.0]), np.array([0.5]))
    force = 1.0 + 0.1
    expected = [0.1 * (3.0 + 0.1 * force), 0.3 * force]
    np.testing.assert_allclose(stamps.widening(x, u, np.array([0.5])), expected, rtol=1e-8)
    np.testing.assert_array_less(expected, stamps.widening(x, u, np.array([0.5])))


def test_a_nonlinear_widening_is_that_of_the_same_linear_plant() -> None:
    same = NonlinearModel(
        lambda x, u, w: [x[1], u[0] + w[0]], lambda x: [x[0], x[1]], states=["p", "v"], inputs=["force"],
        disturbances=["push"], Ts=0.5, n=[0.01, 0.02], w=[0.1], largest=([-9, -9], [9, 9]), jitter=[0.1, 0.3],
    )  # fmt: skip
    x, u = Span(np.array([0.0, 2.0]), np.array([5.0, 3.0])), (np.array([-1.0]), np.array([0.5]))
    found = same.output_near(*x, np.array([0.5]), u)
    np.testing.assert_allclose(found.R, [0.1 * (3.0 + 0.1 * 1.1), 0.3 * 1.1], rtol=1e-6)


@pytest.mark.parametrize("name", ["tank", "pendulum", "cstr"])
def test_a_state_is_among_those_that_a_reading_before_or_after_leaves(name: str) -> None:
    rng, case = np.random.default_rng([16, len(name)]), CASES[name](varying="all")
    J = 0.5 * case.model.Ts
    model = case.model.replace(jitter=J)
    n, ny, flow, kept = model.n_states, model.n_outputs, model.flow, 0
    for _ in range(15):
        x, u = case.x0 + case.spread * rng.uniform(-3.0, 3.0, n), np.array(case.u(int(rng.integers(50))), dtype=float)
        room = case.spread * rng.choice([0.1, 1.0, 10.0]) * rng.uniform(0.0, 2.0, (2, n))
        physical = model.physical_range
        inside = (-np.inf, np.inf) if physical is None else (physical.lower, physical.upper)
        box = Span(np.maximum(x - room[0], inside[0]), np.minimum(x + room[1], inside[1]))
        y = np.full(ny, np.nan)
        for i in range(ny):  # each at a time of its own
            w, time = draw(*flow.w, rng, True), J * rng.choice([-1.0, 1.0, rng.uniform(-1.0, 1.0)])
            there = integrated(flow, x, w, u, float(time), 8)
            y[i] = model.reading.values(np.concatenate([there, w, u]))[i] + rng.choice([-1.0, 1.0]) * model.noise[i]
        left = model.seen_near(box, y, (u, u))
        room_of = 1e-6 * (1.0 + np.abs(x))  # of the integration
        assert (x >= left.lower - room_of).all()
        assert (x <= left.upper + room_of).all()
        kept += bool(np.array_equal(left.lower, box.lower) and np.array_equal(left.upper, box.upper))
    assert kept < 10


def test_a_set_that_starts_again_is_found_by_one_reading_whose_stamp_is_off() -> None:
    model = CASES["cstr"]().model
    model = model.replace(jitter=0.5 * model.Ts)
    largest, u = Span(model.start_range.lower, model.start_range.upper), np.array([300.0])
    left = model.seen_near(largest, np.array([350.0]), (u, u))
    assert left.width[1] < 30.0 < largest.width[1]


def test_a_flow_meter_reads_the_flow_of_its_own_time() -> None:
    """A disturbance in an output is not that of the stamp, so its row has its range instead."""
    model = NonlinearModel(
        lambda x, w: [-x[0] + w[0]], lambda x, w: [x[0], w[0]], states=["h"], disturbances=["q"], Ts=0.5, n=0.01,
        w=([1.0], [3.0]), largest=([0], [9]), jitter=[0.0, 0.1],
    )  # fmt: skip
    none = np.zeros(0)
    found = model.output_near(np.array([2.0]), np.array([2.5]), none, (none, none))
    assert found.F[1].tolist() == [0.0]
    assert (found.c[1], found.R[1]) == (pytest.approx(2.0), pytest.approx(1.0))
    assert found.R[0] == pytest.approx(0.0, abs=1e-12)
    same = UncertainModel.from_continuous(
        [[-1.0]], None, [[1.0], [0.0]], E=[[1.0]], F=[[0.0], [1.0]], w=([1.0], [3.0]), n=[0.01, 0.01], Ts=0.5,
        jitter=[0.0, 0.1],
    )  # fmt: skip
    assert same.origin is not None
    stamps = same.origin.stamps
    assert stamps is not None
    assert stamps.shift.tolist() == [0.0, 2.0]
    widening = stamps.widening((np.array([2.0]), np.array([2.5])), (none, none), none)
    np.testing.assert_allclose(widening, [0.0, 1.0], rtol=1e-8)
    assert not stamps.applied(same.stack(), stamps.shift)[0, 2, 2:].any()


def test_a_feedthrough_is_that_of_either_input() -> None:
    stamps = StampErrors(
        UncertainModel(**CART | {"D": [[0.5], [0.0]], "A": np.zeros((2, 2)), "w": [0.0]}), np.array([1e-9, 0.0])
    )
    x = np.zeros(2), np.zeros(2)
    found = stamps.widening(x, (np.array([-1.0]), np.array([3.0])), np.array([3.0]))
    np.testing.assert_allclose(found, [0.5 * 4.0, 0.0], rtol=1e-6)


# -- inputs about a reading ----------------------------------------------------------------------------------------


def test_an_input_that_changes_soon_after_a_reading_is_an_error_that_leaves_the_observer_as_it_was() -> None:
    observer, plain = (WindowObserver(cart(), FIRST) for _ in range(2))
    for one in (observer, plain):
        one.update([0.0, 0.0], u=[1.0])
    with pytest.raises(ValueError, match=r"input changes 0\.05 s after a reading whose stamp is known to 0\.1 s"):
        observer.step([1.0], [0.0, 0.0], u_next=[2.0], dt=0.05)
    steps = [one.step([1.0], [0.0, 0.05], u_next=[1.0], dt=0.05) for one in (observer, plain)]
    assert np.array_equal(steps[0].box, steps[1].box)
    assert steps[0].verdict == "consistent"
    with pytest.raises(ValueError, match="u_next is missing"):
        observer.step([1.0], [0.0, 0.0])


def test_a_log_knows_the_inputs_that_follow_a_reading() -> None:
    times = np.array([0.0, 0.3, 0.35, 0.9])
    log = Log(times, np.array([[0.0], [0.0], [0.01], [0.01]]), np.zeros((4, 2)))
    model = cart(jitter=[0.1, 0.01], D=[[0.02], [0.0]])
    observer, told, blind = (WindowObserver(model, FIRST) for _ in range(3))
    boxes = [np.array(step.box) for step in drive(observer, log)]
    told.update([0.0, 0.0], u=[0.0])
    step = told.step([0.0], [0.0, 0.0], u_next=[0.0], dt=0.3, u_range=[[0.0], [0.01]])
    assert np.array(step.box).tobytes() == boxes[1].tobytes()
    after = told.step([0.0], [0.0, 0.0], u_next=[0.01], dt=0.35 - 0.3)
    assert np.array(after.box).tobytes() == boxes[2].tobytes()
    unread = log.y.copy()
    unread[1, 0] = np.nan
    without = [np.array(step.box) for step in drive(blind, replace(log, y=unread))]
    assert boxes[1][1, 0] < without[1][1, 0]  # the position is known better, by a reading that may have had either
    bank = ArchitectureI(WindowObserver(model, FIRST), {"free": WindowObserver(cart(None, w=[0.5]), FIRST)})
    assert bank.run(log).detected_at is None
    again = ArchitectureI(WindowObserver(model, FIRST), {"free": WindowObserver(cart(None, w=[0.5]), FIRST)})
    again.update([0.0, 0.0], u=[0.0], u_range=[[0.0], [0.01]])
    again.load_state_dict(again.state_dict())
    assert again.step([0.0], [0.0, 0.0], u_next=[0.01], dt=0.05).state == "nominal"


@pytest.mark.parametrize(
    ("bounds", "message"),
    [([[0.0], [1.0]], "bounds that hold"), ([0.0, 1.0], "shape"), ([[2.0], [np.inf]], "finite")],
)
def test_inputs_to_come_are_checked_before_anything_is_taken(bounds: list[Any], message: str) -> None:
    observer = WindowObserver(cart(), FIRST)
    observer.update([0.0, 0.0], u=[2.0])
    with pytest.raises(ValueError, match=message):
        observer.step([2.0], [0.0, 0.0], u_next=[2.0], u_range=bounds)
    exact = WindowObserver(cart(None), FIRST)
    with pytest.raises(ValueError, match="no jitter"):
        exact.update([0.0, 0.0], u_range=[[0.0], [1.0]])


@pytest.mark.parametrize(
    ("kind", "of"),
    [("linear", WindowObserver), ("nonlinear", WindowObserver), *(("linear", other) for other in OTHERS)],
)
def test_a_saved_state_goes_on_bit_for_bit(kind: str, of: Any) -> None:
    samples = 30 if of is WindowObserver else 8
    if kind == "linear":
        case = EventPlant(np.random.default_rng([18, 4])).case(samples, 0.3, 0.1)
    else:
        case = nonlinear_case("pendulum", np.random.default_rng(6), samples, jitter=0.4)
    whole, cut, half = of(case.model, case.first), of(case.model, case.first), samples // 2
    boxes = [np.array(step.box).tobytes() for step in drive(whole, case.log)]
    for _, step in zip(range(half), drive(cut, case.log), strict=False):
        assert step.box is not None
    for again in (deepcopy(cut), of.from_state_dict(case.model, cut.state_dict())):
        assert [np.array(step.box).tobytes() for step in drive(again, case.log, start=half)] == boxes[half:]
    with pytest.raises(ValueError, match="another model"):
        of.from_state_dict(case.model.replace(n=2.0 * np.asarray(case.model.n)), cut.state_dict())


@pytest.mark.parametrize("physical", [None, ([-5.0, -np.inf], [5.0, np.inf])])  # of which the speed is not bounded
def test_a_set_that_is_lost_has_no_reading_whose_stamp_is_off(physical: Any) -> None:
    model = cart(jitter=[0.1, 0.0], physical=physical)
    observer = WindowObserver(model, FIRST)
    observer.lose_set()
    for lost in (WindowObserver.from_state_dict(model, observer.state_dict()), observer):
        verdicts = [step.verdict for step in drive(lost, Log(0.5 * np.arange(6), np.zeros((6, 1)), np.zeros((6, 2))))]
        assert set(verdicts) == {"undecided"}  # the position is read by a sensor without a stamp of use
    known = WindowObserver(cart(jitter=[0.1, 0.0], largest=([-9, -9], [9, 9])), FIRST)
    known.lose_set()
    assert known.run(Log(0.5 * np.arange(6), np.zeros((6, 1)), np.zeros((6, 2)))).verdicts[-1] == "consistent"


# -- what is refused -----------------------------------------------------------------------------------------------


def test_what_knows_nothing_of_stamps_refuses_them() -> None:
    log = Log(0.5 * np.arange(3), np.zeros((3, 1)), np.zeros((3, 2)))
    with pytest.raises(ValueError, match="jitter"):
        calibrate(cart(), log, FIRST)
    with pytest.raises(ValueError, match="jitter"):
        distinguishability(cart(), cart(), 3, initial=FIRST)
    with pytest.raises(ValueError, match="jitter needs the plant in continuous time"):
        cart().replace(w=[0.2])
    observer = WindowObserver(cart(), FIRST)
    observer.update([np.nan, 0.0], u=[0.0])
    with pytest.raises(ValueError, match="came late"):
        observer.late_update([0.0, np.nan], 0)


def test_models_are_told_apart_by_stamps_that_are_off_by_less_than_a_sample() -> None:
    def tank(a: float, jitter: float | None) -> NonlinearModel:
        return NonlinearModel(
            {"h": f"-{a} * sqrt(h)"},
            {"level": "h"},
            states=["h"],
            Ts=0.5,
            n=[0.01],
            physical=([0.0], [9.0]),
            jitter=jitter,
        )

    start = HPolytope.box([4.0], [4.1])

    def found(jitter: float | None) -> int | None:
        options = {"initial": start, "u": np.zeros((20, 0))}
        return distinguishability(tank(0.2, jitter), tank(0.1, jitter), 20, **options).horizon

    exact, late = found(None), found(0.4)
    assert exact is not None
    assert late is not None
    assert late > exact
    with pytest.raises(ValueError, match="less than Ts"):
        found(0.5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"jitter": -1.0}, "jitter"),
        ({"jitter": [0.1]}, "jitter"),
        ({"jitter": np.nan}, "jitter"),
        ({"uncertainties": [Uncertainty(C=np.ones((2, 2)), name="gain")]}, "gain is one number in 2 outputs"),
        ({"C": [[1.0, 0.0]], "n": [0.0], "F": [[1.0]], "A": [[-1.0, 1.0], [0.0, -1.0]]}, "noise n above zero"),
    ],
)
def test_stamps_that_cannot_be(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        WindowObserver(cart(**{"jitter": 0.1} | arguments), FIRST)


# -- from a description to a proof -----------------------------------------------------------------------------------

PLANT = """
Ts = 0.5
[columns]
inputs = [{ name = "force", unit = "N" }]
outputs = [{ name = "position", unit = "m" }, { name = "speed", unit = "m/s" }]
[model]
continuous = true
jitter = %s
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [1.0]]
E = [[0.0], [1.0]]
C = [[1.0, 0.0], [0.0, 1.0]]
n = [0.01, 0.02]
w = [0.1]
[initial]
lower = [-1.0, -1.0]
upper = [1.0, 1.0]
[faults.motor]
type = "actuator"
input = "force"
kind = "loss"
magnitude = 1.0
"""


@pytest.mark.parametrize("stated", ["0.02", "[0.02, 0.02]"])
def test_an_alarm_says_what_of_its_noise_is_not_checked_again(tmp_path: Path, stated: str) -> None:
    (tmp_path / "cart.toml").write_text(PLANT % stated, encoding="utf-8")
    plant = read_description(tmp_path / "cart.toml")
    times, rng = 0.5 * np.arange(30), np.random.default_rng(0)
    u, x, y = np.ones((30, 1)), np.zeros(2), []
    for k in range(30):
        y.append(x + rng.uniform(-1, 1, 2) * [0.01, 0.02])
        force = u[k, 0] if k < 12 else 0.0
        x = np.array([x[0] + 0.5 * x[1] + 0.125 * force, x[1] + 0.5 * force])
    log = Log(times, u, np.array(y))
    found = detect(plant, log)
    assert found.fault == "motor"
    checked = verify(found)
    assert checked.ok, str(checked)
    assert "widened enough for the stamps was proven when it was done" in str(checked)
    whole = verify(found, full=True)
    assert not whole.ok
    assert "a model with jitter are not proven" in str(whole)


def test_a_nonlinear_description_takes_jitter(tmp_path: Path) -> None:
    text = """
Ts = 0.5
[columns]
inputs = [{ name = "flow", unit = "m" }]
outputs = [{ name = "level", unit = "m" }]
[model]
dynamics = { h = "flow - sqrt(h)" }
outputs = { level = "h" }
n = [0.01]
jitter = 0.05
physical = { lower = [0.0], upper = [9.0] }
[initial]
lower = [0.9]
upper = [1.1]
"""
    (tmp_path / "tank.toml").write_text(text, encoding="utf-8")
    model = read_description(tmp_path / "tank.toml").model
    assert model.jitter is not None
    assert model.jitter.tolist() == [0.05]
