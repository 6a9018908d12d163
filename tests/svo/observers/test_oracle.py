"""The oracle itself, against what can be computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from polytopes import HPolytope
from svo.logs.log import Log
from svo.models.model import UncertainModel, Uncertainty
from tests.svo.observers.oracle import FullInformation, box, margin, prefix


def log_of(y: list[float], u: list[float] | None = None) -> Log:
    inputs = np.zeros((len(y), 0)) if u is None else np.array(u)[:, None]
    return Log(time=np.arange(len(y), dtype=float), u=inputs, y=np.array(y)[:, None])


def one(*values: float) -> np.ndarray:
    return np.array(values)


def test_a_scalar_recursion() -> None:
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.2])
    log = log_of([0.0, 0.5, 0.3])
    low, high = -0.2, 0.2  # [-1, 1] and y(0) = 0 +- 0.2
    for y in (0.5, 0.3):
        low, high = max(low - 0.1, y - 0.2), min(high + 0.1, y + 0.2)
    found = box(model, log, one(-1.0), one(1.0))
    np.testing.assert_allclose([found.lower[0], found.upper[0]], [low, high], atol=1e-8)
    # y(1) - y(0) = 0.5 = 2 noises + one w of 0.1, so noises may shrink by nothing: the margin is 0.
    assert margin(model, log, one(-1.0), one(1.0)) == pytest.approx(0.0, abs=1e-8)
    assert margin(model, log_of([0.0, 0.7]), one(-1.0), one(1.0)) == pytest.approx(0.1)
    assert box(model, log_of([0.0, 0.7]), one(-1.0), one(1.0)).empty


def test_the_same_disturbance_in_state_and_output() -> None:
    # y(0) = x(0) + w(0) = 0 and x(1) = x(0) + w(0), so x(1) is known exactly.
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[1.0]], F=[[1.0]], w=[1.0])
    found = box(model, log_of([0.0, np.nan]), one(-5.0), one(5.0))
    np.testing.assert_allclose([found.lower[0], found.upper[0]], [0.0, 0.0], atol=1e-8)


def test_inputs_constants_and_feedthrough() -> None:
    model = UncertainModel([[0.5]], [[2.0]], [[1.0]], D=[[3.0]], a=[0.25], c=[-1.0], n=[0.01])
    x = one(1.0)
    y0, x1 = x + 3 * 0.5 - 1, 0.5 * x + 2 * 0.5 + 0.25
    y1 = x1 + 3 * 0.7 - 1
    found = box(model, log_of([y0[0], y1[0]], [0.5, 0.7]), one(-9.0), one(9.0))
    np.testing.assert_allclose([found.lower[0], found.upper[0]], [x1[0] - 0.005, x1[0] + 0.005], atol=1e-8)


def test_a_polytope_of_disturbances() -> None:
    triangle = HPolytope([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]], [0.0, 0.0, 1.0])
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[1.0, 1.0]], w=triangle, n=[9.0])
    found = box(model, log_of([0.0, 0.0]), one(0.0), one(0.0))
    np.testing.assert_allclose([found.lower[0], found.upper[0]], [0.0, 1.0], atol=1e-8)


def test_a_channel_of_either_sign() -> None:
    # x(1) = x + Delta x with Delta in [-0.5, 1]: from [-2, 1] to [-4, 2].
    model = UncertainModel([[1.0]], None, [[1.0]], n=[99.0], uncertainties=[Uncertainty(A=[[1.0]], bounds=(-0.5, 1.0))])
    log = log_of([0.0, 0.0])
    found = box(model, log, one(-2.0), one(1.0))
    np.testing.assert_allclose([found.lower[0], found.upper[0]], [-4.0, 2.0], atol=1e-8)
    positive = FullInformation(model, log, one(-2.0), one(1.0), signs=(1, 1))
    assert -positive.support(-one(1.0)) == pytest.approx(0.0, abs=1e-8)


def test_a_channel_of_the_input_alone() -> None:
    known = Uncertainty(B=[[1.0]], bounds=(0.0, 0.5))
    model = UncertainModel([[0.0]], [[1.0]], [[1.0]], n=[99.0], uncertainties=[known])
    found = box(model, log_of([0.0, 0.0], [-2.0, 0.0]), one(0.0), one(0.0))
    np.testing.assert_allclose([found.lower[0], found.upper[0]], [-3.0, -2.0], atol=1e-8)


def test_the_scalar_counterexample_of_the_vertex_stack_is_explained() -> None:
    model = UncertainModel([[1.0]], None, [[1.0]], n=[0.1], uncertainties=[Uncertainty(A=[[0.5]])])
    assert margin(model, log_of([1.0, 1.0, 1.0]), one(0.9), one(1.1)) < 0


@pytest.mark.parametrize("corners", [True, False])
def test_the_truth_is_inside(corners: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        shared = Uncertainty(A=np.outer(*rng.normal(size=(2, 2))) * 0.3, bounds=(-0.3, 1.0))
        model = UncertainModel(
            rng.normal(size=(2, 2)) * 0.5, rng.normal(size=(2, 1)), rng.normal(size=(1, 2)), E=np.eye(2), w=[0.1, 0.2],
            F=rng.normal(size=(1, 2)), n=[0.1], uncertainties=[shared],
        )  # fmt: skip
        x0 = rng.uniform(-1, 1, 2)
        log = model.simulate(x0, rng.normal(size=(4, 1)), rng, corners=corners)
        assert margin(model, log, -np.ones(2), np.ones(2)) <= 1e-9
        for K in (1, 4):
            found, truth = box(model, prefix(log, K), -np.ones(2), np.ones(2)), log.x[K - 1]
            assert (found.lower <= truth + 1e-9).all()
            assert (found.upper >= truth - 1e-9).all()
