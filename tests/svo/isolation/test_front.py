"""Where an observer of a bank stands in a log: its answers in portions, each with its own sample."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, WindowObserver
from svo.isolation.front import Front
from svo.observers.base import Seen

MODEL = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=[0.1])
STEP = WindowObserver(MODEL, HPolytope.box([-1.0], [1.0])).update([0.0])


def test_answers_that_came_at_once_are_taken_in_portions() -> None:
    first, then = replace(STEP, sample=4), replace(STEP, sample=5, verdict="undecided")
    front = Front("drive", iter([Seen(5, first), Seen(1, then)]))
    assert front.plain() == 5
    assert front.take(2).sample == 1
    assert front.plain() == 3
    assert front.take(3) is first
    assert front.plain() == 0
    assert front.take(1) is then


def test_an_error_names_the_observer() -> None:
    def refusing() -> Iterator[Seen]:
        raise ValueError("y is bad")
        yield

    with pytest.raises(ValueError, match="observer 'drive': y is bad"):
        Front("drive", refusing()).plain()


def test_the_samples_of_a_portion_are_counted_from_the_start_of_the_log() -> None:
    log = MODEL.simulate([0.0], np.zeros((40, 1)), np.random.default_rng(0))
    front = Front("drive", WindowObserver(MODEL, HPolytope.box([-1.0], [1.0])).follow(log))
    samples = []
    while len(samples) < len(log):
        assert front.plain() > 0
        samples.append(front.take(1).sample)
    assert samples == list(range(40))
