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

    @property
    def update(self) -> Callable[..., Answer_co]:
        """Called as update(y0, u=None, schedule=None): a measurement without a transition (the first one).

        With u_range=... too, as `step`.
        """
        ...

    @property
    def step(self) -> Callable[..., Answer_co]:
        """Called as step(u, y, u_next=None, schedule=None): one transition driven by u, then the measurement y.

        With dt=... too, the seconds of the transition, where a log keeps its own times; with u_range=..., bounds of the
        inputs that follow soon, where stamps may be off (``jitter``).
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
        known = {name: options[name] for name in options if name == "u_range"}
        return driven.update(y, u=u, schedule=schedule, **known)
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
    ahead = _inputs_ahead(driven, log, k)
    if ahead is not None:
        options = {**options, "u_range": ahead}
    return advance(driven, log.u[k - 1] if k else None, log.y[k], log.u[k], schedule, **options)


def _interval(driven: Driven[Answer], log: Log, k: int) -> float | None:
    """Seconds from sample k - 1 to k of a log that keeps its own times; None where that is the sampling time."""
    if hasattr(driven, "Ts"):
        return log.interval_at(k)
    if log.events:
        raise TypeError(f"{type(driven).__name__} takes no log that keeps its own times (Log.events); resample it")
    return None


def _inputs_ahead(driven: Any, log: Log, k: int) -> Array | None:
    """Bounds (2, nu) of the inputs from sample k of a log on, while readings whose stamps are off may yet be taken."""
    jitter = getattr(driven, "jitter", None)
    if jitter is None:
        return None
    inputs = log.u[k : int(np.searchsorted(log.time, log.time[k] + jitter.max(), side="left"))]
    return np.array([inputs.min(axis=0), inputs.max(axis=0)]) if len(inputs) > 1 else None
