"""Studies of simulated runs of a plant, whatever is judged in them: what is run, where, and what failed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any

from svo.plant import Plant
from svo.plant.description.find import plant_to_simulate
from svo.studies.added import added_failures, added_study, publish_added, run_added
from svo.studies.configuration import Job, StudyConfiguration
from svo.studies.engine import Place, Progress, complete, within
from svo.studies.store import StudyStore


@cache
def registered_plant(name: str) -> Plant:
    """A plant by its name; loaded once a process, since its tables may take a while."""
    return plant_to_simulate(name)


def run_into(
    folder: StudyStore[Any],
    work: Callable[[str, Job], Any],
    configuration: StudyConfiguration,
    place: Place,
    *,
    resume: bool = False,
    retry_failed: bool = False,
    progress: Progress | None = None,
) -> None:
    """Run what is still to be run of a study and store it, run by run; ``work`` takes the plant's name and a job."""
    plant = registered_plant(configuration.plant)
    jobs, added = configuration.jobs(plant), added_study(plant, configuration)
    told = partial(within, progress, len(jobs) + (len(added.jobs) if added else 0))
    with folder.open(configuration, len(jobs), resume=resume, retry_failed=retry_failed) as done:

        def keep(number: int, outcome: Any) -> None:
            folder.keep(configuration, jobs[number], outcome)

        complete(partial(work, configuration.plant), jobs, done, keep, place, told(0))
        folder.join_alarms()
        if added:
            run_added(added, folder.path, place, retry_failed=retry_failed, progress=told(len(jobs)))


def failures(rows: Sequence[Any]) -> list[str]:
    """A line for each run that failed: which one, and why."""
    return [
        f"run {row.run} (fault {row.fault}, profile {row.profile}, noise {row.noise}, seed {row.seed}) failed: "
        f"{row.error}"
        for row in rows
        if row.error is not None
    ]


def all_failures(folder: StudyStore[Any], plant: Plant) -> list[str]:
    """Those of a study and of what its plant adds to it."""
    added = added_study(plant, StudyConfiguration.from_dict(folder.identity()["configuration"]))
    return failures(folder.rows()) + (added_failures(added, folder.path) if added else [])


def publish_beside(folder: StudyStore[Any], plant: Plant, rows: Sequence[Any]) -> list[str]:
    """Write the tables of what a plant adds to a study of these rows; a line for each failure in both."""
    added = added_study(plant, StudyConfiguration.from_dict(folder.identity()["configuration"]))
    return failures(rows) + (publish_added(added, folder.path) if added else [])


def finished_runs(rows: Sequence[Any]) -> list[Any]:
    """The rows of runs that did not fail.

    Raises
    ------
    ValueError
        If there is none.
    """
    finished = [row for row in rows if row.error is None]
    if not finished:
        raise ValueError(f"all {len(rows)} runs failed; {failures(rows)[0]}; --resume --retry-failed tries them again")
    return finished
