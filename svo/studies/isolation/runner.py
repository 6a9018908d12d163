"""Run a study in processes: the same rows for any number of workers, and a kill loses only the runs in flight."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from time import perf_counter

import polytopes
from svo.plant import HEALTHY, Plant
from svo.studies.cluster import on_cluster
from svo.studies.configuration import Job, StudyConfiguration
from svo.studies.isolation.run import registered_plant, run_registered
from svo.studies.isolation.store import StudyFolder
from svo.studies.processes import worker_processes

Progress = Callable[[int, int], None]


def run_study(
    configuration: StudyConfiguration,
    out: str | Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> StudyFolder:
    """Run what is still to be run of a study and store it, run by run.

    The plant is found by its name in the registry, in every process. Call `warm_up` first where numba may still
    have to compile, or each worker compiles the same code.

    Parameters
    ----------
    configuration : StudyConfiguration
    out : path
        A folder that is new or empty, or holds this very study if ``resume``.
    workers : int
        Number of processes; 1 runs in this one.
    scheduler : str, optional
        Address of a ``dask.distributed`` scheduler: its workers run the study instead (see `svo.studies.cluster`).
    resume : bool
        Go on with the study in ``out``.
    progress : callable, optional
        Called with (runs done, runs in all), at the start and after every run.

    Returns
    -------
    StudyFolder
        With the rows, alarms and exemplary runs.

    Raises
    ------
    ValueError
        If the folder cannot be used (see `StudyFolder.open`), ``workers`` is below 1, or no cluster answers.
    RuntimeError
        If a run fails or a worker process of this machine dies; the runs that are done are kept.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; expected at least 1 process")
    folder = StudyFolder(Path(out))
    jobs = configuration.jobs(registered_plant(configuration.plant))
    with folder.open(configuration, [job.run for job in jobs], resume) as done:
        to_do = [job for job in jobs if job.run not in done]
        if progress is not None:
            progress(len(jobs) - len(to_do), len(jobs))
        finished = _finished(configuration, folder, to_do, workers, scheduler)
        for count, _ in enumerate(finished, start=len(jobs) - len(to_do) + 1):
            if progress is not None:
                progress(count, len(jobs))
        folder.join_alarms()
    return folder


def warm_up(plant: Plant, noise: str) -> float:
    """Compile what a study needs: simulator, observers and, for the pictures, sets; returns the seconds it took."""
    begun = perf_counter()
    plant.simulate(HEALTHY, HEALTHY, noise, 0)
    plant.bank(noise).warm_up()
    polytopes.warm_up()
    return perf_counter() - begun


def _finished(
    configuration: StudyConfiguration, folder: StudyFolder, jobs: list[Job], workers: int, scheduler: str | None
) -> Iterator[int]:
    """Numbers of the jobs as they are done and stored, wherever they run."""
    if scheduler is not None and jobs:
        return on_cluster(configuration, folder, jobs, scheduler)
    if workers > 1 and len(jobs) > 1:
        return _in_processes(configuration, folder, jobs, workers)
    return _here(configuration, folder, jobs)


def _here(configuration: StudyConfiguration, folder: StudyFolder, jobs: list[Job]) -> Iterator[int]:
    for job in jobs:
        yield _run(configuration, folder, job)


def _in_processes(
    configuration: StudyConfiguration, folder: StudyFolder, jobs: list[Job], workers: int
) -> Iterator[int]:
    waiting = iter(jobs)
    running: set[Future[int]] = set()
    try:
        with worker_processes(workers) as pool:
            while True:
                # Few runs are handed out ahead, so that an interruption does not leave a long queue.
                for job in waiting:
                    running.add(pool.submit(_run, configuration, folder, job))
                    if len(running) >= 2 * workers:
                        break
                if not running:
                    return
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
    except BrokenProcessPool as error:
        raise RuntimeError(
            "a worker process died (killed, or out of memory); the runs that are done are kept, resume to go on"
        ) from error


def _run(configuration: StudyConfiguration, folder: StudyFolder, job: Job) -> int:
    folder.write(run_registered(configuration.plant, job), configuration)
    return job.run
