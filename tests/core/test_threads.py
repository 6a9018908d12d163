"""A call of the core runs without Python's lock: the main thread goes on meanwhile. Nothing is timed."""

from __future__ import annotations

import ctypes
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from polytopes.native import PATH, Address, Integer, address, function
from svo import UncertainModel, WindowObserver
from svo.observers.window.log_samples import log_samples

KINDS = (Integer, Integer, *[Address] * 4)


@pytest.fixture(autouse=True)
def no_thread_is_interrupted() -> Iterator[None]:
    """Python's lock changes hands only where a thread gives it away."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    yield
    sys.setswitchinterval(before)


def loops_during(call: Callable[[], Any]) -> int:
    """How often the main thread came round while another one made a call."""
    count, seen = 0, []

    def other() -> None:
        seen.append(count)
        call()
        seen.append(count)

    thread = threading.Thread(target=other)
    thread.start()
    while thread.is_alive():
        count += 1
        time.sleep(0)  # gives the lock away, and takes it again
    thread.join()
    return seen[1] - seen[0]


def sums(entry: Any) -> Callable[[], Any]:
    """A call of some hundredths of a second."""
    n, qbar = 300_000, 100
    u, best, low, block = np.ones(n), np.zeros(qbar), np.zeros(qbar), np.empty(2 * (4096 + qbar))
    return lambda: entry(n, qbar, *(address(array) for array in (u, best, low, block)))


def samples() -> Callable[[], Any]:
    """A thousand samples through a window, in one call."""
    model = UncertainModel([[0.9, 0.1], [0.0, 0.8]], None, [[1.0, 0.0]], E=np.eye(2), w=[0.1, 0.1], n=[0.1], Ts=0.1)
    observer = WindowObserver(model, HPolytope.box([-1.0, -1.0], [1.0, 1.0]))
    log = model.simulate([0.0, 0.0], np.zeros((1000, 0)), np.random.default_rng(0))
    given = log_samples(observer._form, log, 0, len(log), False)
    assert given is not None

    def call() -> None:
        done, _ = observer._window.take_many(given, None)
        assert done == len(log)

    return call


def test_the_main_thread_goes_on_during_a_call() -> None:
    assert loops_during(sums(function("fdi_extreme_sums", *KINDS))) > 0


def test_the_main_thread_goes_on_while_a_window_takes_samples() -> None:
    assert loops_during(samples()) > 0


def test_a_call_with_the_lock_held_would_be_seen() -> None:
    entry = ctypes.PyDLL(str(PATH)).fdi_extreme_sums
    entry.argtypes, entry.restype = KINDS, None
    assert loops_during(sums(entry)) == 0
