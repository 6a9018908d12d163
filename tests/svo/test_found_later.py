"""Faults that are known and not mended yet: each test states what is right, and fails as the mark says.

Marks are strict: whoever mends a point takes its mark away and moves the test to where it belongs. The letter in
front of each reason is the point of the list of faults found by use.
"""

from __future__ import annotations

import numpy as np
import pytest

import svo
from polytopes import HPolytope
from svo import ArchitectureI, UncertainModel, WindowObserver

FAILED = pytest.fail.Exception  # of pytest.raises


def later(point: str, raises: type[BaseException], why: str) -> pytest.MarkDecorator:
    return pytest.mark.xfail(strict=True, raises=raises, reason=f"{point}: {why}")


def cart() -> UncertainModel:
    return UncertainModel(
        [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]], E=[[0.0], [0.1]], w=[0.2], n=[0.05], Ts=0.1
    )


def cart_observer() -> WindowObserver:
    return WindowObserver(cart(), initial=HPolytope.box([-1.0, -1.0], [1.0, 1.0]))


# -- the face --------------------------------------------------------------------------------------------------------


@later("C", ValueError, "the fourth positional argument of a model is E, not D")
def test_what_follows_C_is_given_by_name() -> None:
    with pytest.raises(TypeError):
        UncertainModel([[1.0]], [[1.0]], [[1.0]], E=[[1.0]])


@later("C", AssertionError, "the main verbs are not to be had from Python")
@pytest.mark.parametrize("name", ["find_plant", "read_log", "detect", "verify"])
def test_the_main_verbs_are_functions_of_the_package(name: str) -> None:
    assert callable(getattr(svo, name, None))


@later("C", AttributeError, "a record does not say when its model was falsified")
def test_a_record_says_when_its_model_was_falsified() -> None:
    log = cart().simulate([0.0, 0.0], np.zeros((20, 1)), np.random.default_rng(0))
    log.y[10:] += 1.0
    assert cart_observer().run(log).falsified_at == 10


@later("C", AssertionError, "a record prints itself whole")
def test_a_record_prints_a_line() -> None:
    log = cart().simulate([0.0, 0.0], np.zeros((20, 1)), np.random.default_rng(0))
    assert len(repr(cart_observer().run(log))) < 400


@later("C", FAILED, "Architecture I takes a fault that is called as its global model")
def test_no_fault_is_called_global() -> None:
    with pytest.raises(ValueError, match="global"):
        ArchitectureI(cart_observer(), {"global": cart_observer()})
