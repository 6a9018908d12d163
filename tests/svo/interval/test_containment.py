"""The set-valued observer of the same plant stays inside the interval prediction made with the same gc and gr."""

from __future__ import annotations

import numpy as np
import pytest

from polytopes import HPolytope
from svo import Log, WindowObserver
from svo.interval import IntervalPrediction, IntervalPredictor, first_order_model, first_order_schedule
from tests.svo.interval.first_order_plants import random_truth

NOISE = 0.05


def prediction(seed: int, samples: int = 120) -> tuple[IntervalPrediction, np.ndarray]:
    rng = np.random.default_rng(seed)
    truth = random_truth(samples, rng)
    y = truth.x + rng.uniform(-NOISE, NOISE, samples)
    log = Log(time=np.arange(samples, dtype=float), u=truth.u[:, None], y=y[:, None])
    return IntervalPredictor(truth.bounds, (0.0, 1.0)).predict(log), truth.x


@pytest.mark.parametrize("horizon", [1, 8])
@pytest.mark.parametrize("seed", range(3))
def test_the_observer_is_inside_the_prediction_and_keeps_the_state(seed: int, horizon: int) -> None:
    p, x = prediction(seed)
    observer = WindowObserver(first_order_model(NOISE, Ts=1.0), HPolytope.box([-1.0], [1.0]), horizon=horizon)
    record = observer.run(first_order_schedule(p))
    assert set(record.verdicts) == {"consistent"}
    lower, upper = record.lower[:, 0], record.upper[:, 0]
    slack = 1e-7 * (1 + np.abs(p.center) + p.radius)  # of the observer's linear programs
    assert (lower >= p.lower - slack).all()
    assert (upper <= p.upper + slack).all()
    assert ((lower - slack <= x) & (x <= upper + slack)).all()
    assert np.median((upper - lower) / (2 * p.radius)) < 0.5  # the measurements are worth something
