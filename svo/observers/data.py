"""Checks of what a user hands to an observer at a sample."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from svo.model import UncertainModel

Array = NDArray[np.float64]


def outputs_of(model: UncertainModel, y: ArrayLike) -> Array:
    """A measurement (ny,), NaN where a sensor is missing."""
    array = np.asarray(y, dtype=float)
    if array.shape != (model.n_outputs,):
        raise ValueError(f"y has shape {array.shape}; expected ({model.n_outputs},), one value a sensor")
    if np.isinf(array).any():
        raise ValueError(f"y is {array}; expected finite numbers, or NaN for a missing sensor")
    return array


def inputs_of(model: UncertainModel, name: str, u: ArrayLike | None, needed: bool) -> Array:
    """An input (nu,); zeros where it is not needed."""
    size = model.n_inputs
    if not needed or (u is None and size == 0):
        return np.zeros(size)
    if u is None:
        why = ", since D, a D_i or a channel shares it with the output" if name != "u" else ""
        raise ValueError(f"{name} is missing; expected shape ({size},){why}")
    array = np.asarray(u, dtype=float)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise ValueError(f"{name} has shape {array.shape}; expected finite numbers of shape ({size},)")
    return array


def stack_at(model: UncertainModel, schedule: Any) -> Array:
    """The stack of a model at a sample, all finite."""
    if model.is_scheduled and schedule is None:
        raise ValueError("schedule is missing: the model has arrays that are functions of it: pass schedule=...")
    stack = model.stack(schedule)
    if not np.isfinite(stack).all():
        raise ValueError(f"the model's matrices at schedule {schedule!r} contain NaN or Inf; expected numbers")
    return stack
