"""From a model in continuous time: what is exact, and what the first order leaves out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo.models.discretisation import zero_order_hold
from svo.models.model import UncertainModel, Uncertainty

seeds = st.integers(0, 2**32 - 1)


def flow(A: np.ndarray, rate: np.ndarray, x: np.ndarray, Ts: float, steps: int = 400) -> np.ndarray:
    """dx/dt = A x + rate by the classical Runge-Kutta method."""
    h = Ts / steps
    for _ in range(steps):
        k1 = A @ x + rate
        k2 = A @ (x + h / 2 * k1) + rate
        k3 = A @ (x + h / 2 * k2) + rate
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + A @ (x + h * k3) + rate)
    return x


@settings(max_examples=15, deadline=None)
@given(seeds)
def test_a_continuous_model_is_discretised_exactly(seed: int) -> None:
    rng, Ts = np.random.default_rng(seed), 0.2
    A, B, a, E, C = (rng.normal(size=shape) for shape in ((3, 3), (3, 2), 3, (3, 4), (2, 3)))
    if rng.random() < 0.3:
        A[:, 0] = 0.0  # singular
    model = UncertainModel.from_continuous(A, B, C, Ts=Ts, E=E, a=a, w=np.ones(4))
    x, u, w = rng.normal(size=3), rng.normal(size=2), rng.normal(size=4)
    ours = model.block("A") @ x + model.block("B") @ u + model.block("a") + model.block("E") @ w
    np.testing.assert_allclose(ours, flow(A, B @ u + a + E @ w, x, Ts), rtol=1e-9, atol=1e-9)
    two_steps = zero_order_hold(A, B, 2 * Ts)[0]
    np.testing.assert_allclose(two_steps, model.block("A") @ model.block("A"), rtol=1e-9, atol=1e-12)


def test_what_the_first_order_leaves_out_is_within_the_remainder() -> None:
    A, change, Ts = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.0, 0.0], [-0.1, 0.0]]), 0.01
    remainder = [3e-6, 6e-6]
    model = UncertainModel.from_continuous(
        A, None, np.eye(2), Ts=Ts, E=[[0.0], [1.0]], w=([-0.5], [0.25]), F=[[1.0], [0.0]], remainder=remainder,
        uncertainties=[Uncertainty(A=change, c=[1.0, 0.0])],
    )  # fmt: skip
    lower, upper, _ = model.bounds()
    assert (lower.tolist(), upper.tolist()) == ([-0.5, -3e-6, -6e-6], [0.25, 3e-6, 6e-6])
    np.testing.assert_array_equal(model.block("E")[:, 1:], np.eye(2))
    np.testing.assert_array_equal(model.block("F"), [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(model.block("c", uncertainty=0), [1.0, 0.0])
    for delta in (-1.0, 0.3, 1.0):
        x = np.array([1.0, -1.0])
        ours = (model.block("A") + delta * model.block("A", uncertainty=0)) @ x
        error = np.abs(ours - flow(A + delta * change, np.zeros(2), x, Ts))
        assert (error <= remainder).all()
        assert error.max() > 1e-7


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"A": np.ones((2, 3))}, r"A has shape \(2, 3\); expected a square"),
        ({"A": 1.0}, r"A has shape \(\)"),
        ({"B": np.ones((1, 2))}, r"B has shape \(1, 2\); expected \(2, columns\)"),
        ({"a": np.ones((2, 1))}, r"a has shape \(2, 1\); expected \(2,\)"),
        ({"E": [[np.nan], [0.0]]}, "E contains NaN"),
        ({"uncertainties": [Uncertainty(A=np.eye(2))]}, r"remainder is missing: give the bound \(2,\)"),
        (
            {"uncertainties": [Uncertainty(A=np.eye(3), name="q")], "remainder": 0.1},
            r"A of uncertainty q has shape \(3, 3\)",
        ),
        ({"uncertainties": [Uncertainty(A=lambda s: s)], "remainder": 0.1}, "A of an uncertainty is a function"),
        ({"remainder": [0.1, -0.1]}, "remainder is"),
        ({"remainder": [0.1]}, r"remainder is .*expected bounds >= 0 of shape \(2,\)"),
        ({"E": [[1.0], [0.0]], "remainder": 0.1}, "w is missing: E or F has 1 columns"),
        ({"E": [[1.0], [0.0]], "w": HPolytope.box([0.0], [1.0]), "remainder": 0.1}, "w is a polytope or a function"),
        ({"E": [[1.0], [0.0]], "w": [1.0, 2.0], "remainder": 0.1}, r"w has bounds of shapes \(2,\)"),
    ],
)
def test_mistakes_in_continuous_time_are_named(changes: dict[str, Any], message: str) -> None:
    given_arrays: dict[str, Any] = {"A": np.eye(2), "B": None, "C": np.eye(2), "Ts": 0.1}
    with pytest.raises(ValueError, match=message):
        UncertainModel.from_continuous(**given_arrays | changes)
