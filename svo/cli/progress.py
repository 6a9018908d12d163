"""Progress and time left of long work, on standard error: a bar in a terminal, a line now and then in a file."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

Update = Callable[[int, int], None]
SECONDS_BETWEEN_LINES = 10.0  # and none before 2 % are done: the first run waits for processes to start


@contextmanager
def progress(what: str) -> Iterator[Update]:
    """Show progress from the first call of the function (done, of) that this gives, until the block ends."""
    if sys.stderr.isatty():
        with _bar(what) as update:
            yield update
    else:
        yield _lines(what)


@contextmanager
def _bar(what: str) -> Iterator[Update]:
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from svo.terminal import console

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    bar = Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=console(stderr=True))
    task = bar.add_task(what, total=None)

    def update(done: int, of: int) -> None:
        bar.start()
        bar.update(task, completed=done, total=of)

    try:
        yield update
    finally:
        bar.stop()


def _lines(what: str) -> Update:
    begun = latest = monotonic()
    before: int | None = None  # what a resumed study had done already says nothing about the speed

    def update(done: int, of: int) -> None:
        nonlocal begun, latest, before
        now = monotonic()
        if before is None:
            begun, latest, before = now, now, done
        elif done == of or (now - latest >= SECONDS_BETWEEN_LINES and 50 * (done - before) >= of - before):
            left = (now - begun) / (done - before) * (of - done)
            print(f"{what}: {done} of {of}, about {left:.0f} s left", file=sys.stderr, flush=True)
            latest = now

    return update
