"""Bounds of the state by readings alone."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from svo import UncertainModel, Uncertainty
from svo.observers.free_start import Reading, state_bounds


def draw(rng: np.random.Generator) -> tuple[UncertainModel, list[Reading], np.ndarray]:
    n, ny, nw = (int(rng.integers(low, 4)) for low in (1, 1, 0))
    A = rng.normal(size=(n, n))
    A *= rng.uniform(0.5, 1.2) / max(np.abs(np.linalg.eigvals(A)).max(), 0.1)
    E = rng.normal(size=(n, nw)) if nw else None
    uncertainties = [
        Uncertainty(
            A=0.03 * rng.normal(size=(n, n)), C=0.02 * rng.normal(size=(ny, n)), c=0.1 * rng.normal(size=ny),
            E=None if E is None else 0.1 * E, bounds=tuple(np.sort(rng.uniform(-1.0, 1.0, 2))),
        )
        for _ in range(rng.integers(0, 3))
    ]  # fmt: skip
    model = UncertainModel(
        A, rng.normal(size=(n, 1)), rng.normal(size=(ny, n)), E=E, w=(-np.ones(nw), 2.0 * np.ones(nw)) if nw else None,
        F=rng.normal(size=(ny, nw)) if nw and rng.random() < 0.5 else None, n=0.1 * rng.random(ny),
        a=rng.normal(size=n), c=rng.normal(size=ny), uncertainties=uncertainties,
    )  # fmt: skip
    samples = n + 4
    x0 = rng.normal(size=n) * 10.0 ** rng.uniform(0.0, 4.0)
    log = model.simulate(x0, rng.normal(size=(samples, 1)), rng, corners=bool(rng.random() < 0.7))
    y = log.y.copy()
    y[rng.random(y.shape) < 0.2] = np.nan
    lower, upper, noise = model.bounds()
    readings = [Reading(model.stack(), log.u[k], y[k], noise, np.zeros(ny), lower, upper) for k in range(samples)]
    return model, readings, x0


def delta_of(model: UncertainModel) -> np.ndarray:
    return np.array([u.bounds for u in model.uncertainties]).reshape(-1, 2)


@pytest.mark.parametrize("seed", range(4))
def test_the_state_is_inside_wherever_it_is(seed: int) -> None:
    """No set is known before: the first state is anywhere up to 1e4."""
    rng, found = np.random.default_rng(seed), 0
    for _ in range(40):
        model, readings, x0 = draw(rng)
        bounds = state_bounds(readings, delta_of(model), 1e-9)
        if bounds is not None:
            found += 1
            assert (bounds[0] <= x0).all()
            assert (x0 <= bounds[1]).all()
    assert found >= 20


def test_a_small_system_by_hand_in_rationals() -> None:
    """x+ = x + w, y = x + v: two readings average to x within the noise and the disturbance of one."""
    stack = np.array([[[1.0, 0.0, 1.0], [1.0, 0.0, 0.0]]])
    nothing, noise = np.zeros(0), np.array([0.25])
    w = np.array([-0.5]), np.array([0.5])
    one = Reading(stack, nothing, np.array([1.0]), noise, np.zeros(1), *w)
    lower, upper = state_bounds([one], np.zeros((0, 2)), 0.0) or (None, None)
    assert lower is not None
    assert upper is not None
    assert Fraction(float(lower[0])) <= Fraction(3, 4)
    assert Fraction(float(upper[0])) >= Fraction(5, 4)
    assert upper[0] - lower[0] == pytest.approx(0.5, rel=1e-12)


def test_an_uncertainty_that_hides_the_state_gives_no_bound() -> None:
    """y = Delta x says nothing of |x|."""
    stack = np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]]])
    reading = Reading(stack, np.zeros(0), np.ones(1), np.zeros(1), np.zeros(1), np.zeros(0), np.zeros(0))
    assert state_bounds([reading] * 3, np.array([[-1.0, 1.0]]), 0.0) is None
    # with Delta in [0.5, 1.5] it does: x is between 2/3 and 2
    lower, upper = state_bounds([reading], np.array([[0.5, 1.5]]), 0.0) or (np.zeros(1), np.zeros(1))
    assert lower[0] <= 2.0 / 3.0
    assert upper[0] >= 2.0


def test_a_state_that_no_sensor_sees_gives_no_bound() -> None:
    stack = np.array([[[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [1.0, 0.0, 0.0]]])
    reading = Reading(stack, np.zeros(0), np.ones(1), np.ones(1), np.zeros(1), np.zeros(0), np.zeros(0))
    assert state_bounds([reading] * 8, np.zeros((0, 2)), 1e-9) is None
