"""A model along one log: everything that is a function of the schedule, evaluated for all samples at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array, finite_array
from svo.models.schedule_table import ScheduleTable
from svo.models.stack import OUTPUT_BLOCKS, STATE_BLOCKS

if TYPE_CHECKING:
    from svo.models.model import UncertainModel

_TYPICAL = -1.0  # the sample before the first stands for the typical schedule, at which observers choose their rows


def along(model: UncertainModel, schedule: ArrayLike | None) -> UncertainModel:
    """See `UncertainModel.along`."""
    if not model.is_scheduled:
        return model
    if schedule is None:
        raise ValueError("schedule is missing: the model has arrays or bounds that are functions of it")
    values: Array = finite_array("schedule", schedule)
    if values.ndim == 0 or len(values) == 0:
        raise ValueError(f"schedule has shape {values.shape}; expected (K, ...), one value a sample")
    typical: Array = finite_array("schedule of the model", model.schedule)
    if typical.shape != values.shape[1:]:
        raise ValueError(f"schedule has shape {values.shape[1:]} at a sample; expected {typical.shape}")
    values = np.concatenate([typical[None], values])
    samples: Array = _TYPICAL + np.arange(float(len(values)))
    stacks = model.stack_over(values)
    tables = [
        _tables(model, owner, samples, stacks[:, item]) for item, owner in enumerate((model, *model.uncertainties))
    ]
    return model.replace(
        **tables[0],
        **_bounds(model, samples, values),
        uncertainties=[replace(u, **of) for u, of in zip(model.uncertainties, tables[1:], strict=True)],
        schedule=_TYPICAL,
    )


def _tables(model: UncertainModel, owner: Any, samples: Array, stacks: Array) -> Mapping[str, Any]:
    """The scheduled blocks of the model or of an uncertainty, by name."""
    tables = {}
    for name in STATE_BLOCKS + OUTPUT_BLOCKS:
        if callable(getattr(owner, name)):
            rows, columns = model.layout.block(name)
            values = stacks[:, rows, columns]
            tables[name] = ScheduleTable(samples, values[..., 0] if name in "ac" else values)
    return tables


def _bounds(model: UncertainModel, samples: Array, values: Array) -> Mapping[str, Any]:
    """The arguments w and n, where they are functions of the schedule."""
    if not any(callable(edge) for edge in (model.n, *(model.w if isinstance(model.w, tuple) else ()))):
        return {}
    lower, upper, noise = (ScheduleTable(samples, edge) for edge in model.bounds_over(values))
    return {"n": noise} if model.disturbance_polytope is not None else {"w": (lower, upper), "n": noise}
