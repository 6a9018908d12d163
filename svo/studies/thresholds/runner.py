"""Run a study of interval detectors in processes, run by run, so that a kill loses only the runs in flight."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from svo.studies.cluster import outcomes_on_cluster
from svo.studies.configuration import Job, StudyConfiguration
from svo.studies.isolation.run import failure_named, registered_plant
from svo.studies.isolation.store import StudyStore
from svo.studies.processes import worker_processes
from svo.studies.thresholds.run import DetectorRow, LearnsDetectors, execute

Progress = Callable[[int, int], None]


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
    resume: bool = False,
    progress: Progress | None = None,
) -> DetectorStudyFolder:
    """Run what is still to be run of a study and store it; parameters and errors as of the isolation study.

    Raises
    ------
    TypeError
        If the plant has no interval detectors to learn.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; expected at least 1 process")
    plant = registered_plant(configuration.plant)
    if not isinstance(plant, LearnsDetectors):
        raise TypeError(f"plant {configuration.plant!r} has no interval detectors; it lacks members of LearnsDetectors")
    folder = DetectorStudyFolder(Path(out))
    jobs = configuration.jobs(plant)
    with folder.open(configuration, [job.run for job in jobs], resume) as done:
        to_do = [job for job in jobs if job.run not in done]
        if progress is not None:
            progress(len(jobs) - len(to_do), len(jobs))
        results = _results(configuration.plant, to_do, workers, scheduler)
        for count, rows in enumerate(results, len(jobs) - len(to_do) + 1):
            folder.store(rows[0].run, rows, configuration)
            if progress is not None:
                progress(count, len(jobs))
        folder.join_alarms()
    return folder


def read_rows(folder: StudyStore[Any], without_damaged: bool = False) -> list[DetectorRow]:
    """The run table, in the order of the runs; errors as `StudyStore.rows`."""
    return DetectorStudyFolder(folder.path).rows(without_damaged)


def _results(name: str, jobs: list[Job], workers: int, scheduler: str | None) -> Iterator[list[DetectorRow]]:
    """The rows of each run, wherever it runs; on a cluster in the order in which they are done."""
    work = functools.partial(_execute, name)
    if scheduler is not None and jobs:
        yield from outcomes_on_cluster(work, jobs, scheduler)
        return
    if workers == 1 or len(jobs) < 2:
        yield from map(work, jobs)
        return
    with worker_processes(workers) as pool:
        yield from pool.map(work, jobs, chunksize=4)


def _execute(name: str, job: Job) -> list[DetectorRow]:
    plant = registered_plant(name)
    assert isinstance(plant, LearnsDetectors)
    with failure_named(job):
        return execute(plant, job)
