"""Run a study of isolation times: the same rows wherever it runs, and a kill loses only the runs in flight."""

from __future__ import annotations

from pathlib import Path

from svo.studies.configuration import StudyConfiguration
from svo.studies.engine import Place, Progress
from svo.studies.isolation.run import run_registered
from svo.studies.isolation.store import StudyFolder
from svo.studies.runs import run_into


def run_study(
    configuration: StudyConfiguration,
    out: str | Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    limit: float | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    progress: Progress | None = None,
) -> StudyFolder:
    """Run what is still to be run of a study and store it, run by run.

    The plant is found by its name in the registry, in every process. A run that fails is a row with its error, and
    the study goes on: one that raises or calls ``sys.exit``, and, where runs have processes of their own, one that
    crashes its process or takes too long.

    Parameters
    ----------
    configuration : StudyConfiguration
    out : path
        A folder that is new or empty, or holds this very study if ``resume``.
    workers : int
        Number of processes; 1 without a limit runs in this one.
    scheduler : str, optional
        Address of a ``dask.distributed`` scheduler: its workers run the study instead (see `svo.studies.cluster`).
    limit : float, optional
        Seconds that a run may take; runs then have a process of their own, even with one worker.
    resume : bool
        Go on with the study in ``out``.
    retry_failed : bool
        Run those again that failed.
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
        If processes cannot start, or the cluster is lost; the runs that are done are kept.
    """
    place, folder = Place(workers, scheduler, limit), StudyFolder(Path(out))
    run_into(folder, run_registered, configuration, place, resume=resume, retry_failed=retry_failed, progress=progress)
    return folder
