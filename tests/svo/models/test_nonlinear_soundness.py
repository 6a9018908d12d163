"""Nonlinear plants of all kinds against an independent truth, in short; `python -m benchmarks.nonlinear` at length."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from benchmarks.enclosed_points import examine as examine_linearisation
from benchmarks.nonlinear import PLANTS, examine
from svo.functions import sign, sqrt
from svo.models.nonlinear import NonlinearModel
from tests.svo.models.linearised_points import OUTSIDE
from tests.svo.models.nonlinear_plants import CASES, cstr
from tests.svo.models.nonlinear_runs import MUST_NOT
from tests.svo.models.nonlinear_truth import advanced, called
from tests.svo.models.units import in_other_units

# Held and varying, exact and random intervals, other units: batch i as in `benchmarks.nonlinear`.
SHORT = [
    ("cstr", 2), ("servo", 1), ("bioreactor", 0), ("predator", 7), ("battery", 5), ("missile", 1),
    ("random map 21", 1), ("random 1", 1), ("random 7", 2), ("random 12", 3), ("random 17", 5),
]  # fmt: skip


def refuted(count: dict[str, int]) -> list[str]:
    """What must not happen and did, with the first place."""
    return [next((key for key in count if key.startswith(f"{what}: ")), what) for what in MUST_NOT if count.get(what)]


@pytest.mark.parametrize(("name", "batch"), SHORT)
def test_sets_verdicts_and_linearisations_hold_the_truth(name: str, batch: int) -> None:
    found = examine(name, batch, runs=2, samples=12)
    assert not refuted(found["count"])
    assert not found["count"].get("undecided in normal operation")
    assert found["count"]["samples"] == 24
    assert found["count"]["transitions"] == 22
    assert found["count"]["outputs"] == 24


def test_a_runaway_is_counted_apart_and_decided() -> None:
    found = examine("ignition", 1, runs=4, samples=40)["count"]
    assert found["runaway"] > 20
    assert not found.get("undecided in a runaway")
    assert not refuted(found)
    assert not found.get("undecided in normal operation")


def test_some_transition_uses_nearly_all_of_its_remainder() -> None:
    """Bounds that were far too wide would pass everything else."""
    assert examine("tank", 1, runs=1, samples=12)["closest"] > 0.9


def test_points_of_enclosures_are_in_the_linear_forms() -> None:
    total = sum((examine_linearisation(i, 1000)[1] for i in range(len(PLANTS))), Counter[str]())
    assert total["linearisations"] >= 0.9 * len(PLANTS)
    assert not sum(total[what] for what in OUTSIDE), total


@pytest.mark.parametrize("name", CASES)
def test_other_units_are_the_same_plant(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(5)
    other = in_other_units(case, rng)
    unit = other.spread / case.spread
    lower, upper = case.x0 - 0.1 * case.spread, case.x0 + 0.1 * case.spread
    one = case.model.transition(lower, upper, case.u(3))
    two = other.model.transition(lower * unit, upper * unit, other.u(3))
    assert two.R / unit == pytest.approx(one.R, rel=1e-6, abs=1e-11)
    assert two.A * unit / unit[:, None] == pytest.approx(one.A, rel=1e-9, abs=1e-12)


# -- the referee -------------------------------------------------------------------------------------


def test_the_truth_is_what_is_known_of_plants_that_can_be_solved() -> None:
    """A tank that runs out by a root, a mass that friction stops and holds, and equations of the user's own arrays."""
    tank = NonlinearModel(
        lambda h: [-2.0 * sqrt(h[0])], lambda h: h, states=["h"], physical=([0.0], [9.0]), Ts=0.5,
    )  # fmt: skip
    nothing = np.zeros((0, 2))
    end, error = advanced(tank, np.array([[4.0, 1.0]]), nothing, nothing, np.full(2, 0.5), np.full((1, 1), 1e-9))
    assert np.abs(end - [[2.25, 0.25]]).max() < 1e-8
    assert error.max() < 1e-6
    mass = NonlinearModel(
        lambda x: [x[1], -sign(x[1])], lambda x: x, states=["s", "v"], Ts=2.0, largest=([-9, -9], [9, 9])
    )
    end, _ = advanced(
        mass, np.array([[0.0, 0.0], [1.0, 3.0]]), nothing, nothing, np.full(2, 2.0), np.full((2, 1), 1e-6)
    )
    assert np.abs(end[:, 0] - [0.5, 0.0]).max() < 0.1  # where it slides, a 32nd of the sample
    assert np.abs(end[:, 1] - [4.0, 1.0]).max() < 1e-6
    f = called(cstr().model.f, cstr().model)
    x, w, u = np.array([[0.5], [350.0]]), np.array([[0.001], [0.1]]), np.array([[300.0]])
    assert f(x, w, u)[:, 0] == pytest.approx(cstr().model.flow.tape.values(np.concatenate([x, w, u])[:, 0]), rel=1e-12)
