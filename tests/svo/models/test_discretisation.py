"""What a first-order discretisation of an uncertain plant leaves out, and the bound of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from svo import UncertainModel, Uncertainty
from svo.models.remainder import remainder_bound


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 0.5))
def test_the_computed_remainder_holds_what_is_left_out(seed: int, Ts: float) -> None:
    """Against the exponential of the very plant, over a sample in which Delta, u and w are held."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    A, B, E, a = rng.normal(size=(n, n)), rng.normal(size=(n, 2)), rng.normal(size=(n, 1)), rng.normal(size=n)
    items = [
        Uncertainty(A=rng.normal(size=(n, n)), B=rng.normal(size=(n, 2)), bounds=(-0.5, 1.5)),
        Uncertainty(A=rng.normal(size=(n, n)), a=rng.normal(size=n), E=rng.normal(size=(n, 1)), bounds=(-0.2, 0.1)),
    ]
    delta = [float(rng.choice(item.bounds)) for item in items]
    x, u, w = rng.normal(size=n), rng.normal(size=2), rng.choice([-0.5, 0.5], 1)
    true = {
        name: np.asarray(given) + sum(d * np.asarray(getattr(item, name)) for d, item in zip(delta, items, strict=True)
                                      if getattr(item, name) is not None)
        for name, given in (("A", A), ("B", B), ("E", E), ("a", a))
    }  # fmt: skip
    held = true["B"] @ u + true["E"] @ w + true["a"]
    way = np.array([_held(true["A"], held, x, t) for t in np.linspace(0.0, Ts, 51)])
    bounds = {"x": 1.001 * np.abs(way).max(axis=0), "u": np.abs(u), "w": [0.5]}
    width = remainder_bound(A, B, Ts=Ts, E=E, a=a, uncertainties=items, **bounds)  # type: ignore[arg-type]
    model = UncertainModel.from_continuous(
        A, B, np.eye(n), Ts=Ts, E=E, a=a, w=[0.5], uncertainties=items, remainder=width
    )
    ours = model.block("A") @ x + model.block("B") @ u + model.block("a") + model.block("E")[:, :1] @ w
    for i, d in enumerate(delta):
        parts = {name: model.block(name, uncertainty=i) for name in "ABaE"}
        ours += d * (parts["A"] @ x + parts["B"] @ u + parts["a"] + parts["E"][:, :1] @ w)
    assert (np.abs(way[-1] - ours) <= width).all()


def _held(A: np.ndarray, rate: np.ndarray, x: np.ndarray, t: float) -> np.ndarray:
    n = len(x)
    joint = expm(np.block([[A, rate[:, None]], [np.zeros((1, n + 1))]]) * t)
    return np.asarray(joint[:n, :n] @ x + joint[:n, n])


def test_the_computed_remainder_is_attained_to_first_order() -> None:
    """x' = u + Delta x, u = 1 from x = 0: what is left out is Delta Ts^2 / 2 for short samples."""
    item = Uncertainty(A=[[1.0]], bounds=(-0.1, 0.1))
    bound = remainder_bound([[0.0]], [[1.0]], Ts=1e-3, x=[1e-3], u=[1.0], uncertainties=[item])
    np.testing.assert_allclose(bound, [0.1 * 1e-6 / 2], rtol=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"A": np.ones((1, 2))}, r"A has shape \(1, 2\); expected a square"),
        ({"Ts": -0.1}, "Ts is -0.1; expected a positive sampling time"),
        ({"x": [1.0, 2.0]}, r"x is .*; expected the largest absolute values, shape \(1,\)"),
        ({"u": [-1.0]}, "u is .*; expected the largest absolute values"),
        ({"u": None}, r"u is \[\]; expected the largest absolute values, shape \(1,\)"),
        ({"E": [[1.0]]}, "w is missing: E or F has 1 columns"),
        ({"uncertainties": [Uncertainty(A=lambda s: [[s]])]}, "A of an uncertainty is a function"),
        ({"uncertainties": [Uncertainty(A=np.eye(2), name="q")]}, r"A of uncertainty q has shape \(2, 2\)"),
    ],
)
def test_mistakes_about_the_remainder_are_named(changes: dict[str, Any], message: str) -> None:
    right = {"A": [[1.0]], "B": [[1.0]], "Ts": 0.1, "x": [1.0], "u": [1.0], "uncertainties": [Uncertainty(A=[[1.0]])]}
    with pytest.raises(ValueError, match=message):
        remainder_bound(**right | changes)
