"""Processes that work for a study and end with the process that started them, however that ends."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager


@contextmanager
def worker_processes(count: int, finish: bool = True) -> Iterator[ProcessPoolExecutor]:
    """A pool of so many processes.

    Parameters
    ----------
    count : int
    finish : bool
        Whether calls that have begun are waited for if the block ends with an error or an interruption.
    """
    before = set(multiprocessing.active_children())
    # Spawned, not forked: a fork would copy the locks of threads that run in this process.
    pool = ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn"), initializer=_start)
    try:
        yield pool
    except BaseException:
        if not finish:
            for child in set(multiprocessing.active_children()) - before:
                child.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _start() -> None:
    # An interruption from the keyboard reaches all processes; what becomes of a worker is the parent's to say.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Workers of a killed parent would wait for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
