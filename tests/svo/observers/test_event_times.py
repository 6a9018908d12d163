"""Samples at times of their own: each transition is that of its own interval."""

from __future__ import annotations

import pickle
import re
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ArchitectureII,
    ConstrainedZonotopeObserver,
    Log,
    NonlinearModel,
    PolytopeObserver,
    UncertainModel,
    Uncertainty,
    WindowObserver,
)
from svo.logs.drive import drive
from svo.models.intervals import transition_rows
from svo.models.nonlinear.simulation import integrated
from svo.observers.window.chain import prove_chain
from tests.svo.observers.event_plants import EventPlant

Array = NDArray[np.float64]
OBSERVERS: dict[str, Any] = {
    "window": WindowObserver, "zonotope": ConstrainedZonotopeObserver, "polytope": PolytopeObserver,
}  # fmt: skip
INTEGRATOR: dict[str, Any] = {
    "A": [[0.0, 1.0], [0.0, 0.0]], "B": [[0.0], [1.0]], "C": [[1.0, 0.0]], "E": [[0.0], [1.0]], "w": [0.1],
    "n": [0.01], "Ts": 0.5,
}  # fmt: skip
FIRST = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def exclusions(observer: Any, log: Log) -> tuple[int, int]:
    """Samples at which the truth is outside the box, and false alarms."""
    outside = alarms = 0
    assert log.x is not None
    for k, step in enumerate(drive(observer, log)):
        alarms += step.verdict == "falsified"
        lower, upper = step.box
        room = 1e-9 * (1.0 + np.abs(log.x[k]))  # the exponentials of the truth round
        outside += not ((lower - room <= log.x[k]) & (log.x[k] <= upper + room)).all()
    return outside, alarms


@pytest.mark.parametrize("kind", OBSERVERS)
@pytest.mark.parametrize("seed", range(4))
def test_the_truth_is_inside_at_random_times(kind: str, seed: int) -> None:
    case = EventPlant(np.random.default_rng([17, seed])).case({"polytope": 10, "zonotope": 25}.get(kind, 40), Ts=0.3)
    assert exclusions(OBSERVERS[kind](case.model, case.first), case.log) == (0, 0)


def test_with_the_sampling_time_instead_of_the_interval_the_truth_is_lost() -> None:
    lost = 0
    for seed in range(4):
        case = EventPlant(np.random.default_rng([17, seed])).case(40, Ts=0.3)
        lost += sum(exclusions(WindowObserver(case.model, case.first), replace(case.log, events=False))) > 0
    assert lost >= 3


@pytest.mark.parametrize("dt", [0.0123, 0.25, 0.5, 0.75, 3.0])
def test_a_transition_is_the_integral_over_its_interval(dt: float) -> None:
    """Of a double integrator, in exact rationals: nothing is off by more than a rounding."""
    model = UncertainModel.from_continuous(**INTEGRATOR)
    t = Fraction(dt)
    zero, one = Fraction(0), Fraction(1)
    exact = [one, t, t**2 / 2, zero, t**2 / 2, zero, one, t, zero, t]
    found = transition_rows(model, None if dt == model.Ts else dt)[0]
    for mine, its in zip(found.ravel().tolist(), exact, strict=True):
        assert abs(Fraction(mine) - its) <= Fraction(2) ** -52 * abs(its)


# -- nonlinear ---------------------------------------------------------------------------------------------------


def pendulum(**more: Any) -> NonlinearModel:
    return NonlinearModel(
        {"angle": "rate", "rate": "-9.81 * sin(angle) - 0.3 * rate + torque + push"}, {"angle": "angle"},
        states=["angle", "rate"], inputs=["torque"], disturbances=["push"], Ts=0.05, n=[0.01], w=[0.05],
        largest=([-30.0, -20.0], [30.0, 20.0]), **more,
    )  # fmt: skip


