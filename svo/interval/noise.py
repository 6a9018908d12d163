"""Characterisation of a noise by the extremes of its moving averages (paper 001, equations (5)-(7))."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes.native import Address, Entries, Given, Integer, function, scratch
from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, expect, real_array
from svo.interval.power_law import DEFAULT_EXPONENTS, PowerLaw, smallest_power_law
from svo.interval.thresholds import checked_bounds, threshold_sequence

_extreme_sums = function("fdi_extreme_sums", *[Integer] * 2, Given, *[Entries] * 2, Address)
_extreme_sums_room = function("fdi_extreme_sums_room", Integer, returns=Integer)


@dataclass(frozen=True, eq=False)
class CharacterizationCheck(Shown):
    """Whether other records keep to a characterisation: assumption (7), q by q.

    Attributes
    ----------
    observed : (qbar,) array
        Largest moving average of the records over q samples, in size; NaN where no record is that long.
    bounds : (qbar,) array
        lambda_q of the characterisation.
    """

    observed: Array
    bounds: Array

    @property
    def violated(self) -> NDArray[np.int64]:
        """The window lengths q at which (7) fails, in order."""
        return np.flatnonzero(self.observed > self.bounds) + 1

    @property
    def holds(self) -> bool:
        return not self.violated.size

    @property
    def ratio(self) -> Array:
        """observed / bounds, (qbar,): above one where (7) fails; 0 / 0 is 0."""
        bounds = np.where(self.bounds > 0, self.bounds, 1.0)
        return np.where(self.bounds > 0, self.observed / bounds, np.where(self.observed > 0, np.inf, self.observed))


@dataclass(frozen=True, eq=False)
class NoiseCharacterization(Shown):
    """Bounds lambda_q of a signal's moving averages over q = 1..qbar samples.

    Attributes
    ----------
    bounds : (qbar,) array
        ``bounds[q - 1]`` is lambda_q >= 0.

    Notes
    -----
    Whatever is derived from it holds for signals that keep to it (assumption (7)). That is a statement about the
    future which no record proves: `check` it on other records.
    """

    bounds: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "bounds", checked_bounds(self.bounds))

    @classmethod
    @options_by_name
    def from_records(
        cls, records: ArrayLike | Sequence[ArrayLike], qbar: int, *, safety_factor: float = 1.2
    ) -> NoiseCharacterization:
        """lambda_q = safety_factor times the largest size of a mean of q samples in all records, full windows only.

        Parameters
        ----------
        records : (n,) array, or a sequence of them
            Signals of fault-free operation, in any number and of any lengths; NaN (no measurement) is left out.
        qbar : int
            Longest window; at least one record must be that long.
        safety_factor : float
            zeta > 1: room for what the records did not show.

        Raises
        ------
        ValueError
            For records that are too short or not finite, qbar < 1 or a safety factor <= 1.
        """
        expect(1 < safety_factor < np.inf, "safety_factor", safety_factor, "a number > 1, such as 1.2")
        signals = _signals(records)
        longest = max(s.size for s in signals)
        if not 1 <= qbar <= longest:
            raise ValueError(
                f"qbar is {qbar} with a longest record of {longest} samples; expected 1 <= qbar <= {longest}"
            )
        return cls(safety_factor * moving_average_extremes(signals, qbar))

    @property
    def qbar(self) -> int:
        """Longest window."""
        return int(self.bounds.size)

    @property
    def peak(self) -> float:
        """lambda_1, the bound of a single sample."""
        return float(self.bounds[0])

    @property
    def variability(self) -> float:
        """How fast the moving averages fall with their length: 0 (a constant signal) to 1.

        sum over q = 2..qbar of (1 - lambda_q / lambda_1) / q^2, normalised by the sum of 1 / q^2: the paper's v(u)
        normalises by the infinite sum, which a finite qbar never reaches. Zero also if lambda_1 is zero or qbar is 1.
        """
        if self.peak == 0 or self.qbar == 1:
            return 0.0
        weights = 1.0 / np.arange(2, self.qbar + 1) ** 2
        return float(weights @ (1 - self.bounds[1:] / self.peak) / weights.sum())

    def check(self, records: ArrayLike | Sequence[ArrayLike]) -> CharacterizationCheck:
        """Assumption (7) on other fault-free records: which lambda_q they exceed."""
        return CharacterizationCheck(moving_average_extremes(_signals(records), self.qbar), self.bounds)

    def thresholds(self, pole: float) -> Array:
        """Thresholds tau_k (qbar + 1,), k = 0..qbar, of the signal filtered with this pole, constant then (11)-(13)."""
        return threshold_sequence(self.bounds, pole)

    def power_law(self, exponents: ArrayLike = DEFAULT_EXPONENTS) -> PowerLaw:
        """The least alpha q^gamma + beta above all lambda_q, gamma of the exponents (k,); see `smallest_power_law`."""
        return smallest_power_law(self.bounds, exponents)


def moving_average_extremes(signals: Sequence[Array], qbar: int) -> Array:
    """Largest size of a mean over q samples in all signals, (qbar,); NaN where no signal has q samples.

    Time O(n qbar), vectorised by the compiler over q. Sums are kept in pairs of floats, so that each mean is the exact
    one rounded once (but for 1e-24 of the largest sample): those of a constant are that constant.
    """
    best, low = np.zeros(qbar), np.zeros(qbar)
    for signal in signals:
        _extreme_sums(signal.size, qbar, signal, best, low, scratch(_extreme_sums_room(qbar)))
    q = np.arange(1, qbar + 1)
    mean = best / q
    mean += (_remainder(best, mean, q) + low) / q
    mean[max(s.size for s in signals) :] = np.nan
    return mean


def _remainder(total: Array, mean: Array, count: NDArray[np.int64]) -> Array:
    """total - mean count, exactly up to one rounding: the product in two floats (Dekker)."""
    high = (mean * 134217729.0) - (mean * 134217729.0 - mean)
    product = mean * count
    return np.asarray((total - product) - ((high * count - product) + (mean - high) * count))


def _signals(records: ArrayLike | Sequence[ArrayLike]) -> list[Array]:
    several: Sequence[ArrayLike] = records  # type: ignore[assignment]
    single = len(several) > 0 and (several[0] is None or np.isscalar(several[0]) or getattr(several[0], "ndim", 1) == 0)
    found = []
    for i, record in enumerate([records] if single else several):
        signal = real_array(
            f"record {i}", record, ("n",), meaning="or a sequence of such records", finite=False, missing=True
        )
        signal = np.ascontiguousarray(signal[~np.isnan(signal)])
        if not signal.size or not np.isfinite(signal).all():
            raise ValueError(f"record {i} is empty or has infinite samples; expected finite numbers")
        found.append(signal)
    if not found:
        raise ValueError("records is empty; expected at least one record of fault-free operation")
    return found
