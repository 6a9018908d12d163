"""Banks that are saved and go on bit for bit, and banks under a deadline."""

from __future__ import annotations

import io
from collections.abc import Callable
from itertools import islice
from time import perf_counter
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, ArchitectureII, WindowObserver
from svo.faults import ActuatorFault, FaultPair, Intermittent, SensorFault, Step, pairs
from svo.isolation.bank import Bank
from svo.isolation.record import Verdict
from svo.logs.drive import drive
from svo.logs.log import Log
from tests.svo.isolation.fake_observers import FakeObserver
from tests.svo.isolation.small_plant import START, TS, faults_of, fly, plant

X0 = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
PROFILES = [Step(START), Intermittent(START, 1.2)]


def models(profile: Any) -> tuple[Any, dict[str, Any]]:
    rng = np.random.default_rng(3)
    nominal = plant(rng)
    every = faults_of(rng, 2, profile)
    return nominal, {name: every[name] for name in ("bias", "loss")}


def first_bank(profile: Any, **options: Any) -> Bank:
    nominal, faults = models(profile)
    observers = {name: WindowObserver(fault.model(nominal), X0, horizon=4) for name, fault in faults.items()}
    return ArchitectureI(WindowObserver(nominal, X0, horizon=4), observers, **options)


def second_bank(profile: Any, **options: Any) -> Bank:
    nominal, faults = models(profile)
    observers = {name: WindowObserver(fault.model(nominal), X0, horizon=4) for name, fault in faults.items()}
    both = pairs(faults)["bias + loss"].model(nominal)
    return ArchitectureII(
        WindowObserver(nominal, X0, horizon=4),
        observers,
        WindowObserver(both, X0, horizon=4),
        class_one=("bias",),
        **options,
    )


def driven(bank: Bank, log: Log, start: int, stop: int, deadline: float | None = None) -> list[Any]:
    """Conclusions and boxes of each sample."""
    return [what(verdict) for verdict in islice(drive(bank, log, start=start, deadline=deadline), stop - start)]


def what(v: Verdict) -> Any:
    boxes = {}
    for name, step in v.steps.items():
        if name in v.alive and step.verdict != "falsified":
            boxes[name] = [end.tobytes() for end in step.box]
    return v.sample, v.state, v.fault, v.alive, v.detected_at, v.isolated_at, boxes


@pytest.mark.parametrize("build", [first_bank, second_bank])
@pytest.mark.parametrize("options", [{}, {"debounce": 2, "recovery": 4, "timeout": 9}])
def test_a_saved_bank_goes_on_bit_for_bit(build: Callable[..., Bank], options: dict[str, Any]) -> None:
    profile = Intermittent(START, 1.2)
    nominal, faults = models(profile)
    log = fly(nominal, faults["bias"], np.zeros(2), np.random.default_rng(5))
    log.y[13] += 50.0  # an outlier that nothing explains
    whole = driven(build(profile, **options), log, 0, len(log))
    states = {entry[1] for entry in whole}
    assert "detected" in states or "isolated" in states
    for cut in (1, 9, 11, 12, 13, 14, 15, 20, 33):
        bank = build(profile, **options)
        driven(bank, log, 0, cut)
        file = io.BytesIO()
        np.savez(file, **bank.state_dict())
        file.seek(0)
        again = build(profile, **options)
        with np.load(file, allow_pickle=False) as state:
            again.load_state_dict(state)
        assert driven(again, log, cut, len(log)) == whole[cut:]


def test_a_bank_that_has_not_started_can_be_saved() -> None:
    profile = Step(START)
    bank = first_bank(profile)
    again = first_bank(profile)
    again.load_state_dict(bank.state_dict())
    with pytest.raises(ValueError, match="before the first measurement"):
        again.step([0.0], [0.0, 0.0])


def test_the_state_of_another_bank_is_refused_and_changes_nothing() -> None:
    profile = Step(START)
    bank = first_bank(profile)
    bank.update([0.0, 0.0])
    observers = bank.observers
    for other in (second_bank(profile), first_bank(profile, debounce=2)):
        with pytest.raises(ValueError, match="state does not belong to this bank: it is of"):
            bank.load_state_dict(other.state_dict())
    broken = first_bank(profile).state_dict()
    del broken["observer.1.settings"]
    with pytest.raises(ValueError, match="state does not belong to this bank"):
        bank.load_state_dict(broken)
    assert bank.observers is observers
    bank.step([0.0], [0.0, 0.0], u_next=[0.0])


def test_an_observer_without_a_state_is_named() -> None:
    bank = ArchitectureI(FakeObserver(7.0), {"a": FakeObserver(8.0)})
    with pytest.raises(TypeError, match=r"observer 'nominal' \(FakeObserver\) has no state_dict"):
        bank.state_dict()


