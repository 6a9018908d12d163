"""Plants that keep every rule pass, and each broken one is caught by its own rule."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from docs.examples.heated_tank import HeatedTank
from svo.plant import load_plant
from svo.plant.description import read_description
from svo.testing import PLANT_RULES, ConformanceError, check_plant
from svo.testing.plant_runs import PlantRuns
from tests.svo.studies.isolation.registered.tank_plant import Tank, TankOfTwoBanks
from tests.testing.broken.plants import BROKEN_PLANTS

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["eclipse", "elevator", "missile"])
def test_the_registered_plants_keep_every_rule(name: str) -> None:
    assert check_plant(load_plant(name)).kept == tuple(PLANT_RULES)


@pytest.mark.parametrize("plant", [Tank(), TankOfTwoBanks(), TankOfTwoBanks(architecture="II"), HeatedTank()])
def test_a_users_plant_keeps_every_rule(plant: Any) -> None:
    assert check_plant(plant).kept == tuple(PLANT_RULES)


@pytest.mark.parametrize("file", ["cart.toml", "servo.toml"])
def test_a_description_keeps_what_can_be_asked_without_a_simulator(file: str) -> None:
    found = check_plant(read_description(ROOT / "docs" / "examples" / file))
    assert found.kept == ("names", "fresh banks")
    assert set(found.left_out.values()) == {"the plant has no simulator"}


@pytest.mark.parametrize("broken", BROKEN_PLANTS)
def test_a_broken_plant_is_caught_by_its_own_rule(broken: Any) -> None:
    with pytest.raises(ConformanceError, match="what to do") as caught:
        check_plant(broken())
    assert caught.value.rule == BROKEN_PLANTS[broken]


@pytest.mark.parametrize("broken", BROKEN_PLANTS)
def test_a_broken_plant_breaks_no_rule_that_has_nothing_to_do_with_it(broken: Any) -> None:
    runs = PlantRuns(broken())
    assert broken_rules(runs) <= {BROKEN_PLANTS[broken], *FOLLOWS.get(BROKEN_PLANTS[broken], ())}


# What cannot hold either once a rule is broken: unexplained data falsify observers.
FOLLOWS = {
    "input of its sample": ("stated disturbances", "healthy bank", "own fault"),
    "stated noise": ("healthy bank", "own fault"),
}


def broken_rules(runs: PlantRuns) -> set[str]:
    broken = set()
    for name, rule in PLANT_RULES.items():
        try:
            rule.check(runs)
        except ConformanceError:
            broken.add(name)
    return broken


def test_the_page_lists_every_rule() -> None:
    page = (ROOT / "docs" / "write_a_plant.md").read_text(encoding="utf-8")
    rows = [f"| {rule.name} | {rule.says} | {rule.advice} |" for rule in PLANT_RULES.values()]
    assert "\n".join(rows) in page
