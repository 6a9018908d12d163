"""A processor that does not round to nearest is refused before anything is computed with it."""

from __future__ import annotations

import ctypes
import platform
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, WindowObserver

MODES = {
    "x86_64": {"down": 0x400, "up": 0x800, "to zero": 0xC00},
    "aarch64": {"down": 0x800000, "up": 0x400000, "to zero": 0xC00000},
}.get(platform.machine(), {})
LIBRARY = ctypes.CDLL(None)


@pytest.fixture(params=MODES)
def mode(request: pytest.FixtureRequest) -> Iterator[int]:
    yield MODES[request.param]
    LIBRARY.fesetround(0)


def refused(ask: Callable[[], object]) -> None:
    with pytest.raises(FloatingPointError, match="round floats to nearest"):
        ask()


def test_sets_refuse_it(mode: int) -> None:
    P, box = HPolytope([[1.0, 2.0], [-1.0, 0.0], [0.0, -1.0]], [1.0, 0.0, 0.0]), HPolytope.box([0.0], [1.0])
    LIBRARY.fesetround(mode)
    refused(lambda: P.support([1.0, 1.0]))
    refused(lambda: box.support([1.0]))


def test_observers_refuse_it_at_every_sample_and_go_on_afterwards(mode: int) -> None:
    model = UncertainModel([[0.5]], [[1.0]], [[1.0]], n=[0.1])
    observer = WindowObserver(model, initial=HPolytope.box([-1.0], [1.0]))
    log = model.simulate([0.0], np.zeros((20, 1)), np.random.default_rng(0))
    LIBRARY.fesetround(mode)
    refused(lambda: observer.update(log.y[0]))
    refused(lambda: observer.run(log))
    LIBRARY.fesetround(0)
    observer.update(log.y[0])
    LIBRARY.fesetround(mode)
    refused(lambda: observer.step(log.u[0], log.y[1]))
    LIBRARY.fesetround(0)
    assert observer.step(log.u[0], log.y[1]).sample == 1
