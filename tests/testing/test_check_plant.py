"""Plants that keep every rule pass, and each broken one is caught by its own rule."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from docs.examples.heated_tank import HeatedTank
from polytopes import HPolytope
from svo import ArchitectureI, WindowObserver
from svo.isolation import Bank
from svo.plant import load_plant
from svo.plant.description import read_description
from svo.testing import PLANT_RULES, ConformanceError, PlantRuns, check_plant
from tests.svo.studies.isolation.registered.tank_plant import Tank, TankOfTwoBanks
from tests.testing.broken.first_breach import broken_rules
from tests.testing.broken.plants import BROKEN_PLANTS, EndsThePython, TooShort

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["eclipse", "elevator", pytest.param("missile", marks=pytest.mark.slow)])
def test_the_registered_plants_keep_every_rule(name: str) -> None:
    assert check_plant(load_plant(name)).kept == tuple(PLANT_RULES)


@pytest.mark.parametrize(
    "plant",
    [Tank(), TankOfTwoBanks(), TankOfTwoBanks(architecture="II"), TankOfTwoBanks(model_kind="nonlinear"), HeatedTank()],
)
def test_a_users_plant_keeps_every_rule(plant: Any) -> None:
    assert check_plant(plant).kept == tuple(PLANT_RULES)


@pytest.mark.parametrize("file", ["cart.toml", "servo.toml"])
def test_a_description_keeps_what_can_be_asked_without_a_simulator(file: str) -> None:
    found = check_plant(read_description(ROOT / "docs" / "examples" / file))
    assert found.kept == ("names", "fresh banks")
    assert set(found.left_out.values()) == {"the plant has no simulator"}


# What cannot hold either once a rule is broken: unexplained data falsify observers.
FOLLOWS = {
    "input of its sample": {"stated disturbances", "healthy bank", "own fault"},
    "stated noise": {"healthy bank", "own fault"},
    "channels": {"fault acts"},
}


@pytest.mark.parametrize("broken", BROKEN_PLANTS)
def test_a_broken_plant_is_caught_by_its_own_rule(broken: Any) -> None:
    own, found = BROKEN_PLANTS[broken], broken_rules(PLANT_RULES, PlantRuns(broken()))
    assert found[0] == own
    assert set(found) <= {own} | FOLLOWS.get(own, set())


@pytest.mark.parametrize(("rule", "changes"), [("stated noise", {"n": 1e-3}), ("stated disturbances", {"w": [1e-4]})])
def test_a_nonlinear_model_with_too_narrow_a_bound_is_caught_by_its_own_rule(rule: str, changes: Any) -> None:
    class TooNarrow(TankOfTwoBanks):
        def bank(self, noise: str) -> Bank:
            observers = super().bank(noise).observers
            models = {name: observer.model.replace(**changes) for name, observer in observers.items()}
            narrow = {name: WindowObserver(m, HPolytope.box([0.0], [3.0]), horizon=5) for name, m in models.items()}
            return ArchitectureI(narrow.pop("nominal"), narrow)

    found = broken_rules(PLANT_RULES, PlantRuns(TooNarrow(model_kind="nonlinear")))
    assert rule in found
    assert set(found) <= {rule, "healthy bank", "own fault"}


def test_a_simulator_that_ends_python_is_a_breach() -> None:
    with pytest.raises(ConformanceError, match="SystemExit"):
        check_plant(EndsThePython())


def test_a_fault_without_a_profile_is_named() -> None:
    with pytest.raises(ConformanceError, match=r"faults\['heater'\] has no profile"):
        check_plant(HeatedTank(faults={"heater": (), "thermometer": ()}))


def test_the_error_says_which_rule_what_was_seen_and_what_to_do() -> None:
    with pytest.raises(ConformanceError, match=r"'length' is broken: .*179 samples.*promises 180.*what to do: return"):
        check_plant(TooShort())


def test_the_page_lists_every_rule() -> None:
    page = (ROOT / "docs" / "write_a_plant.md").read_text(encoding="utf-8")
    rows = [f"| {rule.name} | {rule.says} | {rule.advice} |" for rule in PLANT_RULES.values()]
    assert "\n".join(rows) in page


@pytest.mark.parametrize(("wrong", "said"), [("tank", r"find_plant\('tank'\)"), (Tank, "which has"), (3, "is int")])
def test_what_is_no_plant_is_a_type_error(wrong: Any, said: str) -> None:
    with pytest.raises(TypeError, match=said):
        check_plant(wrong)
