"""Isolation by order in time: what Boolean signatures can't tell apart is told apart if the faults come one by one.

The residuals beyond their adaptive bounds are conflicts: at least one input on which each depends is faulty. As soon as
one input alone explains them all, it is isolated. The size of its fault is then bounded by intersection over a short
time, the computed input is replaced by what the faulty actuator achieves, and the residuals start afresh: the next
fault shows as if it were the first. Assumed: no two faults begin within one isolation and identification.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aircraft.missile.adaptive import ModelError
from aircraft.missile.airframe import INPUTS, Airframe
from aircraft.missile.isolability import diagnoses
from aircraft.missile.redundancy import ETA, TABLE_1, ForceBalance, signature_matrix
from svo.checks import Array

Kind = Literal["locking", "loss"]

IDENTIFICATION_SAMPLES = 100
LEAST_PROPULSION = 0.05  # below it a measured rate says nothing of the factor


@dataclass(frozen=True)
class SequentialFault:
    """One fault, found after those before it.

    Attributes
    ----------
    input : str
    kind : "locking" (a fin) or "loss" (the propulsion)
    detected, isolated : int
        Samples at which the first residual left its bounds, and at which the input was the only explanation.
    lower, upper : float
        Bounds of the locked deflection [rad], or of the effectiveness k = u_a / u_c that is left.
    """

    input: str
    kind: Kind
    detected: int
    isolated: int
    lower: float
    upper: float

    def achieved(self, computed: Array) -> tuple[Array, Array]:
        """Middle and half-width of what the faulty actuator achieves, for computed inputs (K,)."""
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        if self.kind == "locking":
            return np.full_like(computed, middle), np.full_like(computed, half)
        return middle * computed, half * np.abs(computed)


@dataclass(frozen=True)
class FaultSequence:
    """Faults in the order of time.

    Attributes
    ----------
    faults : tuple of SequentialFault
    open : tuple of tuple of str
        The smallest fault sets that explain conflicts left without a single explanation at the end.
    unexplained_at : int or None
        Sample at which nothing explained the data any more: a fault of another kind, several at once, or bounds that
        do not hold. The search ends there.
    """

    faults: tuple[SequentialFault, ...]
    open: tuple[tuple[str, ...], ...] = ()
    unexplained_at: int | None = None

    @property
    def order(self) -> tuple[str, ...]:
        return tuple(fault.input for fault in self.faults)


def isolate_in_order(
    y: ArrayLike,
    u: ArrayLike,
    airframe: Airframe,
    error: ModelError,
    identification: int = IDENTIFICATION_SAMPLES,
) -> FaultSequence:
    """Find faults one after the other along a log.

    Parameters
    ----------
    y, u : (K, 15), (K, 4) arrays
        Measurements, and the computed inputs of the instants that they are of (NaN where there is none).
    airframe : Airframe
        What is believed of the missile.
    error : ModelError
        What else may be wrong.
    identification : int
        Samples from an isolation on that bound the size of the fault.
    """
    search = _Search.over(np.asarray(y, dtype=float), np.asarray(u, dtype=float), airframe, error)
    found: dict[str, SequentialFault] = {}
    start = 0
    while start < len(search.u):
        alarms = search.alarms(found)
        event = search.next_event(alarms, start, found)
        if event is None:
            return FaultSequence(tuple(found.values()), search.open_explanations(alarms, start, found))
        detected, isolated, name = event
        if name is None:
            return FaultSequence(tuple(found.values()), unexplained_at=isolated)
        end = min(isolated + identification, len(search.u))
        fault = search.identified(name, detected, isolated, end, found)
        if fault.lower > fault.upper:
            return FaultSequence(tuple(found.values()), unexplained_at=end - 1)
        found[name] = fault
        start = end
    return FaultSequence(tuple(found.values()))


@dataclass(frozen=True)
class _Search:
    u: Array
    balance: ForceBalance
    bounds: Array  # (K, 3) of the imbalance
    weights: Array  # (K, R, 3) of the residuals of Table I
    supports: tuple[frozenset[str], ...]

    @classmethod
    def over(cls, y: Array, u: Array, airframe: Airframe, error: ModelError) -> _Search:
        balance = ForceBalance.of(y, airframe)
        signature = signature_matrix(airframe)
        supports = tuple(frozenset(n for n, on in zip(INPUTS, row, strict=True) if on) for row in signature)
        return cls(u, balance, error.imbalance_bounds(y, airframe), balance.weights(TABLE_1), supports)

    def accommodated(self, found: Mapping[str, SequentialFault]) -> tuple[Array, Array]:
        """Inputs with the known faults put in, and the half-widths of what is not known of them, (K, 4) each."""
        inputs, half = self.u.copy(), np.zeros_like(self.u)
        for name, fault in found.items():
            j = INPUTS.index(name)
            inputs[:, j], half[:, j] = fault.achieved(self.u[:, j])
        return inputs, half

    def evaluate(self, weights: Array, found: Mapping[str, SequentialFault]) -> tuple[Array, Array]:
        """Residuals and their bounds (K, R), the known faults taken into account."""
        inputs, half = self.accommodated(found)
        values = np.einsum("kri,ki->kr", weights, self.balance.imbalance(inputs))
        through = np.abs(np.einsum("kri,kij->krj", weights, self.balance.G))
        return values, np.einsum("kri,ki->kr", np.abs(weights), self.bounds) + np.einsum("krj,kj->kr", through, half)

    def alarms(self, found: Mapping[str, SequentialFault]) -> NDArray[np.bool_]:
        values, bounds = self.evaluate(self.weights, found)
        return np.abs(values) > bounds

    def next_event(
        self, alarms: NDArray[np.bool_], start: int, found: Mapping[str, SequentialFault]
    ) -> tuple[int, int, str | None] | None:
        """(detected, isolated, input) of the next fault; input None if nothing explains the alarms."""
        detected: int | None = None
        for k, conflicts in self._conflicts(alarms, start, found):
            detected = k if detected is None else detected
            explanations = diagnoses(conflicts)
            if not explanations:
                return detected, k, None
            if len(explanations) == 1 and len(explanations[0]) == 1:
                return detected, k, explanations[0][0]
        return None

    def open_explanations(
        self, alarms: NDArray[np.bool_], start: int, found: Mapping[str, SequentialFault]
    ) -> tuple[tuple[str, ...], ...]:
        events = list(self._conflicts(alarms, start, found))
        return diagnoses(events[-1][1]) if events else ()

    def _conflicts(
        self, alarms: NDArray[np.bool_], start: int, found: Mapping[str, SequentialFault]
    ) -> Iterator[tuple[int, list[frozenset[str]]]]:
        """(sample, all conflicts so far) at each sample at which a residual alarms for the first time."""
        seen = [(int(np.argmax(column)) + start, r) for r, column in enumerate(alarms[start:].T) if column.any()]
        conflicts: list[frozenset[str]] = []
        for k in sorted({sample for sample, _ in seen}):
            conflicts = [*conflicts, *(self.supports[r] - found.keys() for sample, r in seen if sample == k)]
            yield k, conflicts

    def identified(
        self, name: str, detected: int, isolated: int, end: int, found: Mapping[str, SequentialFault]
    ) -> SequentialFault:
        """The fault with bounds of its size: every residual that depends on this input bounds what it achieves."""
        j, during = INPUTS.index(name), slice(detected, end)
        values, bounds = self.evaluate(self.weights, found)
        depends = [r for r, support in enumerate(self.supports) if name in support]
        share = np.einsum("kri,ki->kr", self.weights, self.balance.G[:, :, j])[during, depends]
        achieved = self.u[during, j, None] + values[during, depends] / share
        half = bounds[during, depends] / np.abs(share)
        kind: Kind = "loss" if j == ETA else "locking"
        if kind == "loss":
            used = self.u[during, j] > LEAST_PROPULSION
            achieved, half = (part[used] / self.u[during, j, None][used] for part in (achieved, half))
        lower, upper = float(np.nanmax(achieved - half)), float(np.nanmin(achieved + half))
        return SequentialFault(name, kind, detected, isolated, lower, upper)
