"""The outline of a set that the pictures draw."""

from __future__ import annotations

import numpy as np

from polytopes import HPolytope
from svo import UncertainModel, WindowObserver
from svo.study.exemplar import planar_outline


def test_the_outline_holds_the_truth_and_cuts_corners_of_the_box() -> None:
    cart = UncertainModel([[1, 0.1], [0, 1]], [[0], [0.1]], [[1, 0]], E=[[0], [0.1]], w=[0.2], n=[0.05], Ts=0.1)
    rng = np.random.default_rng(3)
    log = cart.simulate([0.1, 0.0], np.ones((30, 1)), rng, corners=True)
    observer = WindowObserver(cart, HPolytope.box([-1, -1], [1, 1]))
    assert log.x is not None
    step = observer.update(log.y[0])
    for k in range(1, len(log)):
        step = observer.step(log.u[k - 1], log.y[k])
        outline = planar_outline(step)
        assert outline.contains(log.x[k], tol=1e-9)
    assert outline.volume() < 0.8 * step.set.volume()


def test_the_outline_of_a_scalar_state_is_its_interval() -> None:
    model = UncertainModel([[0.9]], None, [[1.0]], n=[0.1])
    step = WindowObserver(model, HPolytope.box([-1.0], [1.0])).update([0.5])
    np.testing.assert_allclose(planar_outline(step).bounding_box(), step.box, atol=1e-12)