def pendulum_log(seed: int, samples: int = 40) -> Log:
    """At random times, half of them without a reading; the disturbance switches at the samples."""
    rng = np.random.default_rng(seed)
    model, x = pendulum(), np.array([0.4, 0.0])
    times = np.cumsum(0.05 * rng.uniform(0.1, 1.9, samples))
    u, states, y = rng.normal(size=(samples, 1)), [], []
    for k, now in enumerate(times):
        states.append(x)
        y.append([np.nan if k % 2 else x[0] + rng.choice([-0.01, 0.01])])
        if k + 1 < samples:
            w = np.array([rng.choice([-0.05, 0.05])])
            x = integrated(model.flow, x, w, u[k], float(times[k + 1] - now), 50)
    return Log(times, u, np.array(y), x=np.array(states))


@pytest.mark.parametrize("seed", range(3))
def test_a_nonlinear_plant_at_random_times(seed: int) -> None:
    log, first = pendulum_log(seed), HPolytope.box([0.3, -0.1], [0.5, 0.1])
    assert exclusions(WindowObserver(pendulum(), first), log) == (0, 0)
    outside, alarms = exclusions(WindowObserver(pendulum(), first), replace(log, events=False))
    assert outside or alarms


# -- the whole of observers and banks ----------------------------------------------------------------------------


def integrator_log(seed: int = 1, samples: int = 40, rate: float = 0.0) -> Log:
    """Of a double integrator at random times; ``rate`` (of the speed) is a fault from the middle on."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(0.5 * rng.uniform(0.1, 1.9, samples))
    u, x, y = rng.normal(size=(samples, 1)), np.array([0.2, -0.1]), []
    for k in range(samples):
        y.append(x[0] + rng.uniform(-0.01, 0.01))
        if k + 1 < samples:
            force, dt = u[k, 0] + rng.uniform(-0.1, 0.1) + (rate if k > samples // 2 else 0.0), times[k + 1] - times[k]
            x = np.array([x[0] + dt * x[1] + 0.5 * dt**2 * force, x[1] + dt * force])
    return Log(times, u, np.array(y)[:, None])


@pytest.mark.parametrize("kind", OBSERVERS)
def test_a_saved_state_goes_on_bit_for_bit(kind: str) -> None:
    model, log = UncertainModel.from_continuous(**INTEGRATOR), integrator_log(samples=26)
    whole, cut = OBSERVERS[kind](model, FIRST), OBSERVERS[kind](model, FIRST)
    boxes = [np.array(step.box) for step in drive(whole, log)]
    for _, step in zip(range(20), drive(cut, log), strict=False):
        assert step.box[0].size == 2  # asking moves the programs' bases
    copies = [deepcopy(cut), type(cut).from_state_dict(model, cut.state_dict())]
    for again in copies:
        assert [np.array(step.box).tobytes() for step in drive(again, log, start=20)] == [
            box.tobytes() for box in boxes[20:]
        ]


@pytest.mark.parametrize("kind", OBSERVERS)
def test_a_step_that_is_refused_leaves_no_interval_behind(kind: str) -> None:
    model = UncertainModel.from_continuous(**INTEGRATOR, D=[[0.5]])
    plain, other = (OBSERVERS[kind](model, FIRST) for _ in range(2))
    for observer in (plain, other):
        observer.update([0.1], u=[0.0])
    with pytest.raises(ValueError, match="u_next"):
        other.step([1.0], [0.2], dt=0.2)
    other._step, kept = None, other._step  # type: ignore[method-assign, assignment]
    with pytest.raises(TypeError):
        other.step([1.0], [0.2], u_next=[0.0], dt=0.2)
    other._step = kept  # type: ignore[method-assign]
    steps = [observer.step([1.0], [0.3], u_next=[0.0]) for observer in (plain, other)]
    assert np.array_equal(steps[0].box, steps[1].box)


def test_an_observer_that_has_lost_its_set_finds_it_at_times_of_its_own() -> None:
    model, log = UncertainModel.from_continuous(**INTEGRATOR), integrator_log()
    for kind in ("window", "zonotope"):
        observer = OBSERVERS[kind](model, FIRST)
        observer.lose_set()
        verdicts = [step.verdict for step in drive(observer, log)]
        assert verdicts[0] == "undecided"
        assert set(verdicts[4:]) == {"consistent"}


def bank(model: UncertainModel, kind: str = "window") -> ArchitectureI:
    free = model.in_given_time(lambda plant: plant.replace(w=[2.0]))
    return ArchitectureI(OBSERVERS[kind](model, FIRST), {"force": OBSERVERS[kind](free, FIRST)}, debounce=2)


def test_a_bank_isolates_at_times_of_its_own() -> None:
    model, log = UncertainModel.from_continuous(**INTEGRATOR), integrator_log(rate=0.8)
    record = bank(model).run(log)
    assert record.fault == "force"
    stepped, cut = bank(model), bank(model)
    cut.update(log.y[0])
    for k in range(1, 25):
        cut.step(log.u[k - 1], log.y[k], dt=float(log.time[k] - log.time[k - 1]))
    stepped.load_state_dict(cut.state_dict())
    for k in range(25, len(log)):
        verdict = stepped.step(log.u[k - 1], log.y[k], dt=float(log.time[k] - log.time[k - 1]))
    assert (verdict.fault, verdict.isolated_at) == (record.fault, record.isolated_at)
    assert bank(model).run(integrator_log()).detected_at is None


def test_observers_that_start_during_a_run_go_on_at_times_of_their_own() -> None:
    """Class II starts from a global observer's set when the nominal model falls, at times that are not those of Ts."""
    model, log = UncertainModel.from_continuous(**INTEGRATOR), integrator_log(rate=0.8)
    free, other = (model.in_given_time(lambda plant, w=w: plant.replace(w=w)) for w in ([1.0], ([-3.0], [-2.0])))
    everything = model.in_given_time(lambda plant: plant.replace(w=[4.0]))
    faults = {"force": WindowObserver(free, FIRST), "pull": WindowObserver(other, FIRST)}
    both = ArchitectureII(WindowObserver(model, FIRST), faults, WindowObserver(everything, FIRST))
    record = both.run(log)
    assert record.fault == "force"
    assert record.died_at["force"] is None
    sampled = ArchitectureII(
        WindowObserver(model, FIRST),
        {"force": WindowObserver(free, FIRST), "pull": WindowObserver(other, FIRST)},
        WindowObserver(everything, FIRST),
    )
    assert sampled.run(replace(log, events=False)).fault != "force"


