"""What a window observer answers at a sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from polytopes import HPolytope
from svo.checks import Array
from svo.observers.answers import Step, between


class _Window(Protocol):
    """What an answer asks of the observer that gave it."""

    model: Any

    @property
    def directions(self) -> Array: ...

    def bounds_at(self, sample: int) -> tuple[Array, Array]: ...

    def support_at(self, sample: int, directions: Array) -> Array: ...


@dataclass(frozen=True, slots=True, eq=False)
class WindowStep(Step):
    """Answer of a `WindowObserver` at one sample.

    Box, set and support are computed when they are read, which must be before the observer's next sample; the set is
    that in the template's directions.
    """

    observer: _Window

    @property
    def n(self) -> int:
        return int(self.observer.model.n_states)

    def _box(self) -> tuple[Array, Array]:
        lower, upper = self.observer.bounds_at(self.sample)
        return lower[: self.n], upper[: self.n]

    def _set(self) -> HPolytope:
        return between(self.observer.directions, *self.observer.bounds_at(self.sample))

    def _support(self, rows: Array) -> Array:
        return self.observer.support_at(self.sample, rows)
