"""Scheduling filters of plants: causal, and able to go on where a saved state stopped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from svo.checks import real_array
from svo.logs.log import Log


@runtime_checkable
class InputScheduler(Protocol):
    """A causal scheduling filter that needs the input of each sample beside its measurement."""

    def with_input(self, y: NDArray[np.float64], u: NDArray[np.float64]) -> Any:
        """The schedule of a sample from its y (ny,) and u (nu,); called with each sample in turn."""
        ...


Scheduler = Callable[[NDArray[np.float64]], Any] | InputScheduler


def schedule_of(scheduler: Scheduler, y: NDArray[np.float64], u: NDArray[np.float64]) -> Any:
    """The schedule of the next sample from its y (ny,) and u (nu,), by a ``scheduler`` of either kind."""
    return scheduler.with_input(y, u) if isinstance(scheduler, InputScheduler) else scheduler(y)


def scheduled(scheduler: Scheduler, log: Log) -> Log:
    """A ``log`` with the schedule that a fresh ``scheduler`` makes of its y and u."""
    if scheduler is no_schedule:
        return replace(log, schedule=None)
    if isinstance(scheduler, InputScheduler):
        values = [scheduler.with_input(y, u) for y, u in zip(log.y, log.u, strict=True)]
    else:
        values = [scheduler(y) for y in log.y]
    return replace(log, schedule=None if values[0] is None else real_array("schedule", values, finite=False))


@runtime_checkable
class SavesSchedule(Protocol):
    """What a scheduling filter offers besides if what it says depends on the samples before, so that it can go on."""

    def state_dict(self) -> dict[str, NDArray[Any]]:
        """Everything that the next samples depend on, as named arrays."""
        ...

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on from ``state``, what `state_dict` gave."""
        ...


def saved_schedule(scheduler: Scheduler) -> dict[str, NDArray[Any]]:
    """The state of a ``scheduler``, a plant's scheduling filter.

    Raises
    ------
    TypeError
        If the filter has no ``state_dict``.
    """
    if scheduler is no_schedule:
        return {}
    if not isinstance(scheduler, SavesSchedule):
        raise TypeError(
            f"the plant's scheduler ({type(scheduler).__name__}) has no state_dict, so that a saved state could not go "
            "on as if nothing had happened; add state_dict and load_state_dict (svo.plant.SavesSchedule)"
        )
    return scheduler.state_dict()


def resume_schedule(scheduler: Scheduler, state: Mapping[str, NDArray[Any]]) -> None:
    """Let a ``scheduler`` go on from ``state``, what `saved_schedule` gave."""
    if isinstance(scheduler, SavesSchedule):
        scheduler.load_state_dict(state)


def no_schedule(y: NDArray[np.float64]) -> None:
    """The scheduler of a plant whose model has no schedule, whatever y is; it has nothing to remember."""
