"""The loop of a watch: lines in, verdicts out, until the input ends or somebody interrupts it."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event

from svo.alarms import Alarm
from svo.watch.lines import Lines
from svo.watch.session import Session
from svo.watch.view import View

WAIT_SECONDS = 0.05


def watch(lines: Lines, session: Session, view: View, *, keep: Callable[[Alarm], None] | None = None) -> None:
    """Feed a session until the lines end, or until Ctrl-C, which is a clean end too.

    Parameters
    ----------
    lines : Lines
    session : Session
    view : View
    keep : callable, optional
        Called with each alarm when it is raised.

    Raises
    ------
    ValueError
        For a bad line, and if the lines end before the first sample.
    """
    why = "Stopped by an error"
    with _interruption() as interrupted:
        try:
            for line, waiting in _each(lines, session, view, interrupted):
                for alarm in session.feed(line):
                    if keep is not None:
                        keep(alarm)
                    view.alarm(alarm)
                view.show(session.status, waiting)
            why = "Interrupted" if interrupted.is_set() else "End of the input"
            if session.status() is None and not interrupted.is_set():
                raise ValueError(f"{lines.name} ended without a sample; expected a header line and one row a sample")
        finally:
            view.close(session.status(), why)
            lines.close()


def _each(lines: Lines, session: Session, view: View, interrupted: Event) -> Iterator[tuple[str, int]]:
    """(line, number of lines that wait after it), while the view stays up to date in silence."""
    while not interrupted.is_set() and (found := lines.read(WAIT_SECONDS)) is not None:
        for i, line in enumerate(found, start=1):
            if interrupted.is_set():
                return
            yield line, len(found) - i
        if not found:
            view.show(session.status, 0)


@contextmanager
def _interruption() -> Iterator[Event]:
    """An event that Ctrl-C sets, so that no sample is cut in half."""
    event = Event()
    before = signal.signal(signal.SIGINT, lambda number, frame: event.set())
    try:
        yield event
    finally:
        signal.signal(signal.SIGINT, before)
