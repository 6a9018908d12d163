"""Workers that are used again: each case has a limit of time, each worker one of memory."""

from __future__ import annotations

import multiprocessing
import resource
import tempfile
from collections.abc import Iterable, Iterator
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.limits import BYTES, SECONDS, Limit
from tests.fuzz.outcome import verdict_of

Job = tuple[str, int]  # kind and seed


def try_case(kind: str, seed: int) -> str | None:
    """Run one case; what is wrong with how it ended, or None."""
    from tests.fuzz.kinds import KINDS

    rng = np.random.default_rng([seed, sorted(KINDS).index(kind)])
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        try:
            KINDS[kind][0](rng, Path(folder))
        except Exception as error:
            return verdict_of(error)
    return None


def _work(connection: Connection) -> None:
    for kind in ("api calls", "descriptions", "csv logs", "mat files", "parquet logs", "alarm files", "study folders"):
        try_case(kind, 0)  # imports and compiled code are not the case's
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + BYTES, taken + BYTES))  # beside imports and compiled code
    connection.send(None)
    while True:
        connection.send(try_case(*connection.recv()))


class Worker:
    """One process and the case that it is at."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, other = context.Pipe()
        self.process = context.Process(target=_work, args=(other,), daemon=True)
        self.process.start()
        other.close()
        self.job: Job | None = None
        self.limit = Limit(self.process.pid or 0, 10 * SECONDS)

    def give(self, job: Job) -> None:
        self.job, self.limit = job, Limit(self.process.pid or 0)
        self.connection.send(job)

    def stop(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()


def run(jobs: Iterable[Job], processes: int) -> Iterator[tuple[Job, str | None]]:
    """Each job with what was wrong with its end, in no order; a worker that hangs or dies is replaced."""
    waiting = iter(jobs)
    workers = [Worker() for _ in range(processes)]
    while workers:
        ready: list[Any] = wait([w.connection for w in workers], timeout=0.5)
        for i, worker in enumerate(workers):
            if worker.connection in ready:
                try:
                    failure = worker.connection.recv()
                except EOFError:
                    worker.process.join()
                    failure = f"the process died with {worker.process.exitcode}"
                    workers[i] = _replaced(worker)
            elif worker.limit.passed():
                failure = str(worker.limit)
                workers[i] = _replaced(worker)
            else:
                continue
            if worker.job is not None:
                yield worker.job, failure
            if workers[i] is worker:
                _next(worker, waiting)
        workers = [w for w in workers if w.job is not None or w.process.is_alive()]


def _replaced(worker: Worker) -> Worker:
    worker.stop()
    return Worker()


def _next(worker: Worker, waiting: Iterator[Job]) -> None:
    job = next(waiting, None)
    if job is None:
        worker.job = None
        worker.stop()
    else:
        worker.give(job)