# -- deadlines ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("build", [first_bank, second_bank])
def test_no_deadline_makes_a_bank_wrong(build: Callable[..., Bank], profile: Any) -> None:
    nominal, faults = models(profile)
    for seed in range(3):
        log = fly(nominal, faults["bias"], np.zeros(2), np.random.default_rng(seed))
        assert log.x is not None
        for deadline in (1e-9, 1e-4):
            bank = build(profile)
            for k in range(len(log)):
                if k == 0:
                    verdict = bank.update(log.y[0], u=log.u[0])
                else:
                    verdict = bank.step(log.u[k - 1], log.y[k], u_next=log.u[k], deadline=deadline)
                assert "bias" in verdict.alive
                assert "nominal" in verdict.alive or k * TS >= START - 1e-9
                step = verdict.steps.get("bias")
                if step is not None and step.verdict != "falsified":
                    lower, upper = step.box
                    assert (lower <= log.x[k] + 1e-9).all()
                    assert (log.x[k] <= upper + 1e-9).all()


def test_a_long_deadline_changes_nothing_but_the_portions_of_the_programs() -> None:
    profile = Step(START)
    nominal, faults = models(profile)
    log = fly(nominal, faults["loss"], np.zeros(2), np.random.default_rng(1))
    free, timed = (driven(first_bank(profile), log, 0, len(log), deadline) for deadline in (None, 60.0))
    assert [entry[:6] for entry in free] == [entry[:6] for entry in timed]


class Clocked(FakeObserver):
    """Takes what it is told to, and notes the share that it was given."""

    takes_deadline = True

    def __init__(self, seconds: float) -> None:
        super().__init__(1e9)
        self.seconds, self.shares = seconds, list[float]()

    def _step(self, u: Any, y: Any, u_next: Any, schedule: Any, end: float | None) -> Any:
        assert end is not None
        self.shares.append(end - perf_counter())
        end = min(perf_counter() + self.seconds, end)
        while perf_counter() < end:
            pass
        return super()._step(u, y, u_next, schedule, end)


def test_each_observer_has_an_equal_share_of_what_is_left() -> None:
    quick, slow, last = Clocked(0.0), Clocked(1.0), Clocked(0.0)
    bank = ArchitectureI(quick, {"slow": slow, "last": last})
    bank.update([0.0])
    begun = perf_counter()
    bank.step([0.0], [0.0], deadline=0.06)
    assert perf_counter() - begun < 0.06 + 0.02
    assert quick.shares[0] == pytest.approx(0.02, abs=0.002)
    assert slow.shares[0] == pytest.approx(0.03, abs=0.003)  # what the first one left over is shared by two
    assert last.shares[0] <= 0.031


def test_an_observer_without_a_deadline_is_refused_by_name() -> None:
    bank = ArchitectureI(Clocked(0.0), {"leak": FakeObserver(8.0)})
    bank.update([0.0])
    with pytest.raises(ValueError, match=r"the step of observer 'leak' \(FakeObserver\) has none"):
        bank.step([0.0], [0.0], deadline=0.1)


@pytest.mark.parametrize("deadline", [0.0, -1.0, float("nan")])
def test_a_deadline_is_a_positive_time(deadline: float) -> None:
    bank = first_bank(Step(START))
    bank.update([0.0, 0.0])
    with pytest.raises(ValueError, match=r"deadline is .*; expected seconds > 0"):
        bank.step([0.0], [0.0, 0.0], u_next=[0.0], deadline=deadline)


# -- samples that an observer refuses ----------------------------------------------------------------------------


def test_a_sample_that_is_refused_half_way_cannot_be_given_again_by_mistake() -> None:
    # A reading that carries the input needs u(k+1), the others do not.
    nominal, faults = models(Step(START))
    both = FaultPair(loss(), scaling()).model(nominal).replace(D=[[0.1], [0.0]])
    chosen = {"bias": faults["bias"].model(nominal), "both": both}
    bank = ArchitectureI(WindowObserver(nominal, X0), {name: WindowObserver(m, X0) for name, m in chosen.items()})
    bank.update([0.0, 0.0], u=[0.1])
    before = bank.state_dict()
    with pytest.raises(ValueError, match=r"observer 'both': u_next is missing; expected shape \(1,\)"):
        bank.step([0.1], [0.0, 0.0])
    with pytest.raises(ValueError, match="'both' refused a sample that others had already seen"):
        bank.step([0.1], [0.0, 0.0], u_next=[0.1])
    bank.load_state_dict(before)
    assert bank.step([0.1], [0.0, 0.0], u_next=[0.1]).sample == 1


def test_a_sample_that_the_first_observer_refuses_can_be_given_again() -> None:
    bank = first_bank(Step(START))
    bank.update([0.0, 0.0])
    with pytest.raises(ValueError, match=r"observer 'nominal': y has shape \(3,\)"):
        bank.step([0.0], [0.0, 0.0, 0.0])
    assert bank.step([0.0], [0.0, 0.0]).sample == 1


def loss() -> ActuatorFault:
    return ActuatorFault(0, "loss", 0.7, Step(START))


def scaling() -> SensorFault:
    return SensorFault(0, "scaling", 0.2, Step(START))
