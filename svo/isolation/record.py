"""What a bank says at a sample, and over a whole log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from svo.isolation.logic import GLOBAL, StateName
from svo.observers.base import Certificate, Step


@dataclass(frozen=True, slots=True)
class Verdict:
    """The bank's conclusion at one sample.

    Attributes
    ----------
    sample : int
        Counted from the first measurement, which is sample 0.
    state : {"nominal", "detected", "isolated", "unexplained"}
    fault : str or None
        The fault that is isolated, None otherwise.
    alive : tuple of str
        Models that are not declared falsified.
    detected_at, isolated_at : int or None
        Sample at which the present fault was detected, and isolated.
    steps : mapping of str to Step
        Answers of the observers that were stepped or started, "global" among them if the bank has a global
        observer. Boxes and sets must be read before the next sample; those of an observer that was falsified
        and starts again have nothing to read.
    """

    sample: int
    state: StateName
    fault: str | None
    alive: tuple[str, ...]
    detected_at: int | None
    isolated_at: int | None
    steps: Mapping[str, Step]

    @property
    def stopped(self) -> int:
        """Programs of its steps that ended at a limit, as `Observer.stopped`."""
        return sum(step.stopped for step in self.steps.values())


@dataclass(frozen=True)
class BankRecord:
    """A run of a bank over a log of K samples; columns in the order of ``names``.

    Attributes
    ----------
    names : tuple of str
        "nominal", then the faults.
    states : tuple of str
        State of the bank at each sample.
    alive : (K, n_observers) array of bool
        Models not declared falsified, after each sample.
    seconds : (K, n_observers) array
        Wall time of each observer's step; NaN where it was not stepped.
    undecided : (K, n_observers) array of bool
        Answers that were neither a proof nor a point.
    stopped : (K, n_observers) array of int
        Programs that ended at a limit, as `Observer.stopped`; of samples taken at once, at the last.
    died_at : mapping of str to int or None
        First sample at which a model was declared falsified; "global" is there if its observer was.
    certificates : mapping of str to Certificate or None
        Proof of that falsification.
    detected_at, isolated_at : int or None
        FIRST sample of the run at which a fault was detected, and at which one was isolated.
    fault : str or None
        The fault that was isolated then.
    verdict : Verdict
        The bank's conclusion at the last sample, without steps.
    global_seconds : (K,) array or None
        Wall time of the global observer's step, NaN where it was not stepped; None if the bank has none.
    """

    names: tuple[str, ...]
    states: tuple[StateName, ...]
    alive: NDArray[np.bool_]
    seconds: NDArray[np.float64]
    undecided: NDArray[np.bool_]
    stopped: NDArray[np.int64]
    died_at: Mapping[str, int | None]
    certificates: Mapping[str, Certificate | None]
    detected_at: int | None
    isolated_at: int | None
    fault: str | None
    verdict: Verdict
    global_seconds: NDArray[np.float64] | None = None


class Recorder:
    """Collects the verdicts of a run without keeping their steps."""

    def __init__(self, names: tuple[str, ...], samples: int) -> None:
        self._names = names
        self._states: list[StateName] = []
        self._alive = np.zeros((samples, len(names)), dtype=bool)
        self._seconds = np.full((samples, len(names)), np.nan)
        self._undecided = np.zeros((samples, len(names)), dtype=bool)
        self._stopped = np.zeros((samples, len(names)), dtype=np.int64)
        self._died_at: dict[str, int | None] = dict.fromkeys(names)
        self._certificates: dict[str, Certificate | None] = dict.fromkeys(names)
        self._detected_at: int | None = None
        self._isolated_at: int | None = None
        self._fault: str | None = None
        self._global_seconds: NDArray[np.float64] | None = None
        self._verdict: Verdict

    def add(self, verdict: Verdict, samples: int = 1) -> None:
        """The next sample; or the next ``samples``, of whose last the verdict is and at which nothing changed."""
        k, self._verdict = verdict.sample, verdict
        rows = slice(k + 1 - samples, k + 1)
        self._states += [verdict.state] * samples
        for i, name in enumerate(self._names):
            step = verdict.steps.get(name)
            self._alive[rows, i] = name in verdict.alive
            if step is not None:
                self._seconds[rows, i] = step.seconds
                self._undecided[rows, i] = step.verdict == "undecided"
                self._stopped[k, i] = step.stopped
                if self._died_at[name] is None and not self._alive[k, i]:
                    self._died_at[name], self._certificates[name] = k, step.certificate
        if GLOBAL in verdict.steps:
            self._add_global(verdict, verdict.steps[GLOBAL])
        if self._detected_at is None:
            self._detected_at = verdict.detected_at
        if self._isolated_at is None:
            self._isolated_at, self._fault = verdict.isolated_at, verdict.fault

    def _add_global(self, verdict: Verdict, step: Step) -> None:
        if self._global_seconds is None:
            self._global_seconds = np.full(len(self._alive), np.nan)
        self._global_seconds[verdict.sample] = step.seconds
        declared = step.verdict == "falsified" and verdict.state == "unexplained"
        if declared and GLOBAL not in self._died_at:
            self._died_at[GLOBAL], self._certificates[GLOBAL] = verdict.sample, step.certificate

    def record(self) -> BankRecord:
        """Everything so far."""
        return BankRecord(
            names=self._names,
            states=tuple(self._states),
            alive=self._alive,
            seconds=self._seconds,
            undecided=self._undecided,
            stopped=self._stopped,
            died_at=self._died_at,
            certificates=self._certificates,
            detected_at=self._detected_at,
            isolated_at=self._isolated_at,
            fault=self._fault,
            verdict=replace(self._verdict, steps={}),
            global_seconds=self._global_seconds,
        )
