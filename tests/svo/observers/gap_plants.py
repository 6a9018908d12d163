"""Plants and runs with a gap in their measurements."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo import UncertainModel

Array = NDArray[np.float64]


def rotation(**changes: Any) -> UncertainModel:
    """Stable, and its boxes grow without measurements all the same."""
    turn, radius = 0.5, 0.98
    A = radius * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return UncertainModel(A, None, [[1.0, 0.0]], E=np.eye(2), w=[0.1, 0.1], n=0.05, **changes)


def unstable(rate: float = 1.05, **changes: Any) -> UncertainModel:
    return UncertainModel([[rate]], None, [[1.0]], E=[[1.0]], w=[0.1], n=0.05, **changes)


def start(model: UncertainModel, half: float = 1.0) -> HPolytope:
    n = model.n_states
    return HPolytope.box(-half * np.ones(n), half * np.ones(n))


def answers(observer: Any, outputs: Any, u: Any = None) -> Iterator[Any]:
    """Steps over outputs (K, ny), under inputs (K, nu)."""
    size = observer.model.n_inputs
    inputs = np.zeros((len(outputs), size)) if u is None else np.asarray(u, dtype=float)
    for k, y in enumerate(outputs):
        following = inputs[k] if size else None
        yield observer.update(y, following) if k == 0 else observer.step(inputs[k - 1], y, following)


def blind(observer: Any, samples: int) -> Any:
    """So many samples without a measurement; the last answer."""
    nothing, u = np.full(observer.model.n_outputs, np.nan), np.zeros(observer.model.n_inputs)
    return [observer.step(u, nothing, u) for _ in range(samples)][-1]


def after_a_gap(
    model: UncertainModel, rng: np.random.Generator, samples: int, half: float = 1.0, corners: bool = True
) -> tuple[Array, Array]:
    """States and outputs from a new state on, disturbances and noise at their corners or anywhere."""
    u = np.zeros((samples, model.n_inputs))
    log = model.simulate(rng.uniform(-half, half, model.n_states), u, rng, corners=corners)
    assert log.x is not None
    return log.x, log.y
