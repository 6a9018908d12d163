"""The one loop over a log: what is driven is updated with the first sample, then stepped from each to the next."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Protocol, TypeVar

import numpy as np

from svo.checks import Array
from svo.logs.log import Log, expect_log

Answer_co = TypeVar("Answer_co", covariant=True)
Answer = TypeVar("Answer")


class Driven(Protocol[Answer_co]):
    """What can be driven over a log: an observer, a bank, a detector or a filter."""

    def update(self, y0: Any, u: Any = None, schedule: Any = None) -> Answer_co:
        """A measurement without a transition (the first one)."""
        ...

    @property
    def step(self) -> Callable[..., Answer_co]:
        """Called as step(u, y, u_next=None, schedule=None): one transition driven by u, then the measurement y.

        With dt=... too, the seconds of the transition, where a log keeps its own times.
        """
        ...


def advance(driven: Driven[Answer], held: Array | None, y: Array, u: Array, schedule: Any, **options: Any) -> Answer:
    """The answer at the next sample.

    Parameters
    ----------
    driven : observer, bank or the like
    held : (nu,) array or None
        The input that drove the plant here; None at the first sample.
    y, u : (ny,), (nu,) arrays
        The measurement, and the input that is held from now on.
    schedule
        Scheduling value of the sample, or None.
    options
        Of ``driven.step``, such as ``deadline``.
    """
    if held is None:
        return driven.update(y, u=u, schedule=schedule)
    return driven.step(held, y, u_next=u, schedule=schedule, **options)


def drive(
    driven: Driven[Answer],
    log: Log,
    *,
    start: int = 0,
    scheduler: Callable[[Array, Array], Any] | None = None,
    **options: Any,
) -> Iterator[Answer]:
    """The answers at one sample of a log after the other; who has seen enough stops asking.

    Parameters
    ----------
    driven : observer, bank or the like
        Not started, or with ``start`` samples behind it. Sets and boxes of an answer must be read before the next one
        is asked for.
    log : Log
    start : int
        First sample; above zero for what goes on from a saved state.
    scheduler : callable, optional
        Of y (ny,) and u (nu,) of each sample in turn; by default the schedule is the log's own.
    options
        Of ``driven.step``, such as ``deadline``.

    Raises
    ------
    TypeError, ValueError
        If ``log`` is no log or has no samples, and what ``driven`` raises.
    """
    expect_log(log)
    for k in range(start, len(log)):
        schedule = log.schedule_at(k) if scheduler is None else scheduler(log.y[k], log.u[k])
        yield advance_to(driven, log, k, schedule, **options)


def advance_to(driven: Driven[Answer], log: Log, k: int, schedule: Any, **options: Any) -> Answer:
    """The answer at sample k of a log."""
    dt = _interval(driven, log, k)
    if dt is not None:
        options = {**options, "dt": dt}
    return advance(driven, log.u[k - 1] if k else None, readings_at(driven, log, k), log.u[k], schedule, **options)


def _interval(driven: Driven[Answer], log: Log, k: int) -> float | None:
    """Seconds from sample k - 1 to k of a log that keeps its own times; None where that is the sampling time."""
    if hasattr(driven, "Ts"):
        return log.interval_at(k)
    if log.events:
        raise TypeError(f"{type(driven).__name__} takes no log that keeps its own times (Log.events); resample it")
    return None


def readings_at(driven: Any, log: Log, k: int) -> Array:
    """The measurement (ny,) at sample k of a log, without readings that ``driven`` cannot take.

    A reading whose time stamp is off (``driven.jitter``) may have been taken after an input that changes that soon.
    """
    jitter, y = getattr(driven, "jitter", None), log.y[k]
    if jitter is None:
        return y
    end = int(np.searchsorted(log.time, log.time[k] + jitter.max(), side="left"))
    for later in range(k + 1, end):
        if (log.u[later] != log.u[k]).any():
            return np.where(log.time[later] - log.time[k] < jitter, np.nan, y)
    return y
