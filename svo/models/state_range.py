"""Ranges of the state that a user promises: `physical` at all times, `largest` where a set starts again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes.value import Value
from svo.checks import Array, expect, real_array

_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class StateRange(Value):
    """{x : lower <= x <= upper}; an infinite bound says nothing.

    Attributes
    ----------
    lower, upper : (n,) arrays
    """

    lower: Array
    upper: Array

    @property
    def is_bounded(self) -> bool:
        return bool(np.isfinite(self.lower).all() and np.isfinite(self.upper).all())

    def cut(self, lower: Array, upper: Array) -> tuple[Array, Array, bool]:
        """A box within the range, and whether they meet. Where they do not, the box stays as it is, which is sound.

        Of equal ends the range's is taken, which tells zeros apart, as the core takes it.
        """
        low, high = np.where(lower > self.lower, lower, self.lower), np.where(upper < self.upper, upper, self.upper)
        meets = low <= high
        return np.where(meets, low, lower), np.where(meets, high, upper), bool(meets.all())

    def along(self, directions: Array) -> StateRange:
        """Bounds of d'x over the range, for directions d (k, n)."""
        return StateRange(0.0 - self.support(-directions), 0.0 + self.support(directions))

    def support(self, directions: Array) -> Array:
        """Largest d'x over the range, for directions (k, n), rounded up; infinite where nothing bounds it."""
        ends = np.where(directions > 0.0, self.upper, self.lower)
        products = np.where(directions == 0.0, 0.0, directions) * np.where(directions == 0.0, 0.0, ends)
        total = products.sum(axis=1)
        is_axis = (np.count_nonzero(directions, axis=1) == 1) & (np.abs(directions).sum(axis=1) == 1.0)
        terms = np.where(np.isfinite(total) & ~is_axis, np.abs(products).sum(axis=1), 0.0)
        return np.where(np.isfinite(total), total, np.inf) + 4.0 * (directions.shape[1] + 1) * _EPS * terms


def within(physical: StateRange | None, lower: Array, upper: Array) -> tuple[Array, Array]:
    """A box within a range, if there is one; where they do not meet, as it is."""
    return (lower, upper) if physical is None else physical.cut(lower, upper)[:2]


def beside(of: StateRange | None, more: tuple[Array, Array], n: int) -> StateRange | None:
    """The range of n states and of further ones between two bounds; None where neither says anything."""
    if not len(more[0]):
        return of
    free = np.full(n, np.inf)
    lower, upper = (-free, free) if of is None else (of.lower, of.upper)
    return StateRange(np.append(lower, more[0]), np.append(upper, more[1]))


def state_range(name: str, value: Any, n: int, bounded: bool) -> StateRange | None:
    """From an argument (lower, upper) of a model; a number stands for every state.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what it is and what was expected.
    """
    if value is None:
        return None
    wanted = f"(lower, upper), each a number or of shape ({n},), lower <= upper"
    wanted += ", all finite" if bounded else "; -inf or inf where there is no bound"
    expect(isinstance(value, tuple | list) and len(value) == 2, name, value, wanted)
    given = (real_array(f"{name}[{i}]", end, (), (n,), meaning=wanted, finite=False) for i, end in enumerate(value))
    ends = lower, upper = [np.full(n, end) + 0.0 for end in given]  # no zero is negative
    if not ((lower <= upper) & (lower < np.inf) & (upper > -np.inf)).all():
        raise ValueError(f"{name} is between {lower} and {upper}; expected {wanted}")
    found = StateRange(lower, upper)
    if bounded and not found.is_bounded:
        raise ValueError(f"{name} is between {lower} and {upper}; expected {wanted}")
    for end in ends:
        end.setflags(write=False)
    return found


def start_range(physical: StateRange | None, largest: StateRange | None) -> StateRange | None:
    """The bounded range in which a set starts again: `largest` within `physical`, or `physical` where it is bounded.

    Raises
    ------
    ValueError
        If both are given and have no common point.
    """
    if largest is None:
        return physical if physical is not None and physical.is_bounded else None
    if physical is None:
        return largest
    lower, upper, meets = physical.cut(largest.lower, largest.upper)
    if not meets:
        raise ValueError("largest and physical have no common point; expected largest to be reachable within physical")
    return StateRange(lower, upper)
