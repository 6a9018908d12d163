"""The claims of `benchmarks.longer_windows` in short: a longer window is never wider at any sample."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.longer_windows import MEAN, RELATIVE, Found, examine


def check(family: str, plants: range, samples: int | None, every: int) -> Found:
    found = Found()
    for i in plants:
        found.add(examine(family, i, samples, every))
    assert found.failures == 0
    assert found.stopped == 0
    assert found.comparisons > 0
    assert found.worst <= RELATIVE
    return found


def test_a_longer_window_of_a_linear_plant_is_never_wider() -> None:
    """Plants of up to 8 states with windows up to 50 steps; the usual blocks cost less than 1 % in the mean."""
    growth = [g for i in (0, 1, 2, 4, 5) for g in check("small", range(i, i + 1), None, 8).growth]
    assert np.mean(growth) <= MEAN


@pytest.mark.slow
def test_40_more_plants() -> None:
    """Of up to 8 states, windows up to 50 steps (plants 6 to 45 of the family)."""
    assert np.mean(check("small", range(6, 46), None, 5).growth) <= MEAN


@pytest.mark.slow
@pytest.mark.parametrize(("family", "samples"), [("n20", 30), ("n50", 40), ("N200", 120)])
def test_large_plants_and_a_very_long_window(family: str, samples: int) -> None:
    """The beginning of the log of a plant of 20 states, of 50, and of one whose windows are up to 200 steps long."""
    check(family, range(1), samples, 10)
