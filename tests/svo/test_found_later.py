"""Faults that are known and not mended yet: each test states what is right, and fails as the mark says.

Marks are strict: whoever mends a point takes its mark away and moves the test to where it belongs. The letter in
front of each reason is the point of the list of faults found by use.
"""

from __future__ import annotations

import pytest

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


@later("C", FAILED, "Architecture I takes a fault that is called as its global model")
def test_no_fault_is_called_global() -> None:
    with pytest.raises(ValueError, match="global"):
        ArchitectureI(cart_observer(), {"global": cart_observer()})
