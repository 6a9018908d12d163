"""Random runs of an uncertain model, every unknown inside its bounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array, finite_array
from svo.logs.log import Log

if TYPE_CHECKING:
    from svo.models.model import UncertainModel


def simulate(
    model: UncertainModel,
    x0: ArrayLike,
    u: ArrayLike,
    rng: np.random.Generator,
    *,
    corners: bool,
    schedule: ArrayLike | None,
) -> Log:
    """A run from x0 under u; see `UncertainModel.simulate`."""
    inputs = finite_array("u", u, ("samples", model.n_inputs))
    x: Array = finite_array("x0", x0, (model.n_states,))
    if not len(inputs):
        raise ValueError(f"u has shape {inputs.shape}; expected (samples, {model.n_inputs}), at least one sample")
    if not isinstance(rng, np.random.Generator):
        raise TypeError(f"rng is {rng!r}; expected a numpy Generator, such as np.random.default_rng(0)")
    values = None if schedule is None else finite_array("schedule", schedule)
    if values is None and model.is_scheduled:
        raise ValueError("schedule is missing: the model has arrays that are functions of it; give one value a sample")
    if values is not None and values.shape[:1] != inputs.shape[:1]:
        raise ValueError(f"schedule has shape {values.shape}; expected ({len(inputs)}, ...), one value a sample of u")
    n, states, outputs = model.n_states, [], []
    limits = np.array([q.bounds for q in model.uncertainties]).reshape(-1, 2)
    polytope = model.disturbance_polytope
    vertices = None if polytope is None else polytope.vertices()
    for k, held in enumerate(inputs):
        value = None if values is None else values[k]
        lower, upper, noise = model.bounds(value)
        w = _draw(lower, upper, rng, corners) if vertices is None else _draw_mixture(vertices, rng, corners)
        deltas = _draw(limits[:, 0], limits[:, 1], rng, corners)
        total = np.tensordot(np.concatenate([[1.0], deltas]), model.stack(value), axes=1)
        known = np.concatenate([x, held, [1.0], w])
        states.append(x)
        outputs.append(total[n:] @ known + _draw(-noise, noise, rng, corners))
        x = total[:n] @ known
    time: Array = np.arange(len(inputs), dtype=float) * model.Ts
    return Log(time=time, u=inputs, y=np.array(outputs), x=np.array(states), schedule=values)


def _draw(lower: Array, upper: Array, rng: np.random.Generator, corners: bool) -> Array:
    if corners:
        return np.where(rng.random(lower.shape) < 0.5, lower, upper)
    return rng.uniform(lower, upper)


def _draw_mixture(vertices: Array, rng: np.random.Generator, corners: bool) -> Array:
    """A vertex, or a random mixture of all."""
    if corners:
        return vertices[rng.integers(len(vertices))]
    return rng.dirichlet(np.ones(len(vertices))) @ vertices
