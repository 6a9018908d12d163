"""A few cases of every fuzzer, in this process; ``python -m tests.fuzz`` runs as many as one likes."""

from __future__ import annotations

import pytest

from tests.fuzz.kinds import KINDS
from tests.fuzz.workers import try_case

SLOW = ("commands", "study folders", "options")


@pytest.mark.parametrize("kind", KINDS)
def test_a_few_cases(kind: str) -> None:
    count = 2 if kind in SLOW else 25
    assert [(seed, failure) for seed in range(count) if (failure := try_case(kind, seed)) is not None] == []
