"""Observers and banks of nonlinear models, saved, pickled or copied in the middle of a run, go on bit for bit."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, ArchitectureII, WindowObserver
from svo.logs.drive import advance
from svo.logs.log import Log
from svo.models.nonlinear import NonlinearModel
from tests.svo.models.nonlinear_plants import CASES, Case, crane, pendulum, servo, tank
from tests.svo.observers.test_saved_states import resealed, through_a_file

SEED = 20_261_130
CUTS = (0, 1, 7)
SAMPLES = 11


def first(case: Case) -> HPolytope:
    return HPolytope.box(case.x0 - case.spread, case.x0 + case.spread)


def observer(case: Case, horizon: int | None = 3) -> WindowObserver:
    return WindowObserver(case.model, first(case), horizon=horizon)


def run_of(case: Case) -> Log:
    log = case.model.simulate(case.x0, case.inputs(SAMPLES), np.random.default_rng(SEED), substeps=4)
    log.y[5] = np.nan
    return log


def driven(watcher: Any, log: Log, samples: Iterable[int]) -> list[Any]:
    found = []
    for k in samples:
        step = advance(watcher, log.u[k - 1] if k else None, log.y[k], log.u[k], None)
        found.append((step.verdict, step.reason, *(end.tobytes() for end in step.box)))
    return found


def from_file(watcher: WindowObserver, model: NonlinearModel) -> WindowObserver:
    return WindowObserver.from_state_dict(model, through_a_file(watcher.state_dict()))


COPIES: dict[str, Callable[[WindowObserver], WindowObserver]] = {
    "saved": lambda watcher: from_file(watcher, watcher.model),
    "saved, its model pickled": lambda watcher: from_file(watcher, pickle.loads(pickle.dumps(watcher.model))),
    "pickled": lambda watcher: pickle.loads(pickle.dumps(watcher)),
    "deep-copied": copy.deepcopy,
}


@pytest.mark.parametrize("name", ["cstr", "crane", "servo"])
def test_a_copy_goes_on_bit_for_bit_and_leaves_the_original_alone(name: str) -> None:
    case = CASES[name]()
    log = run_of(case)
    whole = driven(observer(case), log, range(SAMPLES))
    for cut in CUTS:
        watcher = observer(case)
        driven(watcher, log, range(cut))
        others = [copied(watcher) for copied in COPIES.values()]
        for other in (*others, watcher):
            assert driven(other, log, range(cut, SAMPLES)) == whole[cut:], cut


def test_a_restart_and_a_late_reading_are_part_of_a_state() -> None:
    case = pendulum(valid=([-0.6, -9.0], [0.6, 9.0]))
    log = pendulum().model.simulate(case.x0, np.tile([[8.5]], (24, 1)), np.random.default_rng(SEED))
    watcher = observer(case, None)
    said = driven(watcher, log, range(24))
    outside = [k for k, (verdict, *_) in enumerate(said) if verdict == "undecided"]
    assert outside
    for cut in (outside[0] + 1, outside[0] + 2):
        watcher = observer(case, None)
        y = log.y.copy()
        y[cut - 2] = np.nan
        driven(watcher, replace(log, y=y), range(cut))
        other = from_file(watcher, case.model)
        assert other.largest_at == watcher.largest_at
        if watcher.window[0] <= cut - 2:
            late = [w.late_update(log.y[cut - 2], cut - 2) for w in (watcher, other)]
            assert late[0].reason == late[1].reason
        assert driven(other, log, range(cut, 24)) == driven(watcher, log, range(cut, 24))


def test_an_alarm_is_still_one_and_proven() -> None:
    case = tank()
    watcher = observer(case)
    watcher.update([12.3, 12.8])
    assert watcher.step([3.0, 3.0], [16.0, 12.8]).verdict == "falsified"
    again = from_file(watcher, case.model)
    step = again.step([3.0, 3.0], [12.3, 12.8])
    assert step.verdict == "falsified"
    assert step.certificate.verify()


@pytest.mark.parametrize("architecture", ["I", "II"])
def test_a_bank_goes_on_bit_for_bit(architecture: str) -> None:
    case = crane()
    heavy = case.model.replace(parameters={"gravity": (9.7, 9.9), "drag": (0.1, 3.0)})
    blind = case.model.replace(n=[0.5, 0.05])

    def bank() -> Any:
        nominal, *others = (WindowObserver(m, first(case), horizon=3) for m in (case.model, heavy, blind))
        faults = dict(zip(("drag", "load cell"), others, strict=True))
        if architecture == "I":
            return ArchitectureI(nominal, faults)
        whole = HPolytope.box([-1.0, -3.0], [1.0, 3.0])
        return ArchitectureII(nominal, faults, whole, class_one=("drag",))

    log = run_of(case)
    log.y[8:, 0] += 0.3

    def said(of: Any, samples: Iterable[int]) -> list[Any]:
        steps = (advance(of, log.u[k - 1] if k else None, log.y[k], log.u[k], None) for k in samples)
        return [(v.state, v.fault, v.alive, boxes(v)) for v in steps]

    def boxes(v: Any) -> list[bytes]:
        return [step.box[0].tobytes() for name, step in v.steps.items() if name in v.alive]

    whole = said(bank(), range(SAMPLES))
    assert whole[-1][0] != "nominal"
    for cut in (2, 9):
        one, loaded = bank(), bank()
        said(one, range(cut))
        loaded.load_state_dict(through_a_file(one.state_dict()))
        for other in (loaded, pickle.loads(pickle.dumps(one)), copy.deepcopy(one), one):
            assert said(other, range(cut, SAMPLES)) == whole[cut:]


def weaker(x: Any, u: Any, w: Any, p: Any) -> Any:
    f = crane().model.f(x, u, w, p)
    return [f[0], f[1] * 0.999]


OTHERS: dict[str, Callable[[NonlinearModel], NonlinearModel]] = {
    "equations": lambda m: m.replace(f=weaker),
    "outputs": lambda m: m.replace(h=lambda x, u: [x[0] + 0.1 * u[0], x[1]]),
    "noise": lambda m: m.replace(n=[0.01, 0.0500001]),
    "disturbance": lambda m: m.replace(w=[0.11]),
    "parameter": lambda m: m.replace(parameters={"gravity": (9.7, 9.9), "drag": (0.1, 0.31)}),
    "varying": lambda m: m.replace(varying=["wind"]),
    "valid": lambda m: m.replace(valid=([-9, -9], [9, 9])),
    "physical": lambda m: m.replace(physical=([-2, -9], [2, 9])),
    "largest": lambda m: m.replace(largest=([-1.5, -8], [1.5, 9])),
    "Ts": lambda m: m.replace(Ts=0.041),
    "linear": lambda m: m.carrier,
}


@pytest.mark.parametrize("what", OTHERS)
def test_the_state_of_another_model_is_refused(what: str) -> None:
    case = crane()
    watcher = observer(case)
    driven(watcher, run_of(case), range(3))
    with pytest.raises(ValueError, match="state does not belong to a window observer of this model"):
        WindowObserver.from_state_dict(OTHERS[what](case.model), watcher.state_dict())


@pytest.mark.parametrize("name", ["plant.box", "plant.C", "plant.c", "plant.F", "plant.n"])
def test_a_damaged_state_is_refused_also_with_a_right_seal(name: str) -> None:
    case = crane()
    watcher = observer(case)
    driven(watcher, run_of(case), range(4))
    state = watcher.state_dict()
    spoilt = np.where(np.arange(state[name].size).reshape(state[name].shape) == 0, np.nan, state[name])
    for value in (spoilt, state[name][..., :-1], state[name].astype(np.float32), -np.ones_like(state[name]), None):
        if name in ("plant.C", "plant.c", "plant.F") and value is not None and (value == -1.0).all():
            continue  # such numbers may be
        if name == "plant.box" and value is not None and (value == -1.0).all():
            value = state[name][::-1]
        changed = {k: v for k, v in state.items() if k != name} | ({} if value is None else {name: value})
        with pytest.raises(ValueError, match="state does not belong to a window observer of this model"):
            WindowObserver.from_state_dict(case.model, resealed(changed))
        if value is not None:
            with pytest.raises(ValueError, match="changed"):
                WindowObserver.from_state_dict(case.model, changed)


def test_a_state_is_of_a_kind_of_model() -> None:
    case = servo()
    with pytest.raises(TypeError, match="model is a str; expected an UncertainModel"):
        WindowObserver.from_state_dict("servo", observer(case).state_dict())


def test_a_pickled_model_is_the_same_and_can_still_be_changed() -> None:
    case = crane()
    again = pickle.loads(pickle.dumps(case.model))
    for model in (again, again.replace(n=case.model.n)):
        one, other = (m.transition([0.1, -0.1], [0.3, 0.1], [1.0]) for m in (case.model, model))
        assert all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("A", "a", "E", "R"))
    with pytest.raises(ValueError, match="read-only"):
        again.noise[0] = 0.0
    fixed = {"gravity": 9.8, "drag": (0.1, 0.3)}
    one, other = (m.replace(parameters=fixed).transition([0.1, -0.1], [0.3, 0.1], [1.0]) for m in (case.model, again))
    assert np.array_equal(one.R, other.R)
    z = {"x": [0.2, 0.1], "u": [1.0], "w": [0.0], "p": [9.8, 0.2]}
    assert again.f(**z) == pytest.approx(np.array(case.model.f(**{k: np.array(v) for k, v in z.items()})), rel=1e-12)
