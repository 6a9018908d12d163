"""Data of any memory layout, type, byte order and alignment, also read-only, are one to an observer."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, WindowObserver
from svo.observers.window.memory import Memory

PARTS: dict[str, Any] = {"A": [[1.0, 0.1], [0.0, 1.0]], "B": [[0.0], [0.1]], "E": [[0.0], [0.1]], "w": [0.2], "Ts": 0.1}
START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def forms(values: list[float]) -> dict[str, Any]:
    array = np.array(values)
    locked = array.copy()
    locked.setflags(write=False)
    shifted = np.zeros(8 * len(values) + 1, dtype=np.uint8)[1:].view(np.float64)
    shifted[:] = array
    return {
        "strided": np.repeat(array, 2)[::2],
        "backwards": np.array(values[::-1])[::-1],
        "a column": np.column_stack([array, array])[:, 0],
        "Fortran": np.asfortranarray(np.vstack([array, array]))[0],
        "read-only": locked,
        "single precision": array.astype(np.float32),
        "big-endian": array.astype(">f8"),
        "unaligned": shifted,
        "list": values,
    }


def observer_after_a_sample() -> WindowObserver:
    observer = WindowObserver(UncertainModel(**PARTS, C=np.eye(2), n=[0.05, 0.05]), START)
    observer.update(y0=[0.0, 0.0])
    return observer


@pytest.mark.parametrize("form", forms([0.0]))
def test_every_memory_layout_gives_the_same_bits(form: str) -> None:
    observer, plain = observer_after_a_sample(), observer_after_a_sample()
    step = observer.step(u=forms([0.5])[form], y=forms([0.0, 0.0625])[form])
    expected = plain.step(u=[0.5], y=[0.0, 0.0625])
    assert step.verdict == expected.verdict == "consistent"
    assert np.array_equal(step.box, expected.box)


def through_pickle(memory: Memory) -> Memory:
    copied: Memory = pickle.loads(pickle.dumps(memory))
    return copied


@pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy])
def test_a_copy_of_a_window_is_its_bytes_and_goes_on_by_itself(copied: Callable[[Memory], Memory]) -> None:
    observer, twin = observer_after_a_sample(), observer_after_a_sample()
    observer._window.memory = copied(observer._window.memory)
    assert observer._window.memory.address % 64 == 0
    for y in ([0.0, 0.05], [0.02, np.nan], [0.0, 0.1]):
        assert np.array_equal(observer.step([0.5], y).box, twin.step([0.5], y).box)
