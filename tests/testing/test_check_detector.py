"""Detectors that keep every rule pass, and each broken one is caught by its own rule."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from svo.testing import DETECTOR_RULES, ConformanceError, check_detector
from tests.svo.studies.comparison.compared_plant import SmallPlant
from tests.testing.broken.detectors import BROKEN_DETECTORS, Redundancy

PLANT = SmallPlant()


@pytest.mark.parametrize("detector", [*PLANT.detectors("usual"), Redundancy()], ids=lambda detector: detector.name)
def test_the_detectors_of_a_comparison_keep_every_rule(detector: Any) -> None:
    found = check_detector(detector, PLANT)
    assert set(found.left_out) == ({"higher level", "critical level"} if detector.fixed else {"stated bounds"})


@pytest.mark.parametrize("broken", BROKEN_DETECTORS)
def test_a_broken_detector_is_caught_by_its_own_rule(broken: Any) -> None:
    with pytest.raises(ConformanceError, match="what to do") as caught:
        check_detector(broken(), PLANT)
    assert caught.value.rule == BROKEN_DETECTORS[broken]


def test_the_page_lists_every_rule() -> None:
    page = (Path(__file__).parents[2] / "docs" / "comparison.md").read_text(encoding="utf-8")
    rows = [f"| {rule.name} | {rule.says} | {rule.advice} |" for rule in DETECTOR_RULES.values()]
    assert "\n".join(rows) in page
