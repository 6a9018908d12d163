"""Jobs in processes of this machine: one that crashes or takes too long costs its job, and none outlives its parent.

The pools of the standard library break as a whole when one process dies, and stop no job that takes too long.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from time import monotonic
from typing import Any, Generic

from svo.studies.attempt import Failed, Job, Outcome, attempt

_PR_SET_PDEATHSIG = 1  # of prctl(2)
_LAST_SECONDS = 10.0


def outcomes_in_processes(
    work: Callable[[Job], Outcome], jobs: Sequence[Job], count: int, limit: float | None
) -> Iterator[tuple[Job, Outcome | Failed]]:
    """Each job with what ``work`` made of it, as they are done.

    The first job is done alone: what it loads or finds wrong is then known before there are many processes.

    Parameters
    ----------
    work : function of a job
        Can be pickled, as jobs and what it gives can.
    jobs : sequence
    count : int
        Number of processes.
    limit : float or None
        Seconds that a job may take, from when a process that is ready gets it; then the process is killed.

    Raises
    ------
    RuntimeError
        If processes cannot be started.
    """
    waiting, crew, largest = deque(jobs), list[_Worker[Job]](), 1
    try:
        while waiting or crew:
            while len(crew) < min(largest, len(waiting) + sum(worker.is_busy for worker in crew)):
                crew.append(_Worker(work, limit))
            for worker in _ready(crew):
                busy, answer = worker.is_busy, worker.answer()
                if busy:
                    largest = count
                    yield worker.job, answer
                if worker.is_alive and waiting:
                    worker.take(waiting.popleft())
                else:
                    worker.end()
                    crew.remove(worker)
    finally:
        for worker in crew:
            worker.end()


class _Worker(Generic[Job]):
    """A process that waits for jobs, does one at a time, and answers; its first answer says that it is ready."""

    job: Job

    def __init__(self, work: Callable[[Job], Any], limit: float | None) -> None:
        # Spawned, not forked: a fork would copy the locks of threads that run in this process.
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, work))
        self.is_busy, self.is_ready, self.is_alive = False, False, True
        self.limit, self.until = limit, float("inf")
        with _deaf_to_interruptions():
            self.process.start()
        theirs.close()

    def take(self, job: Job) -> None:
        self.job, self.is_busy = job, True
        self.until = float("inf") if self.limit is None else monotonic() + self.limit
        with suppress(OSError):  # a process that is gone has no answer, and that is seen next
            self.connection.send(job)

    def answer(self) -> Any:
        """What the process says, or why it says nothing any more."""
        overdue = monotonic() >= self.until
        self.is_busy, self.until = False, float("inf")
        with suppress(EOFError, OSError):
            if self.connection.poll():
                said = self.connection.recv()
                self.is_ready = True
                return said
        self.is_alive = False
        if not overdue:
            self.process.join(_LAST_SECONDS)  # its end of the connection closes a moment before it is gone
        self.end()
        if not self.is_ready:
            raise RuntimeError(
                f"a worker process cannot start ({_ended(self.process.exitcode)}); a script that runs a study in "
                "processes does so under `if __name__ == '__main__':`"
            )
        return Failed(
            f"it took longer than the limit of {self.limit:g} s and was stopped"
            if overdue
            else f"its process {_ended(self.process.exitcode)}"
        )

    def end(self) -> None:
        self.connection.close()
        self.process.kill()
        self.process.join()


def _ready(crew: Sequence[_Worker[Job]]) -> list[_Worker[Job]]:
    """The workers that have something to say, are gone, or took too long; waits until there is one."""
    soonest = min(worker.until for worker in crew) - monotonic()
    watched = [part for worker in crew for part in (worker.connection, worker.process.sentinel)]
    heard = set(wait(watched, None if soonest == float("inf") else max(0.0, soonest)))
    now = monotonic()
    return [w for w in crew if heard & {w.connection, w.process.sentinel} or w.until <= now]


def _serve(connection: Connection, work: Callable[[Job], Any]) -> None:
    """The life of a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # what becomes of a worker is the parent's to say
    _end_with_parent()
    connection.send(None)
    with suppress(EOFError):
        while True:
            outcome = attempt(work, connection.recv())
            said = attempt(connection.send, outcome)
            if isinstance(said, Failed):
                connection.send(Failed(f"its outcome cannot be sent: {said.error}"))


def _end_with_parent() -> None:
    """A killed parent leaves nothing behind, whatever its workers are at."""
    if sys.platform == "linux":  # native code may hold the interpreter, and no thread would see the end
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _deaf_to_interruptions() -> Iterator[None]:
    """Processes started in this block never hear of an interruption from the keyboard; this one does, later."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _ended(code: int | None) -> str:
    if code is not None and code < 0:
        return f"was ended by {signal.Signals(-code).name}"
    return f"ended with exit code {code}"
