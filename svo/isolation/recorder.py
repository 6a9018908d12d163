"""What a run of a bank comes to, as it goes on."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from svo.isolation.logic import GLOBAL, StateName
from svo.isolation.record import BankRecord, Replay, Verdict
from svo.logs.log import Log
from svo.models import Labels
from svo.observers.base import Certificate, Step


class Change(NamedTuple):
    """From a sample on a bank's state, and the models that it does not declare falsified."""

    sample: int
    state: StateName
    alive: tuple[str, ...]


class Outcome:
    """What a run comes to, without what is said at each sample: a run of any length needs no more memory.

    Attributes
    ----------
    names, died_at, certificates, detected_at, isolated_at, fault
        As those of `BankRecord`.
    changes : list of Change
    undecided, stopped : int
        Over all samples and the observers of ``names``.
    reason : str or None
        Of the first undecided answer that has one: the observer, the sample, and why.
    verdict : Verdict
        The latest one.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.died_at: dict[str, int | None] = dict.fromkeys(names)
        self.certificates: dict[str, Certificate | None] = dict.fromkeys(names)
        self.detected_at: int | None = None
        self.isolated_at: int | None = None
        self.fault: str | None = None
        self.changes: list[Change] = []
        self.undecided = self.stopped = 0
        self.reason: str | None = None
        self.verdict: Verdict

    def add(self, verdict: Verdict, samples: int = 1) -> None:
        """The next sample; or the next ``samples``, of whose last the verdict is and at which nothing changed."""
        self.verdict = verdict
        now = Change(verdict.sample + 1 - samples, verdict.state, verdict.alive)
        if not self.changes or self.changes[-1][1:] != now[1:]:
            self.changes.append(now)
        for name, step in verdict.steps.items():
            if name in self.names:
                if step.verdict == "undecided":
                    self.undecided += 1
                    self.reason = self.reason or _reason(name, step, verdict.sample)
                self.stopped += step.stopped
                is_dead = name not in verdict.alive
            else:
                is_dead = step.verdict == "falsified" and verdict.state == "unexplained"
            if is_dead and self.died_at.get(name) is None:
                self.died_at[name], self.certificates[name] = verdict.sample, step.certificate
        if self.detected_at is None:
            self.detected_at = verdict.detected_at
        if self.isolated_at is None:
            self.isolated_at, self.fault = verdict.isolated_at, verdict.fault


def _reason(name: str, step: Step, sample: int) -> str | None:
    """Who is undecided, when and why; an observer that started late counts samples of its own."""
    if step.reason is None:
        return None
    when = f"at sample {sample}"
    why = step.reason.replace(f"at sample {step.sample},", f"{when},")
    return f"{name}, {why}" if when in why else f"{name} {when}, {why}"


class Recorder(Outcome):
    """Collects the verdicts of a run without keeping their steps."""

    def __init__(self, names: tuple[str, ...], log: Log, labels: Labels, replay: Replay) -> None:
        super().__init__(names)
        samples = len(log)
        self._log, self._labels, self._replay = log, labels, replay
        self._states: list[StateName] = []
        self._alive = np.zeros((samples, len(names)), dtype=bool)
        self._seconds = np.full((samples, len(names)), np.nan)
        self._undecided = np.zeros((samples, len(names)), dtype=bool)
        self._stopped = np.zeros((samples, len(names)), dtype=np.int64)
        self._global_seconds: NDArray[np.float64] | None = None

    def add(self, verdict: Verdict, samples: int = 1) -> None:
        super().add(verdict, samples)
        k = verdict.sample
        rows = slice(k + 1 - samples, k + 1)
        self._states += [verdict.state] * samples
        for i, name in enumerate(self.names):
            step = verdict.steps.get(name)
            self._alive[rows, i] = name in verdict.alive
            if step is not None:
                self._seconds[rows, i] = step.seconds
                self._undecided[rows, i] = step.verdict == "undecided"
                self._stopped[k, i] = step.stopped
        if GLOBAL in verdict.steps:
            if self._global_seconds is None:
                self._global_seconds = np.full(len(self._alive), np.nan)
            self._global_seconds[k] = verdict.steps[GLOBAL].seconds

    def record(self) -> BankRecord:
        """Everything so far."""
        return BankRecord(
            names=self.names,
            states=tuple(self._states),
            alive=self._alive,
            seconds=self._seconds,
            undecided=self._undecided,
            stopped=self._stopped,
            died_at=self.died_at,
            certificates=self.certificates,
            detected_at=self.detected_at,
            isolated_at=self.isolated_at,
            fault=self.fault,
            verdict=replace(self.verdict, steps={}),
            log=self._log,
            labels=self._labels,
            replay=self._replay,
            global_seconds=self._global_seconds,
            reason=self.reason,
        )
