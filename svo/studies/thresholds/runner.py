"""Run a study of interval detectors, as one of isolation times."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from svo.studies.configuration import Job, StudyConfiguration
from svo.studies.engine import Place, Progress
from svo.studies.runs import registered_plant, run_into
from svo.studies.store import StudyStore
from svo.studies.thresholds.run import DetectorRow, LearnsDetectors, execute


@dataclass(frozen=True)
class DetectorStudyFolder(StudyStore[DetectorRow]):
    """The folder of a study of interval detectors."""

    row = DetectorRow


def run_detection_study(
    configuration: StudyConfiguration,
    out: str | Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    limit: float | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    progress: Progress | None = None,
) -> DetectorStudyFolder:
    """Run what is still to be run of a study and store it; parameters and errors as of the isolation study.

    Raises
    ------
    TypeError
        If the plant has no interval detectors to learn.
    """
    place = Place(workers, scheduler, limit)
    if not isinstance(registered_plant(configuration.plant), LearnsDetectors):
        raise TypeError(f"plant {configuration.plant!r} has no interval detectors; it lacks members of LearnsDetectors")
    folder = DetectorStudyFolder(Path(out))
    run_into(folder, run_registered, configuration, place, resume=resume, retry_failed=retry_failed, progress=progress)
    return folder


def read_rows(folder: StudyStore[Any], without_damaged: bool = False) -> list[DetectorRow]:
    """The run table, in the order of the runs; errors as `StudyStore.rows`."""
    return DetectorStudyFolder(folder.path).rows(without_damaged)


def run_registered(name: str, job: Job) -> list[DetectorRow]:
    """One run of a registered plant, in whatever process."""
    plant = registered_plant(name)
    assert isinstance(plant, LearnsDetectors)
    return execute(plant, job)
