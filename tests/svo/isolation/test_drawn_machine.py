"""The state machine that the documentation draws is the one that runs: every transition drawn happens, and no other."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from svo.isolation.global_logic import GlobalLogic
from svo.isolation.logic import GLOBAL, NOMINAL, IsolationLogic

DRAWING = Path(__file__).parents[3] / "docs" / "images" / "states.dot"
NAMES = (NOMINAL, "a", "b", "c")
OPTIONS = [
    {"debounce": debounce, "recovery": recovery, "timeout": timeout}
    for debounce, recovery, timeout in itertools.product((1, 2), (None, 2), (None, 3))
]


def drawn() -> set[tuple[str, str]]:
    """Arrows of the picture from state to state; the one without a label only says where a bank starts."""
    return set(re.findall(r"(\w+) -> (\w+) \[label=", DRAWING.read_text(encoding="utf-8")))


def seen(logic: IsolationLogic, runs: int) -> set[tuple[str, str]]:
    """Changes of state in random runs: of each observer that runs, and which fall at a sample."""
    rng = np.random.default_rng(0)
    found = set()
    for _ in range(runs):
        state, chance = logic.initial(), rng.choice([0.1, 0.4, 0.8], size=len(NAMES) + 1)
        for k in range(12):
            if rng.random() < 0.2:
                chance = rng.choice([0.0, 0.3, 0.9], size=len(NAMES) + 1)
            likely = [n for n, p in zip((*NAMES, GLOBAL), chance, strict=True) if rng.random() < p]
            falls = [name for name in likely if name in state.running]
            after = logic.advance(state, k, falls)
            if after.state != state.state:
                found.add((state.state, after.state))
            state = after
    return found


@pytest.mark.parametrize("two", [False, True])
def test_every_transition_that_is_drawn_happens_and_no_other(two: bool) -> None:
    found = set()
    for options in OPTIONS:
        logic = GlobalLogic(NAMES, class_two=("c",)) if two else IsolationLogic(NAMES)
        found |= seen(replace(logic, **options), 100)  # type: ignore[arg-type]
    assert found == drawn()


def test_without_options_a_declared_falsification_is_final() -> None:
    for logic in (IsolationLogic(NAMES), GlobalLogic(NAMES, class_two=("b",))):
        assert not {change for change in seen(logic, 300) if "nominal" in change[1:] or change[0] == "unexplained"}
