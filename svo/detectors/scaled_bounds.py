"""A model with all its bounds on noise and disturbances scaled by one factor."""

from __future__ import annotations

from typing import Any

import numpy as np

from svo.checks import expect
from svo.faults.blocks import disturbance_edges, mapped, with_noise
from svo.faults.equations import Model
from svo.models import UncertainModel
from svo.models.nonlinear import NonlinearModel


def scaled_bounds(model: Model, scale: float) -> Model:
    """The model with its disturbance set scaled about its middle, and its noise half-widths scaled.

    Intervals of uncertainties stay as they are: they say which faults and plants the model stands for.

    Raises
    ------
    ValueError
        If the scale is not positive.
    """
    expect(np.isfinite(scale) and scale > 0, "scale", scale, "a positive number, 1 for the bounds as stated")
    if scale == 1.0:
        return model
    if isinstance(model, NonlinearModel):
        low, high = (end[: model.n_disturbances] for end in model.flow.w)
        middle, half = 0.5 * (low + high), 0.5 * scale * (high - low)
        return model.replace(w=(middle - half, middle + half), n=scale * model.noise)
    return model.replace(w=_disturbances(model, scale), n=with_noise(model, lambda noise: scale * noise))


def _disturbances(model: UncertainModel, scale: float) -> Any:
    if model.n_disturbances == 0:
        return model.w
    if (polytope := model.disturbance_polytope) is not None:
        lower, upper = polytope.bounding_box()
        return polytope.affine_map(scale * np.eye(polytope.dim), (1 - scale) / 2 * (lower + upper))
    edges = disturbance_edges(model)
    return tuple(
        mapped(lambda low, high, s=s: (low + high) / 2 + s * scale * (high - low) / 2, *edges) for s in (-1, 1)
    )
