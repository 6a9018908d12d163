"""Progress of long work, on standard error: a bar in a terminal after two seconds, elsewhere a line now and then.

Elsewhere is a file or a pipe, where a study of hours would else be silent; work of ten seconds says nothing there.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock, Timer
from time import monotonic
from typing import Any

Update = Callable[[int, int], None]
SECONDS_BEFORE_BAR = 2.0
SECONDS_BETWEEN_LINES = 10.0  # and none before 2 % are done: the first run waits for processes to start


@contextmanager
def progress(what: str) -> Iterator[Update]:
    """Show how far work is, as the function (done, of) that this gives is told, until the block ends."""
    if sys.stderr.isatty():
        with _LateBar(what, counted=True).shown() as update:
            yield update
    else:
        yield _lines(what)


@contextmanager
def busy(what: str) -> Iterator[None]:
    """Show on a terminal, and only there, that work goes on whose end cannot be told."""
    if not sys.stderr.isatty():
        yield
        return
    with _LateBar(what, counted=False).shown():
        yield


class _LateBar:
    """A bar that appears after two seconds, whether anything was done by then or not."""

    def __init__(self, what: str, counted: bool) -> None:
        self._what, self._counted = what, counted
        self._lock = Lock()
        self._latest: tuple[int, int | None] = (0, None)
        self._bar: Any = None
        self._over = False

    @contextmanager
    def shown(self) -> Iterator[Update]:
        timer = Timer(SECONDS_BEFORE_BAR, self._show)
        timer.daemon = True
        timer.start()
        try:
            yield self._update
        finally:
            timer.cancel()
            with self._lock:
                self._over = True
                if self._bar is not None:
                    self._bar.stop()

    def _update(self, done: int, of: int) -> None:
        self._latest = (done, of)
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=done, total=of)

    def _show(self) -> None:
        bar = _bar(self._counted)
        with self._lock:
            if not self._over:
                done, of = self._latest
                bar.add_task(self._what, completed=done, total=of)
                bar.start()
                self._bar = bar


def _bar(counted: bool) -> Any:
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from svo.terminal import console

    count = (MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()) if counted else (TimeElapsedColumn(),)
    screen = console(stderr=True)
    return Progress(TextColumn("{task.description}"), BarColumn(), *count, console=screen, transient=True)


def _lines(what: str) -> Update:
    begun = latest = monotonic()
    before: int | None = None  # what a resumed study had done already says nothing about the speed
    has_begun = False

    def update(done: int, of: int) -> None:
        nonlocal begun, latest, before, has_begun
        now = monotonic()
        if before is None:
            begun, latest, before = now, now, done
            return
        is_due = now - latest >= SECONDS_BETWEEN_LINES and 50 * (done - before) >= of - before
        if is_due or (done == of and has_begun):
            left = (now - begun) / (done - before) * (of - done)
            print(f"{what}: {done} of {of}, about {left:.0f} s left", file=sys.stderr, flush=True)
            latest, has_begun = now, True

    return update
