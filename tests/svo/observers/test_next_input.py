"""u(k+1) at the sample of y(k+1): asked for where the output may tell of it, and of no use anywhere else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ArchitectureII,
    ConstrainedZonotopeObserver,
    PolytopeObserver,
    UncertainModel,
    Uncertainty,
    WindowObserver,
    prove_chain,
)
from svo.faults import ActuatorFault, SensorFault, Step, pairs
from svo.logs.log import Log
from tests.svo.observers.window.window_system import judge

OBSERVERS = [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver]
X0 = HPolytope.box([-1.0], [1.0])
seeds = st.integers(0, 2**32 - 1)


# -- where it is asked for ---------------------------------------------------------------------------------------


def scalar(*uncertainties: Uncertainty, **changes: Any) -> UncertainModel:
    arrays: dict[str, Any] = {"E": [[1.0]], "w": [0.1], "n": [0.1], "uncertainties": uncertainties} | changes
    return UncertainModel([[0.5]], [[1.0]], [[1.0]], **arrays)


def of_output(name: str, **more: Any) -> Uncertainty:
    value = [0.1] if name in "ac" else [[0.1]]
    return Uncertainty(**{name: value}, **more)


DRIVEN = Uncertainty(A=[[0.1]], B=[[0.1]])
NOT_ASKED = {
    "nothing uncertain": scalar(),
    "w in the output": scalar(DRIVEN, F=[[1.0]]),
    "another Delta in the output": scalar(DRIVEN, *(of_output(name) for name in "CcF"), F=[[1.0]]),
    "no input in the Delta of the output": scalar(DRIVEN, of_output("C", A=[[0.1]], E=[[0.1]])),
    "a D and a D_i of zeros": scalar(Uncertainty(B=[[0.1]], D=[[0.0]], C=[[0.0]], c=[0.0]), D=[[0.0]], F=[[1.0]]),
}
ASKED = {
    "D": scalar(D=[[0.2]]),
    "D_i": scalar(of_output("D")),
    "a function D": scalar(D=lambda s: [[s]], schedule=0.0),
    "a function D_i": scalar(Uncertainty(D=lambda s: [[s]]), schedule=0.0),
}
SHARED = {f"B_i and {name}_i": scalar(of_output(name, B=[[0.1]])) for name in "CcF"} | {
    "functions B_i and C_i": scalar(Uncertainty(B=lambda s: [[s]], C=lambda s: [[s]]), schedule=0.0)
}


def first_two(observer: Any, **given: Any) -> Any:
    schedule = observer.model.schedule
    observer.update([0.1], schedule=schedule, **{"u": given["u_next"]} if given else {})
    return observer.step([0.3], [0.2], schedule=schedule, **given)


@pytest.mark.parametrize("kind", OBSERVERS)
@pytest.mark.parametrize("name", [*NOT_ASKED, *ASKED, *SHARED])
def test_it_is_asked_for_where_the_output_may_tell_of_it(kind: Any, name: str) -> None:
    """A polytope observer takes the Delta of state and output apart, so that only D and D_i matter."""
    model = (NOT_ASKED | ASKED | SHARED)[name]
    if name in NOT_ASKED or (kind is PolytopeObserver and name in SHARED):
        without, given = (first_two(kind(model, X0), **more) for more in ({}, {"u_next": [0.3]}))
        assert without.verdict == "consistent"
        np.testing.assert_array_equal(without.box, given.box)
        return
    with pytest.raises(ValueError, match=r"u is missing; expected shape \(1,\)"):
        kind(model, X0).update([0.0], schedule=model.schedule)
    observer = kind(model, X0)
    observer.update([0.1], [0.3], model.schedule)
    with pytest.raises(ValueError, match=r"u_next is missing; expected shape \(1,\), since"):
        observer.step([0.3], [0.2], schedule=model.schedule)
    again = observer.step([0.3], [0.2], [0.3], model.schedule)
    np.testing.assert_array_equal(again.box, first_two(kind(model, X0), u_next=[0.3]).box)


# -- what is said without it -------------------------------------------------------------------------------------


def item(rng: np.random.Generator, where: str, driven: bool, n: int, nu: int, nw: int, ny: int) -> Uncertainty:
    """An uncertainty of rank one or two in the state, the output or both, with or without u, x and w."""
    rank = int(rng.integers(1, 3))
    stack = 0.3 * rng.normal(size=(n + ny, rank)) @ rng.normal(size=(rank, n + nu + 1 + nw))
    if where != "both":
        stack[n:] *= where == "output"
        stack[:n] *= where == "state"
    stack[:, n : n + nu] *= driven
    stack[:, :n] *= rng.random() < 0.7
    stack[:, n + nu + 1 :] *= rng.random() < 0.7
    (A, B, a, E), (C, _, c, F) = (np.split(half, [n, n + nu, n + nu + 1], axis=1) for half in (stack[:n], stack[n:]))
    low = rng.uniform(-1.0, 0.5)
    bounds = low, low + rng.uniform(0.0, 1.0)
    return Uncertainty(A=A, B=B, a=a[:, 0], E=E, C=C, c=c[:, 0], F=F, bounds=bounds)


def plant(rng: np.random.Generator) -> UncertainModel:
    """A plant whose output depends on w or a Delta, whose input on another Delta."""
    n, nu, nw, ny = (int(v) for v in rng.integers(1, (4, 3, 3, 3)))
    A = rng.normal(size=(n, n))
    A *= rng.choice([0.5, 0.9, 1.0]) / np.abs(np.linalg.eigvals(A)).max()
    items = [item(rng, "state", True, n, nu, nw, ny)]
    if rng.random() < 0.6:
        items.insert(int(rng.integers(0, 2)), item(rng, rng.choice(["output", "both"]), False, n, nu, nw, ny))
    F = 0.3 * rng.normal(size=(ny, nw)) if len(items) == 1 or rng.random() < 0.5 else None
    return UncertainModel(
        A, rng.normal(size=(n, nu)), rng.normal(size=(ny, n)), E=rng.normal(size=(n, nw)), F=F,
        w=rng.uniform(0.0, 0.3, nw), n=rng.uniform(0.0, 0.3, ny) * (rng.random(ny) < 0.8), uncertainties=items,
    )  # fmt: skip


def flight(model: UncertainModel, rng: np.random.Generator, samples: int) -> tuple[Log, HPolytope]:
    """A run with missing sensors, and a set of first states that contains its own."""
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    u = 2.0 * rng.normal(size=(samples, model.n_inputs))
    log = model.simulate(x0, u, rng, corners=bool(rng.random() < 0.6))
    y = np.where(rng.random(log.y.shape) < rng.choice([0.0, 0.25]), np.nan, log.y)
    return replace(log, y=y), HPolytope.box(x0 - rng.uniform(0.0, 1.0, x0.size), x0 + rng.uniform(0.0, 1.0, x0.size))


def check_run(observer: Any, log: Log, rng: np.random.Generator, **options: Any) -> None:
    """The truth stays inside, though nothing is known of u(k+1) at sample k + 1; saved once and restored."""
    assert log.x is not None
    saved_at = int(rng.integers(1, len(log)))
    for k in range(len(log)):
        step = observer.update(log.y[k]) if k == 0 else observer.step(log.u[k - 1], log.y[k], **options)
        assert step.verdict == "consistent" or (options and step.verdict == "undecided"), k
        lower, upper = step.box
        room = 1e-12 * (1.0 + np.abs(log.x[k]))  # the simulation itself rounds
        assert (lower - room <= log.x[k]).all(), k
        assert (log.x[k] <= upper + room).all(), k
        if k == saved_at:
            observer = type(observer).from_state_dict(observer.model, observer.state_dict())


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_the_truth_stays_inside_a_window_without_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = plant(rng)
    log, start = flight(model, rng, 14)
    horizon = [1, 2, 3, 5, None][int(rng.integers(0, 5))]
    cells = 4 if rng.random() < 0.2 else 0
    options = {"deadline": 0.0} if not cells and rng.random() < 0.2 else {}
    check_run(WindowObserver(model, start, horizon=horizon, sign_split=cells), log, rng, **options)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_the_truth_stays_inside_a_zonotope_without_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = plant(rng)
    log, start = flight(model, rng, 8)
    check_run(ConstrainedZonotopeObserver(model, start), log, rng)


@settings(max_examples=3, deadline=None)
@given(seeds)
def test_the_truth_stays_inside_a_polytope_without_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = plant(rng)
    log, start = flight(model, rng, 4)
    check_run(PolytopeObserver(model, start), log, rng)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), [(WindowObserver, 400), (ConstrainedZonotopeObserver, 100)])
def test_the_truth_stays_inside_many_plants_without_it(kind: Any, count: int) -> None:
    """Seeds 0 to count - 1, 25 samples each."""
    for seed in range(count):
        rng = np.random.default_rng(seed)
        model = plant(rng)
        log, start = flight(model, rng, 25)
        check_run(kind(model, start), log, rng)


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_readings_that_come_late_count_as_if_they_had_come_in_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = plant(rng)
    log, start = flight(model, rng, 8)
    in_time, late = (WindowObserver(model, start, horizon=None) for _ in range(2))
    for k in range(len(log)):
        given = [log.u[k - 1]] if k else []
        call = "step" if k else "update"
        expected = getattr(in_time, call)(*given, log.y[k])
        getattr(late, call)(*given, np.full(model.n_outputs, np.nan))
        step = late.late_update(log.y[k], k)
        assert step.verdict == "consistent"
    size = 1e-6 * (1.0 + np.abs(expected.box).max())
    np.testing.assert_allclose(step.box, expected.box, atol=size)


@pytest.mark.parametrize("D", [None, [[0.5]]])
def test_a_refused_sample_leaves_no_trace_of_its_input(D: Any) -> None:
    def rising(s: float) -> list[list[float]]:
        return [[0.1, 0.0], [0.0, s]]

    model = UncertainModel(
        [[0.9, 0.1], [0.0, 0.8]], [[0.0], [1.0]], [[1.0, 0.0]], E=np.eye(2), F=[[1.0, 0.0]], w=[0.05, 0.1], n=3.0, D=D,
        uncertainties=[Uncertainty(A=rising), Uncertainty(B=[[0.0], [0.3]])], schedule=0.0,
    )  # fmt: skip
    observer, twin = (WindowObserver(model, HPolytope.box([-1.0, -1.0], [1.0, 1.0]), horizon=8) for _ in range(2))
    for o in (observer, twin):
        o.update([0.0], [1.0], schedule=0.0)
        for y in (0.5, 0.5, 0.5, np.nan):
            o.step([1.0], [y], [1.0], schedule=0.0)
    with pytest.raises(ValueError, match="higher rank"):
        observer.step([50.0], [0.0], [1.0], schedule=0.5)
    boxes = [o.late_update([0.5], 4).box for o in (observer, twin)]
    np.testing.assert_array_equal(*boxes)
    for _ in range(3):
        boxes = [o.step([1.0], [0.5], [1.0], schedule=0.0).box for o in (observer, twin)]
        np.testing.assert_array_equal(*boxes)


# -- alarms ------------------------------------------------------------------------------------------------------


@settings(max_examples=12, deadline=None)
@given(seeds)
def test_an_alarm_without_it_is_proven_from_the_first_sample_on(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = plant(rng)
    log, start = flight(model, rng, 12)
    y = log.y.copy()
    y[8:] += 5.0 + 5.0 * np.abs(np.nan_to_num(y[8:]))
    bad = Log(log.time, log.u, y)
    observer = WindowObserver(model, start, horizon=int(rng.choice([1, 3, 5])))
    record = observer.run(bad)
    chain = prove_chain(observer, bad)
    assert chain.unproven == ()
    assert chain.proven == (record.certificate is not None)
    if record.certificate is not None:
        # one by readings alone has no arrival set that rows could be made of
        assert record.certificate.arrival.is_unknown or judge(record.certificate) == "empty"
        assert record.certificate.difference(record.certificate.last, bad) is None


@pytest.mark.parametrize("name", ["B_i and C_i", "B_i and c_i"])
def test_the_newest_input_of_an_alarm_is_that_of_the_log_where_it_takes_part(name: str) -> None:
    observer = WindowObserver(SHARED[name], X0)
    log = Log(np.arange(3.0), np.array([[0.1], [0.2], [0.3]]), np.array([[0.0], [0.1], [9.0]]))
    certificate = observer.run(log).certificate
    assert certificate is not None
    assert certificate.difference(2, log) is None
    forged = replace(certificate, samples=(*certificate.samples[:2], replace(certificate.samples[2], u=np.ones(1))))
    assert "u of sample 2" in str(forged.difference(2, log))


# -- banks -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("architecture", [ArchitectureI, ArchitectureII])
def test_a_bank_without_it_isolates_as_one_that_is_given_it(architecture: Any) -> None:
    """An actuator that loses half of its effect, beside a sensor's scale and both together."""
    nominal = UncertainModel([[0.9]], [[1.0]], [[1.0]], E=[[1.0]], F=[[0.5]], w=[0.02], n=[0.05], Ts=0.1)
    faults = {"loss": ActuatorFault(0, "loss", 0.5, Step(1.0)), "scale": SensorFault(0, "scaling", 0.2, Step(1.0))}
    models = {name: fault.model(nominal) for name, fault in (faults | pairs(faults)).items()}
    both = models.pop("loss + scale")

    def bank() -> Any:
        observers = {name: WindowObserver(model, X0, horizon=4) for name, model in models.items()}
        if architecture is ArchitectureI:
            observers["both"] = WindowObserver(both, X0, horizon=4)
            return ArchitectureI(WindowObserver(nominal, X0, horizon=4), observers)
        return ArchitectureII(WindowObserver(nominal, X0, horizon=4), observers, WindowObserver(both, X0, horizon=4))

    rng, x, u = np.random.default_rng(0), 0.0, np.zeros(1)
    without, given = bank(), bank()
    for k in range(30):
        w = rng.uniform(-0.02, 0.02)
        y = np.array([x + 0.5 * w + rng.uniform(-0.05, 0.05)])
        following = 0.5 - 0.3 * y
        verdicts = [
            without.update(y) if k == 0 else without.step(u, y),
            given.update(y, u=following) if k == 0 else given.step(u, y, u_next=following),
        ]
        assert len({(v.state, v.fault, v.alive) for v in verdicts}) == 1
        u = following
        x = 0.9 * x + (0.5 if k >= 10 else 1.0) * u[0] + w
    assert verdicts[0].state in {"detected", "isolated"}
    assert "loss" in verdicts[0].alive
