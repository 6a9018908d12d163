"""The one engine of all studies: jobs with numbers, done here, in processes or on a cluster, and kept one by one."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial

from svo.checks import expect
from svo.store import Parts
from svo.store.parts import Row
from svo.studies.attempt import Failed, Job, Outcome, attempt
from svo.studies.cluster import outcomes_on_cluster
from svo.studies.processes import outcomes_in_processes

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Place:
    """Where jobs are done.

    Attributes
    ----------
    workers : int
        Number of processes; 1 without a limit is this process.
    scheduler : str or None
        Address of a ``dask.distributed`` scheduler, whose workers do the jobs instead (see `svo.studies.cluster`).
    limit : float or None
        Seconds that a job may take. With one, a job is always done in another process, which can be stopped, and may
        crash.

    Raises
    ------
    ValueError
        If ``workers`` or ``limit`` is out of range, or a limit is asked of a cluster.
    """

    workers: int = 1
    scheduler: str | None = None
    limit: float | None = None

    def __post_init__(self) -> None:
        expect(self.workers >= 1, "workers", self.workers, "at least 1 process")
        expect(self.limit is None or self.limit > 0, "limit", self.limit, "seconds > 0")
        if self.limit is not None and self.scheduler is not None:
            raise ValueError("a cluster cannot stop a run that takes too long; leave the limit or the scheduler out")

    def outcomes(self, work: Callable[[Job], Outcome], jobs: Sequence[Job]) -> Generator[tuple[Job, Outcome | Failed]]:
        """Each job with what ``work`` made of it, as they are done; errors as of the places."""
        if self.scheduler is not None and jobs:
            yield from outcomes_on_cluster(work, jobs, self.scheduler)
        elif self.workers > 1 or self.limit is not None:
            yield from outcomes_in_processes(work, jobs, self.workers, self.limit)
        else:
            yield from ((job, attempt(work, job)) for job in jobs)


def complete(
    work: Callable[[Job], Outcome],
    jobs: Sequence[Job],
    done: Collection[int],
    keep: Callable[[int, Outcome | Failed], None],
    place: Place,
    progress: Progress | None = None,
) -> None:
    """Do the jobs that are not done, and hand each outcome on, so that a kill loses only the jobs in flight.

    Parameters
    ----------
    work : function of a job
        Can be pickled, as jobs and what it gives can. What it raises is that job's outcome, and the others go on.
    jobs : sequence
        Their numbers are their places here.
    done : collection of int
        Numbers of jobs that are left out.
    keep : function of a number and an outcome
        Called in this process, as jobs are done.
    place : Place
    progress : callable, optional
        Called with (jobs done, jobs in all), at the start and after every job.
    """
    tell = progress or (lambda *_: None)
    to_do = [(number, job) for number, job in enumerate(jobs) if number not in done]
    before = len(jobs) - len(to_do)
    tell(before, len(jobs))
    with closing(place.outcomes(partial(_without_number, work), to_do)) as outcomes:
        for count, ((number, _), outcome) in enumerate(outcomes, start=before + 1):
            keep(number, outcome)
            tell(count, len(jobs))


def complete_parts(
    work: Callable[[Job], list[Row]],
    jobs: Sequence[Job],
    parts: Parts[Row],
    failed: Callable[[Job, str], list[Row]],
    place: Place,
    *,
    retry_failed: bool = False,
    progress: Progress | None = None,
) -> list[Row]:
    """Complete a folder that has a part for each job, and read it; parameters and errors as of `complete`.

    ``failed`` makes the rows, with their ``error``, of a job that failed; ``retry_failed`` does these again.
    """
    done = set(parts.survey().intact)
    if retry_failed:
        done -= parts.failed(sorted(done))

    def keep(number: int, outcome: list[Row] | Failed) -> None:
        rows = failed(jobs[number], outcome.error) if isinstance(outcome, Failed) else outcome
        parts.write(number, rows)

    complete(work, jobs, done, keep, place, progress)
    return parts.rows(range(len(jobs)))


def within(progress: Progress | None, total: int, before: int) -> Progress:
    """The progress of jobs that are part of ``total``, ``before`` of which come first."""
    return lambda done, _: progress(before + done, total) if progress else None


def _without_number(work: Callable[[Job], Outcome], numbered: tuple[int, Job]) -> Outcome:
    return work(numbered[1])
