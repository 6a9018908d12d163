"""Shares and delays over many runs, with their confidence intervals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from scipy import special  # scipy.stats has the same quantiles, and takes a second to load

CONFIDENCE = 0.95
Row = TypeVar("Row")


def grouped(rows: Iterable[Row], *columns: str) -> dict[Any, list[Row]]:
    """Rows of runs that did not fail, by their values in some columns, in the order in which these come first."""
    groups: dict[Any, list[Row]] = {}
    for row in rows:
        if getattr(row, "error", None) is None:
            groups.setdefault(tuple(getattr(row, name) for name in columns), []).append(row)
    return groups


@dataclass(frozen=True)
class Share:
    """How many of how many, with a confidence interval (Clopper and Pearson, exact for a binomial count)."""

    count: int
    of: int

    @property
    def value(self) -> float:
        return self.count / self.of

    @classmethod
    def true(cls, flags: Sequence[bool | None]) -> Share:
        """How many of some flags are true."""
        return cls(sum(map(bool, flags)), len(flags))

    @property
    def interval(self) -> tuple[float, float]:
        """Bounds of the share at the confidence of the module, 95 %."""
        tail = (1 - CONFIDENCE) / 2
        low = special.betaincinv(self.count, self.of - self.count + 1, tail) if self.count else 0.0
        high = special.betaincinv(self.count + 1, self.of - self.count, 1 - tail) if self.count < self.of else 1.0
        return float(low), float(high)


@dataclass(frozen=True)
class Delays:
    """Delays of some runs [s], those that were never reached counted as infinite.

    Attributes
    ----------
    reached : Share
        Runs in which the delay is finite.
    mean : float or None
        Over the runs that reached; None if none did.
    mean_interval : (low, high) or None
        Student's 95 % confidence interval of that mean; None with fewer than two values.
    median, p05, p95 : float or None
        Over ALL runs; None where the quantile falls among those that never reached.
    """

    reached: Share
    mean: float | None
    mean_interval: tuple[float, float] | None
    median: float | None
    p05: float | None
    p95: float | None

    @classmethod
    def of(cls, delays: Sequence[float | None]) -> Delays:
        """Statistics of delays, None for one that was never reached."""
        finite = np.array([d for d in delays if d is not None])
        median, p05, p95 = (_quantile(delays, q) for q in (0.5, 0.05, 0.95))
        mean = float(finite.mean()) if finite.size else None
        return cls(Share(finite.size, len(delays)), mean, _mean_interval(finite), median, p05, p95)


def _quantile(delays: Sequence[float | None], q: float) -> float | None:
    values = np.sort([np.inf if d is None else d for d in delays])
    position = q * (len(values) - 1)
    below, above = values[int(np.floor(position))], values[int(np.ceil(position))]
    if not np.isfinite(above):
        return None
    return float(below + (above - below) * (position % 1))


def _mean_interval(values: np.ndarray) -> tuple[float, float] | None:
    if values.size < 2:
        return None
    half = special.stdtrit(values.size - 1, (1 + CONFIDENCE) / 2) * values.std(ddof=1) / np.sqrt(values.size)
    return float(values.mean() - half), float(values.mean() + half)
