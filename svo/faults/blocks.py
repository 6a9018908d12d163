"""Arithmetic on model arrays that may be constant, functions of the schedule, or absent (zero)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import Array, expect, finite_array, floats, is_count
from svo.models import Schedulable, ScheduleTable, UncertainModel, Uncertainty
from svo.models.schedule_table import values_over


def mapped(function: Callable[..., Array], *values: Schedulable) -> Schedulable:
    """``function`` of arrays; again a function of the schedule where any of them is one.

    It must be affine, and act alike with and without samples in front of the arrays.
    """
    functions = [v for v in values if callable(v)]
    if not functions:
        return function(*(finite_array("an array of the model", v) for v in values))
    tables = [f for f in functions if isinstance(f, ScheduleTable)]
    if len(tables) == len(functions) and all(t.has_points_of(tables[0]) for t in tables):
        return ScheduleTable.of(
            function, *(v if isinstance(v, ScheduleTable) else finite_array("an array of the model", v) for v in values)
        )
    return _Mapped(function, values)


@dataclass(frozen=True)
class _Mapped:
    """A function of arrays of which some are functions of the schedule."""

    function: Callable[..., Array]
    values: tuple[Schedulable, ...]

    def __call__(self, schedule: Any) -> Array:
        arrays = (v(schedule) if callable(v) else v for v in self.values)
        return self.function(*(floats("an array of the model", array) for array in arrays))

    def over(self, schedule: Array) -> Array:
        return self.function(*(values_over(v, schedule) for v in self.values))


def only_columns(value: Schedulable, columns: Sequence[int], factor: float) -> Schedulable:
    """The matrix with all columns (vector with all entries) zero but these, which are multiplied by ``factor``."""
    return None if value is None else mapped(lambda m: m * _mask(m.shape[-1], columns, factor), value)


def without_columns(value: Schedulable, columns: Sequence[int]) -> Schedulable:
    """The matrix with these columns set to zero."""
    return None if value is None else mapped(lambda m: m * (1.0 - _mask(m.shape[-1], columns, 1.0)), value)


def only_rows(value: Schedulable, rows: Sequence[int], factor: float) -> Schedulable:
    """The matrix with all rows zero but these, which are multiplied by ``factor``."""
    return None if value is None else mapped(lambda m: m * _mask(m.shape[-2], rows, factor)[:, None], value)


def sum_of_columns(value: Schedulable, columns: Sequence[int], factor: float) -> Schedulable:
    """``factor`` times the sum of these columns, a vector."""
    return None if value is None else mapped(lambda m: factor * m[..., list(columns)].sum(axis=-1), value)


def with_new_columns(value: Schedulable, source: Schedulable, columns: Sequence[int], width: int) -> Schedulable:
    """``value`` (``width`` columns, zero if absent) followed by these columns of ``source``; absent if both are."""
    if source is None:
        return None if value is None else mapped(lambda m: _beside(m, _zeros(m, len(columns))), value)
    if value is None:
        return mapped(lambda s: _beside(_zeros(s, width), s[..., list(columns)]), source)
    return mapped(lambda m, s: _beside(m, s[..., list(columns)]), value, source)


def with_new_disturbances(model: UncertainModel, lower: float, upper: float, count: int) -> Any:
    """The disturbance set of ``model`` times ``count`` intervals [lower, upper], as the argument ``w``."""
    low, high = np.full(count, lower), np.full(count, upper)
    if isinstance(model.w, HPolytope):
        return model.w.product(HPolytope.box(low, high))
    edges = disturbance_edges(model)
    return tuple(
        mapped(lambda edge, n=new: _beside(edge, np.broadcast_to(n, (*edge.shape[:-1], count))), edge)
        for edge, new in zip(edges, (low, high), strict=True)
    )


def disturbance_edges(model: UncertainModel) -> tuple[Schedulable, Schedulable]:
    """Lower and upper bound (nw,) of the disturbances, each an array or a function of the schedule."""
    lower, upper, _ = model.bounds(model.schedule)
    low, high = model.w if isinstance(model.w, tuple) else (None, None)
    return low if callable(low) else lower, high if callable(high) else upper


def with_noise(model: UncertainModel, function: Callable[[Array], Array]) -> Schedulable:
    """``function`` of the noise half-widths (ny,) of ``model``, as the argument ``n``."""
    return mapped(function, model.n if callable(model.n) else model.bounds(model.schedule)[2])


def product_bounds(first: tuple[float, float], second: tuple[float, float]) -> tuple[float, float]:
    """Interval of the product of two numbers in the given intervals."""
    corners = [a * b for a in first for b in second]
    return min(corners), max(corners)


def product_of(
    uncertainty: Uncertainty, bounds: tuple[float, float], name: str, **blocks: Schedulable
) -> Uncertainty | None:
    """The term Delta_i Delta_fault of a fault that scales ``blocks`` of an uncertain nominal model.

    The product is taken as one more free Delta, which contains it. None where no block is there to scale.
    """
    if all(v is None or (not callable(v) and not np.any(v)) for v in blocks.values()):
        return None
    label = f"{uncertainty.name or 'uncertainty'} x {name}"
    return Uncertainty(**blocks, bounds=product_bounds(uncertainty.bounds, bounds), name=label)


def channels(where: Any, count: int | None = None, what: str = "") -> tuple[int, ...]:
    """``where`` of a fault as a tuple of indices, checked: below a count of what there is, if one is given."""
    indices = where if isinstance(where, tuple) else (where,)
    for index in indices:
        expect(is_count(index, 0), "where", where, "the index of a channel (>= 0) or a tuple of such indices")
    expect(indices and len(set(indices)) == len(indices), "where", where, "at least one channel, each once")
    if count is not None and max(indices) >= count:
        raise ValueError(f"where is {indices} but there are {count} {what}; expected indices below {count}")
    return tuple(int(i) for i in indices)


def _beside(left: Array, right: Array) -> Array:
    return np.concatenate([left, right], axis=-1)


def _zeros(like: Array, width: int) -> Array:
    return np.zeros((*like.shape[:-1], width))


def _mask(size: int, indices: Sequence[int], factor: float) -> Array:
    mask = np.zeros(size)
    mask[list(indices)] = factor
    return mask
