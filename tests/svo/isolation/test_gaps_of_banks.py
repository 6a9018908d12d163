"""Banks through long gaps in the measurements: what is lost is undecided, and alive."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ArchitectureII,
    ConstrainedZonotopeObserver,
    PolytopeObserver,
    UncertainModel,
    Uncertainty,
    WindowObserver,
)
from svo.isolation.bank import Sample
from tests.svo.observers.gap_plants import start

NOTHING = [np.nan]


def plant(rate: float, w: float = 0.1, **changes: Any) -> UncertainModel:
    return UncertainModel([[rate]], [[1.0]], [[1.0]], E=[[1.0]], w=[w], n=0.05, **changes)


def faster(rate: float, **changes: Any) -> UncertainModel:
    """A fault that may raise the rate of `plant(0.5)` up to a larger one, at each sample anew."""
    middle, half = (0.5 + rate) / 2.0, (rate - 0.5) / 2.0
    return plant(middle, uncertainties=[Uncertainty(A=[[half]])], **changes)


def chain(rate: float, **changes: Any) -> UncertainModel:
    """Two states that one reading does not tell."""
    A = [[rate, 1.0], [0.0, rate]]
    return UncertainModel(A, [[0.0], [1.0]], [[1.0, 0.0]], E=np.eye(2), w=[0.1, 0.1], n=0.05, **changes)


def observers(kind: Any, nominal: UncertainModel, fault: UncertainModel) -> tuple[Any, dict[str, Any]]:
    return kind(nominal, start(nominal)), {"pushed": kind(fault, start(fault))}


@pytest.mark.parametrize("kind", [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver])
def test_a_bank_lives_through_a_gap_in_which_every_set_is_lost(kind: Any) -> None:
    bank = ArchitectureI(*observers(kind, plant(2.0), plant(2.0, w=2.0)))
    bank.update(NOTHING)
    for _ in range(115):
        verdict = bank.step([0.0], NOTHING)
        assert verdict.state == "nominal"
        assert all(not np.isnan(step.box).any() for step in verdict.steps.values())
    assert {(step.verdict, step.reason) for step in verdict.steps.values()} == {("undecided", "outgrown")}
    x = 0.3
    for _ in range(4):
        verdict = bank.step([0.0], [x])
        x *= 2.0
    assert verdict.alive == ("nominal", "pushed")
    assert {step.verdict for step in verdict.steps.values()} == {"consistent"}
    for _ in range(2):  # the fault begins
        x += 1.5
        verdict = bank.step([0.0], [x])
        x *= 2.0
    assert (verdict.state, verdict.fault) == ("isolated", "pushed")
    assert verdict.steps["pushed"].verdict == "consistent"


def test_an_observer_that_starts_again_beside_a_lost_one_has_no_set_either() -> None:
    """The nominal one, stable, is falsified while the other's set is lost: the hull of the survivors is everything."""
    fault = chain(1.25, uncertainties=[Uncertainty(A=0.75 * np.eye(2))])
    bank = ArchitectureI(*observers(WindowObserver, chain(0.5), fault), debounce=2)
    bank.update(NOTHING)
    for _ in range(115):
        bank.step([0.0], NOTHING)
    verdict = bank.step([0.0], [1e6])
    assert verdict.steps["nominal"].verdict == "falsified"
    assert verdict.steps["pushed"].reason == "outgrown"
    assert verdict.state == "nominal"  # debounced
    saved = bank.state_dict()
    bank.load_state_dict(saved)
    verdict = bank.step([0.0], [2e6])
    assert verdict.steps["nominal"].reason == "outgrown"
    assert verdict.steps["pushed"].verdict == "consistent"
    for k in range(2, 5):
        verdict = bank.step([0.0], [2.0**k * 1e6])
    assert (verdict.state, verdict.fault) == ("isolated", "pushed")


def test_the_largest_set_is_where_a_bank_starts_again_that_has_no_set_yet() -> None:
    """The first measurement falsifies every model."""
    without = ArchitectureI(*observers(WindowObserver, plant(0.5), faster(0.6)), debounce=2)
    assert without.update([1e6]).state == "unexplained"
    nominal, fault = plant(0.5, largest=(-5.0, 5.0)), faster(0.6, largest=(-5.0, 5.0))
    bank = ArchitectureI(*observers(WindowObserver, nominal, fault), debounce=2)
    assert bank.update([1e6]).state == "nominal"
    verdict = bank.step([0.0], [1.0])
    assert verdict.steps["nominal"].verdict == "consistent"
    assert bank.observers["nominal"].largest_at == 0  # type: ignore[attr-defined]


def test_the_premise_of_a_survivor_goes_over_to_who_starts_from_its_set() -> None:
    nominal, fault = plant(0.5), faster(2.2, largest=(-5.0, 5.0))
    bank = ArchitectureI(*observers(WindowObserver, nominal, fault), debounce=2)
    bank.update(NOTHING)
    k = 0
    while bank.observers["pushed"].largest_at is None:  # type: ignore[attr-defined]
        verdict, k = bank.step([0.0], NOTHING), k + 1
    since = k
    for _ in range(3):
        verdict, k = bank.step([0.0], NOTHING), k + 1
    verdict, k = bank.step([0.0], [30.0]), k + 1
    assert verdict.steps["nominal"].verdict == "falsified"
    saved = bank.state_dict()
    bank.load_state_dict(saved)
    own: Any = bank.observers["nominal"]
    assert own.largest_at == since - k
    verdict = bank.step([0.0], [66.0])
    certificate = verdict.steps["nominal"].certificate
    assert certificate is not None
    assert k + 1 - certificate.last + certificate.largest_at == since


@pytest.mark.parametrize("promised", [False, True])
def test_faults_of_class_two_start_where_the_global_set_is_lost(promised: bool) -> None:
    ranges = {"largest": (-1e7, 1e7)} if promised else {}
    nominal, fault, every = plant(0.5), plant(2.0, **ranges), plant(2.2, **ranges)
    bank = ArchitectureII(
        WindowObserver(nominal, start(nominal)),
        {"fast": WindowObserver(fault, start(fault)), "faster": WindowObserver(plant(3.0), start(fault))},
        WindowObserver(every, start(every)),
    )
    bank.update(NOTHING)
    for _ in range(110):
        verdict = bank.step([0.0], NOTHING)
    y, states = 1e6, []
    for _ in range(6):
        verdict = bank.step([0.0], [y])
        states.append(verdict.state)
        y *= 2.0
    assert states[0] == "detected"
    assert bank.state_dict()


def test_a_hull_outside_the_physical_range_of_who_starts_again_is_no_error() -> None:
    nominal = plant(0.5, physical=(-np.inf, 1e3))
    bank = ArchitectureI(*observers(WindowObserver, nominal, faster(2.0)), debounce=2)
    step = bank._start_from("nominal", HPolytope.box([1e4], [2e4]), Sample(None, NOTHING, [0.0], None))
    assert (step.verdict, step.reason) == ("undecided", "outgrown")
    assert step.box[1] == 1e3


def test_global_sets_stay_bounded_sets() -> None:
    from svo.isolation.architectures import _bounded

    assert _bounded(HPolytope.whole_space(2)) is None
    assert _bounded(HPolytope.box([-1.0], [1.0])) is not None
