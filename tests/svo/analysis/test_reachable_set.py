from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from svo.analysis.lifted_rows import evaluate
from svo.analysis.reachable_set import ReachableSet, product_bounds
from tests.svo.observers.random_plants import random_plant


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_states_and_factors_of_any_run_lie_in_their_bounds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=3)
    n = model.n_states
    lower, upper, _ = model.bounds()
    stack, channels, _ = evaluate(model, None)
    reachable = ReachableSet(-np.ones(n), np.ones(n))
    x = rng.choice([-1.0, 1.0], n)
    w_ends = model.disturbance_polytope.vertices() if model.disturbance_polytope is not None else None
    for _ in range(8):
        box = reachable.box()
        assert (box[0] <= x).all()
        assert (x <= box[1]).all()
        u = rng.normal(size=model.n_inputs)
        w = np.where(rng.random(len(lower)) < 0.5, lower, upper) if w_ends is None else rng.permutation(w_ends)[0]
        others = (np.concatenate([u, [1.0], lower]), np.concatenate([u, [1.0], upper]))
        known = np.concatenate([x, u, [1.0], w])
        s = [reachable.bounds(c.functional, others) for c in channels]
        assert all(low <= c.functional @ known <= high for c, (low, high) in zip(channels, s, strict=True))
        deltas = np.array([rng.choice(q.bounds) for q in model.uncertainties])
        corners = np.array([product_bounds(c, *ends) for c, ends in zip(channels, s, strict=True)]).reshape(-1, 2)
        reachable.move(stack, channels, others, (corners[:, 0], corners[:, 1]))
        x = (np.tensordot(np.concatenate([[1.0], deltas]), model.stack(), axes=1) @ known)[:n]


def test_rotation_does_not_wrap() -> None:
    c = np.sqrt(0.5)
    turn = np.array([[c, c, 0.0], [-c, c, 0.0]])  # an eighth of a turn; the last column is the constant term
    reachable = ReachableSet(-np.ones(2), np.ones(2))
    one = (np.ones(1), np.ones(1))
    for _ in range(8):  # once around: a box would have grown to 16
        reachable.move(turn, (), one, (np.zeros(0), np.zeros(0)))
    np.testing.assert_allclose(reachable.box()[1], [1.0, 1.0], rtol=1e-8)