@pytest.mark.parametrize("kind", OBSERVERS)
def test_a_pickle_goes_on_bit_for_bit(kind: str) -> None:
    model, log = UncertainModel.from_continuous(**INTEGRATOR), integrator_log()
    observer = OBSERVERS[kind](model, FIRST)
    for _ in zip(range(10), drive(observer, log), strict=False):
        pass
    again = pickle.loads(pickle.dumps(observer))
    one, two = (o.step(log.u[9], log.y[10], dt=0.123) for o in (observer, again))
    assert np.array(one.box).tobytes() == np.array(two.box).tobytes()


def test_a_chain_of_bounds_is_proven_at_times_of_its_own() -> None:
    model, log = UncertainModel.from_continuous(**INTEGRATOR), integrator_log(rate=0.8)
    chain = prove_chain(WindowObserver(model, FIRST, horizon=4), log)
    assert chain.proven
    assert chain.falsified_at == bank(model).observers["nominal"].run(log).falsified_at


def test_a_log_keeps_its_own_times_where_no_sampling_time_fits() -> None:
    def keeps(*steps: float, events: bool | None = None) -> bool:
        time = np.cumsum([0.0, *steps])
        return Log(time, np.zeros((time.size, 0)), np.zeros((time.size, 1)), events=events).keeps_its_times

    assert [keeps(), keeps(0.7), keeps(0.7, 0.7), keeps(0.1, 0.1019)] == [False] * 4
    assert [keeps(0.1, 0.1025), keeps(0.1, 0.2), keeps(0.7, events=True)] == [True] * 3
    assert not keeps(0.1, 0.2, events=False)


