"""The age of the data: says when nothing comes, once, and when something comes again."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic


class Silence:
    """Watches over the time since the latest line.

    Parameters
    ----------
    seconds : float
        Silence of which is said.
    clock : callable
        Seconds that have passed.
    """

    def __init__(self, seconds: float, clock: Callable[[], float] = monotonic) -> None:
        self._seconds, self._clock = seconds, clock
        self._latest = clock()
        self._is_silent = False

    def says(self, has_data: bool) -> str | None:
        """What is to be said now, if anything; called whenever lines have come, and often while none come."""
        age = self._clock() - self._latest
        if has_data:
            self._latest += age
            was_silent, self._is_silent = self._is_silent, False
            return f"data again, after {age:.1f} s without any" if was_silent else None
        if age < self._seconds or self._is_silent:
            return None
        self._is_silent = True
        return f"no data for {age:.1f} s"
