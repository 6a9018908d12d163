"""The core against 500 answers of the Numba kernels that it replaced (``python -m tests.oracle record`` wrote them)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.oracle.cases import KINDS, Answers
from tests.oracle.comparison import difference


def recorded() -> dict[tuple[str, int], Answers]:
    found: dict[tuple[str, int], Answers] = {}
    with np.load(Path(__file__).with_name("answers.npz"), allow_pickle=False) as arrays:
        for path, value in arrays.items():
            kind, seed, name = path.split("/")
            found.setdefault((kind, int(seed)), {})[name] = value
    return found


ANSWERS = recorded()


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["program", "chain", "polytope"])
def test_every_answer_is_the_same_or_narrower(kind: str, every: int) -> None:
    keys = [key for key in ANSWERS if key[0] == kind][::every]
    assert len(keys) >= 100 // every
    found = {key: difference(kind, ANSWERS[key], KINDS[kind](key[1])) for key in keys}
    assert {key: d for key, d in found.items() if d.what is not None} == {}
