"""The folder of a study of isolation times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from svo.isolation import write_alarms
from svo.studies.isolation.exemplar import Exemplar
from svo.studies.isolation.run import RunOutcome, RunRow
from svo.studies.store import ALARMS, SAMPLES, StudyStore, Written


@dataclass(frozen=True)
class StudyFolder(StudyStore[RunRow]):
    """The folder of a study of isolation times."""

    row = RunRow

    def contents(self, outcome: RunOutcome) -> tuple[Sequence[RunRow], Written]:
        files: dict[str, Callable[[Path], Any]] = {}
        if outcome.alarms:
            files[ALARMS] = lambda file: write_alarms(file, outcome.alarms)
        if outcome.exemplar is not None:
            files[SAMPLES] = outcome.exemplar.save
        return [outcome.row], files

    def exemplars(self, without_damaged: bool = False) -> list[Exemplar]:
        """The exemplary runs; errors as `rows`."""
        return [Exemplar.load(self.samples(run)) for run in self.with_samples(without_damaged)]
