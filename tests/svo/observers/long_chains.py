"""Proofs that go the long way, which most alarms need not: from the first set, by windows that slide."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from svo.observers.window import prover


@contextmanager
def long_chains() -> Iterator[None]:
    """No chain begins nearer than at the first set, and windows are of a few samples: with bounds of states."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("_FARTHEST", 0), ("_WHOLE", 2), ("_HORIZON", 2), ("_STRIDE", 1)):
            patch.setattr(prover, name, value)
        yield
