"""Runs of a study on a ``dask.distributed`` cluster.

Workers send the outcome of a run back and this process writes it, so a cluster needs no shared file system: only the
same software, the plant's distribution included.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from svo.study.configuration import Job, StudyConfiguration, versions
from svo.study.run import run_registered
from svo.study.store import StudyFolder

if TYPE_CHECKING:
    from distributed import Client

Outcome = TypeVar("Outcome")
_AHEAD = 2  # runs handed out per thread: none waits, and an interruption leaves no long queue
_CONNECT = "15s"
_NOT_COMPARED = "machine"  # workers may be other machines; bit for bit equality is promised on one only


def on_cluster(
    configuration: StudyConfiguration, folder: StudyFolder, jobs: list[Job], scheduler: str
) -> Iterator[int]:
    """Run jobs on the cluster and yield the number of each when it is stored; errors as `outcomes_on_cluster`."""
    for outcome in outcomes_on_cluster(partial(run_registered, configuration.plant), jobs, scheduler):
        folder.write(outcome, configuration)
        yield outcome.row.run


def outcomes_on_cluster(work: Callable[[Job], Outcome], jobs: list[Job], scheduler: str) -> Iterator[Outcome]:
    """What ``work`` makes of each job, as the workers are done with it.

    A worker that dies costs the runs that it had: the scheduler gives them to another.

    Parameters
    ----------
    work : function of a job
        Can be pickled, as its answer can.
    jobs : list of Job
    scheduler : str
        Address of the cluster's scheduler, such as ``tcp://127.0.0.1:8786``.

    Raises
    ------
    ImportError
        If ``distributed`` is not installed.
    ValueError
        If nothing answers at the address, or it has no workers.
    RuntimeError
        If a worker has other versions of the software, or a run fails.
    """
    with _connected(scheduler) as client:
        _check_workers(client, scheduler)
        yield from _run_all(client, work, jobs)


def _run_all(client: Client, work: Callable[[Job], Outcome], jobs: list[Job]) -> Iterator[Outcome]:
    from distributed import as_completed

    waiting = iter(jobs)

    def hand_out(count: int) -> list[Any]:
        # Not pure: a study that is started anew must run anew.
        return [client.submit(work, job, pure=False) for job in islice(waiting, count)]

    running = as_completed(hand_out(_AHEAD * sum(client.nthreads().values())), loop=client.loop)
    for future in running:
        outcome: Outcome = _result(future)
        running.update(hand_out(1))
        yield outcome


def _result(future: Any) -> Any:
    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        raise RuntimeError(
            f"several workers died on the same run ({error}); the runs that are done are kept, resume to go on"
        ) from error
    finally:
        future.release()


def _connected(scheduler: str) -> Client:
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError("--scheduler needs the extra 'cluster': pip install 'svo-fdi[cluster]'") from error
    try:
        return Client(scheduler, timeout=_CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"no dask scheduler answers at {scheduler!r} ({error}); start one with `dask scheduler`, or check it"
        ) from error


def _check_workers(client: Client, scheduler: str) -> None:
    """Every worker has the software of this process, or its runs would not belong to the study."""
    if not client.nthreads():
        raise ValueError(f"the cluster at {scheduler!r} has no workers; start some with `dask worker {scheduler}`")
    here = versions()
    for worker, there in client.run(versions).items():
        different = [
            f"{k} is {there.get(k)}, here {v}" for k, v in here.items() if k != _NOT_COMPARED and there.get(k) != v
        ]
        if different:
            raise RuntimeError(f"worker {worker} has other software: {'; '.join(different)}; install the same versions")
