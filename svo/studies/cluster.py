"""Jobs on a ``dask.distributed`` cluster.

Workers send the outcome of a job back and this process writes it, so a cluster needs no shared file system: only the
same software, the plant's distribution included.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any

from svo.checks import optional_import
from svo.store import versions
from svo.studies.attempt import Failed, Job, Outcome, attempt

if TYPE_CHECKING:
    from distributed import Client

_AHEAD = 2  # jobs handed out per thread: none waits, and an interruption leaves no long queue
_CONNECT = "15s"
_NOT_COMPARED = "machine"  # workers may be other machines; bit for bit equality is promised on one only


def outcomes_on_cluster(
    work: Callable[[Job], Outcome], jobs: Sequence[Job], scheduler: str
) -> Iterator[tuple[Job, Outcome | Failed]]:
    """Each job with what ``work`` made of it, as the workers are done.

    A worker that dies costs time: the scheduler gives its jobs to another. A job that several died on has failed.

    Parameters
    ----------
    work : function of a job
        Can be pickled, as jobs and what it gives can.
    jobs : sequence
    scheduler : str
        Address of the cluster's scheduler, such as ``tcp://127.0.0.1:8786``.

    Raises
    ------
    ImportError
        If ``distributed`` is not installed.
    ValueError
        If nothing answers at the address, or it has no workers.
    RuntimeError
        If a worker has other versions of the software, or the scheduler is lost.
    """
    optional_import("distributed", "cluster", "studies on a cluster")  # which also sets the levels of its loggers
    with _quiet(), _connected(scheduler) as client, _scheduler_there(scheduler):
        _check_workers(client, scheduler)
        yield from _run_all(client, work, jobs)


@contextmanager
def _scheduler_there(scheduler: str) -> Iterator[None]:
    try:
        yield
    except (CancelledError, OSError) as error:  # one of a job itself is an outcome
        raise RuntimeError(
            f"the dask scheduler at {scheduler!r} is lost (it ended, or the network did); the runs that are done are "
            "kept: start it and its workers again and go on with --resume"
        ) from error


@contextmanager
def _quiet() -> Iterator[None]:
    """What goes wrong on the cluster is said once, by us, instead of with the tracebacks of its client."""
    loggers = [logging.getLogger(f"distributed{part}") for part in ("", ".client", ".core", ".comm", ".utils")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _run_all(
    client: Client, work: Callable[[Job], Outcome], jobs: Sequence[Job]
) -> Iterator[tuple[Job, Outcome | Failed]]:
    from distributed import as_completed

    waiting, given, done = iter(jobs), dict[Any, Job](), 0

    def hand_out(count: int) -> list[Any]:
        # Not pure: a study that is started anew must run anew.
        futures = [(client.submit(attempt, work, job, pure=False), job) for job in islice(waiting, count)]
        given.update((future.key, job) for future, job in futures)
        return [future for future, _ in futures]

    running = as_completed(hand_out(_AHEAD * sum(client.nthreads().values())), loop=client.loop)
    for future in running:
        job, outcome = given.pop(future.key), _result(future)
        running.update(hand_out(1))
        done += 1
        yield job, outcome
    if done < len(jobs):  # a client that lost its scheduler may have nothing left to wait for
        raise CancelledError


def _result(future: Any) -> Any:
    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        return Failed(f"several workers died on it ({error})")
    finally:
        future.release()


def _connected(scheduler: str) -> Client:
    from distributed import Client, Security
    from distributed.comm import parse_address, parse_host_port

    if scheduler.startswith("tls:") and Security().get_connection_args("client").get("ssl_context") is None:
        raise ValueError(
            f"the scheduler's address is {scheduler!r}, and there is no certificate of this process; set "
            "DASK_DISTRIBUTED__COMM__TLS__CA_FILE and the others of docs/studies.md, 'On a cluster'"
        )
    try:
        scheme, place = parse_address(scheduler)
        if scheme in ("tcp", "tls"):
            parse_host_port(place)  # a client that fails on it prints tracebacks when it is collected
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
