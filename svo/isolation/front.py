"""Where one observer of a bank stands in a log: it may have seen more of it than the bank has concluded on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from svo.observers.base import Seen, Step


class Front:
    """An observer's answers over a log, taken in portions of the bank's choice.

    Parameters
    ----------
    name : str
        Of the observer, which leads the messages of its errors.
    answers : iterator of Seen
    """

    def __init__(self, name: str, answers: Iterator[Seen]) -> None:
        self.name, self._answers = name, answers
        self._left = 0
        self._step: Step

    def plain(self) -> int:
        """How many of its next answers are known, and all alike: consistent."""
        if self._left == 0:
            try:
                self._left, self._step = next(self._answers)
            except ValueError as error:
                raise ValueError(f"observer {self.name!r}: {error}") from error
        return self._left if self._step.verdict == "consistent" else 0

    def take(self, samples: int) -> Step:
        """Its answer at the last of its next samples; more than one only if they are plain."""
        self._left -= samples
        if self._left == 0:
            return self._step
        return replace(self._step, sample=self._step.sample - self._left, stopped=0)
