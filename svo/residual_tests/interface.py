"""What all residual tests share: batch and online runs, windows, and residuals that are missing."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes.shown import Shown
from svo.checks import Array, expect, is_count, is_finite_number, readings, real_array


class Decision(NamedTuple):
    """The answer at one sample: the statistic (NaN while there are too few samples), and whether it is an alarm."""

    statistic: float
    alarm: bool


@dataclass(frozen=True)
class DecisionRecord(Shown):
    """Answers over K samples: statistic (K,), NaN while there are too few samples, and alarm (K,) of bool."""

    statistic: Array
    alarm: NDArray[np.bool_]


class ResidualTest(Shown, ABC):
    """A test of H0, "the mean of the residual is as without a fault", against H1 (equation (44)).

    A test is a frozen description and keeps no data; `start` gives something to feed sample by sample. A residual that
    is NaN is a sample that is not there: the answer before it stands, and nothing else changes.
    """

    def run(self, residual: ArrayLike) -> DecisionRecord:
        """All samples at once.

        Parameters
        ----------
        residual : (K,) array
            NaN where there is none.

        Raises
        ------
        ValueError
            If the residual has another shape, or is infinite.
        """
        r = _checked(residual)
        there = ~np.isnan(r)
        statistic, alarm = self._run(r[there])
        latest = np.cumsum(there)  # answers so far; 0 is "none yet"
        return DecisionRecord(np.append(np.nan, statistic)[latest], np.append(False, alarm)[latest])

    def start(self) -> OnlineTest:
        """A run of its own, sample by sample."""
        return OnlineTest(self)

    @abstractmethod
    def _run(self, r: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Statistic and alarm over finite samples."""

    @abstractmethod
    def _begin(self) -> Any:
        """The state before the first sample."""

    @abstractmethod
    def _advance(self, state: Any, r: float) -> tuple[Any, Decision]:
        """The next state and answer, for a finite sample."""


class OnlineTest(Shown):
    """One run of a test, sample by sample; `ResidualTest.start` makes it."""

    def __init__(self, test: ResidualTest) -> None:
        self._test = test
        self._state = test._begin()
        self._latest = Decision(np.nan, False)

    def step(self, r: float) -> Decision:
        """The answer at the next sample.

        Raises
        ------
        ValueError
            If r is infinite.
        """
        r = r if isinstance(r, float) else float(readings("r", r, ()))
        if np.isinf(r):
            raise ValueError(f"r is {r}; expected a finite residual, or NaN where there is none")
        if not np.isnan(r):
            self._state, self._latest = self._test._advance(self._state, float(r))
        return self._latest


class WindowTest(ResidualTest):
    """A test whose statistic is a function of the last ``samples`` residuals, compared with a threshold."""

    samples: int

    @property
    @abstractmethod
    def threshold(self) -> float:
        """An alarm is a statistic above it."""

    @abstractmethod
    def _statistics(self, windows: Array) -> Array:
        """Statistic (m,) of windows (m, samples)."""

    def _run(self, r: Array) -> tuple[Array, NDArray[np.bool_]]:
        statistic = np.full(r.size, np.nan)
        if r.size >= self.samples:
            windows = np.lib.stride_tricks.sliding_window_view(r, self.samples)
            statistic[self.samples - 1 :] = self._statistics(windows)
        return statistic, above(statistic, self.threshold)

    def _begin(self) -> Array:
        return np.empty(0)

    def _advance(self, state: Array, r: float) -> tuple[Array, Decision]:
        window = np.append(state, r)[-self.samples :]
        if window.size < self.samples:
            return window, Decision(np.nan, False)
        statistic = float(self._statistics(window[None])[0])
        return window, Decision(statistic, statistic > self.threshold)


def row_sums(windows: Array) -> Array:
    """Sums (m,) of rows, term by term in their order: of a row alone the same bits as of the row among others."""
    total = windows[:, 0].copy()
    for column in windows.T[1:]:
        total += column
    return total


def above(statistic: Array, threshold: float) -> NDArray[np.bool_]:
    """Where the statistic is there and above the threshold."""
    return np.greater(statistic, threshold, where=~np.isnan(statistic), out=np.zeros(statistic.shape, dtype=bool))


def check_finite(**values: float) -> None:
    """Refuse numbers that are not finite."""
    for name, value in values.items():
        expect(is_finite_number(value), name, value, "a finite number")


def check_positive(**values: float) -> None:
    """Refuse numbers that are not finite and positive."""
    for name, value in values.items():
        expect(is_finite_number(value) and value > 0, name, value, "a positive number")


def check_probability(**values: float) -> None:
    """Refuse numbers outside (0, 1)."""
    for name, value in values.items():
        expect(is_finite_number(value) and 0 < value < 1, name, value, "a probability between 0 and 1, both excluded")


def check_count(name: str, value: int, least: int) -> None:
    """Refuse what is not a whole number of at least so much."""
    expect(is_count(value, least), name, value, f"a whole number >= {least}")


def _checked(residual: ArrayLike) -> Array:
    meaning = "since a test takes one residual: run one for each"
    r = real_array("residual", residual, ("K",), meaning=meaning, finite=False, missing=True)
    if np.isinf(r).any():
        raise ValueError(f"residual[{int(np.argmax(np.isinf(r)))}] is infinite; expected finite numbers or NaN")
    return r
