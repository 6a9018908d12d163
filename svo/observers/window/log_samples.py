"""Samples of a log in normal form, as the kernel takes many at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from svo.checks import Array
from svo.logs.log import Log
from svo.models.normal_form import NormalForm

_ORDINARY = 2.0**200  # of a reading or an input, in normal form: larger ones are clipped, one by one


class LogSamples(NamedTuple):
    """Data and matrices of k samples; stack, noise and bounds of w once for all of them where nothing is scheduled.

    Attributes
    ----------
    u, u_next, y : (k, nu), (k, nu), (k, ny) arrays
        What drives the transition to each sample, its own input, and its measurement.
    stack, noise, w_lower, w_upper : (k or 1, ...) arrays
    """

    u: Array
    u_next: Array
    y: Array
    stack: Array
    noise: Array
    w_lower: Array
    w_upper: Array


def log_samples(form: NormalForm, log: Log, first: int, last: int, needs_next: bool) -> LogSamples | None:
    """Samples ``first`` to ``last`` - 1; None if there are none, or the first is out of the ordinary and taken alone.

    Out of the ordinary are missing readings, and numbers that the normal form clips. ``needs_next`` says whether the
    input of a sample itself counts.
    """
    if (log.u.shape[1], log.y.shape[1]) != (form.u.size, form.y.size):
        return None
    start = log.u[first - 1 : first] if first else np.zeros((1, log.u.shape[1]))
    before = np.vstack([start, log.u[first : last - 1]])[: last - first]
    u, u_next, y = before / form.u, log.u[first:last] / form.u, log.y[first:last] / form.y
    plain = np.all([(np.abs(array) < _ORDINARY).all(axis=1) for array in (u, u_next, y)], axis=0)
    count = len(plain) if plain.all() else int(np.argmin(plain))
    if count == 0:
        return None
    matrices = _matrices(form, log, first, first + count)
    if matrices is None:
        return None
    data = (u[:count], u_next[:count] if needs_next else np.zeros((count, u.shape[1])), y[:count])
    return LogSamples(*(np.ascontiguousarray(array) for array in (*data, *matrices)))


def _matrices(form: NormalForm, log: Log, first: int, last: int) -> tuple[Array, ...] | None:
    """Stack, noise and bounds of w; None where they cannot be had at once, and `WindowObserver.step` says why."""
    model = form.model
    if not model.is_scheduled:
        lower, upper, noise = model.bounds()
        return model.stack()[None], noise[None], lower[None], upper[None]
    if log.schedule is None:
        return None
    schedule = log.schedule[first:last]
    try:
        lower, upper, noise = model.bounds_over(schedule)
        return model.stack_over(schedule), noise, lower, upper
    except (TypeError, ValueError):
        return None
