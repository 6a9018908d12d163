"""A model with all its bounds on noise and disturbances scaled by one factor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.model import UncertainModel

Array = NDArray[np.float64]


def scaled_bounds(model: UncertainModel, scale: float) -> UncertainModel:
    """The model with its disturbance set scaled about its middle, and its noise half-widths scaled.

    Intervals of uncertainties stay as they are: they say which faults and plants the model stands for.

    Raises
    ------
    ValueError
        If the scale is not positive.
    """
    if not (np.isfinite(scale) and scale > 0):
        raise ValueError(f"scale is {scale}; expected a positive number, 1 for the bounds as stated")
    if scale == 1.0:
        return model
    return model.replace(w=_disturbances(model, scale), n=_at_schedule(model, lambda low, high, noise: scale * noise))


def _disturbances(model: UncertainModel, scale: float) -> Any:
    if model.n_disturbances == 0:
        return model.w
    if (polytope := model.disturbance_polytope) is not None:
        lower, upper = polytope.bounding_box()
        return polytope.affine_map(scale * np.eye(polytope.dim), (1 - scale) / 2 * (lower + upper))
    return (
        _at_schedule(model, lambda low, high, noise: (low + high) / 2 - scale * (high - low) / 2),
        _at_schedule(model, lambda low, high, noise: (low + high) / 2 + scale * (high - low) / 2),
    )


def _at_schedule(model: UncertainModel, formula: Callable[[Array, Array, Array], Array]) -> Any:
    """The formula of the bounds: an array, or a function of the schedule where a bound is one."""
    edges = model.w if isinstance(model.w, tuple) else (model.w,)
    if callable(model.n) or any(callable(edge) for edge in edges):
        return lambda schedule: formula(*model.bounds(schedule))
    return formula(*model.bounds())
