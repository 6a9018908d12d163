"""Random plants whose set was lost: soon again as small as without a gap, or as small as any observer can make it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.gaps import after_loss


def test_fifty_random_plants_are_as_narrow_as_their_readings_allow() -> None:
    """10 + n samples after the return: at most 1.01 times the box without a gap, or that of all readings since."""
    found = after_loss(50)
    near = found.to_no_gap <= 1.01
    assert near.sum() >= 48
    assert (near | (found.to_all_since <= 1.01)).all()
    assert (found.outside, found.falsified) == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_three_hundred_plants(seed: int) -> None:
    """With N = 20 every one; windows of 10 steps have dropped the first readings: 1 in 100 is up to 5 % wider."""
    long, short = after_loss(300, 20, seed), after_loss(300, 10, seed)
    assert (np.minimum(long.to_no_gap, long.to_all_since) <= 1.01).all()
    least = np.minimum(short.to_no_gap, short.to_all_since)
    assert (least > 1.01).sum() <= 3
    assert least.max() <= 1.05
    for found in (long, short):
        assert (found.to_no_gap <= 1.01).sum() >= 285
        assert (found.outside, found.falsified) == (0, 0)