# -- what is refused -----------------------------------------------------------------------------------------------


def test_a_discrete_model_takes_its_sampling_time_within_a_hundredth() -> None:
    observer = WindowObserver(UncertainModel([[0.9]], None, [[1.0]], n=[0.1], Ts=0.5), HPolytope.box([-1], [1]))
    observer.update([0.0])
    assert observer.step(None, [0.0], dt=0.504).verdict == "consistent"
    with pytest.raises(ValueError, match=r"dt is 0\.51 s; expected the model's sampling time 0\.5 s, within 1 %"):
        observer.step(None, [0.0], dt=0.51)
    with pytest.raises(ValueError, match="sampling time"):
        WindowObserver(observer.model, HPolytope.box([-1], [1])).run(
            Log([0.0, 0.5, 1.2], np.zeros((3, 0)), np.zeros((3, 1)))
        )


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (UncertainModel.from_continuous(**INTEGRATOR).replace(w=[0.2]), "arrays of discrete time"),
        (UncertainModel.from_continuous(**INTEGRATOR, remainder=[0.1, 0.1]), "remainder is given in numbers"),
        (
            UncertainModel.from_continuous(
                **INTEGRATOR, remainder={"states": [9.0, 9.0], "inputs": [1.0]},
                uncertainties=[Uncertainty(B=[[0.0], [0.1]], D=[[0.1]], name="gain")],
            ),
            "varying=\\['gain'\\]",
        ),
        (
            UncertainModel.from_continuous(**INTEGRATOR | {"n": [0.0], "F": [[1.0]], "A": [[-1.0, 1.0], [0.0, -1.0]]}),
            "output injection",
        ),
    ],
)  # fmt: skip
def test_intervals_that_a_model_cannot_have(model: UncertainModel, message: str) -> None:
    observer = WindowObserver(model, FIRST)
    observer.update([0.1], u=[0.0])
    with pytest.raises(ValueError, match=message):
        observer.step([0.0], [0.1], u_next=[0.0], dt=0.2)
    assert observer.step([0.0], [0.1], u_next=[0.0]).sample == 1


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, np.inf, "1"])
def test_an_interval_is_a_number_of_seconds(dt: Any) -> None:
    observer = WindowObserver(UncertainModel.from_continuous(**INTEGRATOR), FIRST)
    observer.update([0.0])
    with pytest.raises((TypeError, ValueError), match="dt is"):
        observer.step([0.0], [0.0], dt=dt)


@pytest.mark.parametrize("kind", OBSERVERS)
def test_an_interval_beyond_all_floats_is_named_and_nothing_is_lost(kind: str) -> None:
    model = UncertainModel.from_continuous([[2.0, 1.0], [0.0, 3.0]], [[0.0], [1.0]], [[1.0, 0.0]], n=[0.1], Ts=0.5)
    observer = OBSERVERS[kind](model, FIRST)
    for started in (False, True):
        for dt in (1e3, 1e300):  # exp(3e3) is no float
            with pytest.raises(ValueError, match=rf"a transition of {re.escape(f'{dt:g}')} s \(Ts, or dt\) is beyond"):
                observer.step([0.0], [0.1], dt=dt)
        if not started:
            observer.update([0.1])  # the first sample is still to come
    assert observer.step([0.0], [0.1], dt=0.01).sample == 1
    with pytest.raises(ValueError, match=r"a transition of 1000 s \(Ts, or dt\) is beyond all floats"):
        UncertainModel.from_continuous([[1.0]], None, [[1.0]], Ts=1e3)


def test_the_code_of_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    page = (Path(__file__).parents[3] / "docs" / "event_times.md").read_text(encoding="utf-8")
    block = re.search(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert block is not None
    exec(compile(block[1], "event_times.md", "exec"), {})
    assert capsys.readouterr().out.strip() == block[1].rpartition("  # ")[2].strip()
