"""The loop of a watch: lines in, verdicts out, until the input ends or somebody interrupts it."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf
from threading import Event, current_thread, main_thread
from time import monotonic

from svo.detection.watch.lines import Lines
from svo.detection.watch.session import Session
from svo.detection.watch.silence import Silence
from svo.detection.watch.timeline import Event as LogEvent
from svo.detection.watch.view import View
from svo.isolation import Alarm

WAIT_SECONDS = 0.05
SECONDS_BETWEEN_STATES = 1.0


def watch(
    lines: Lines,
    session: Session,
    view: View,
    *,
    keep: Callable[[Alarm], None] | None = None,
    save: Callable[[], None] | None = None,
    silence: Silence | None = None,
    stop: Event | None = None,
) -> None:
    """Feed a session until the lines end, or until Ctrl-C, SIGTERM or ``stop``, which are clean ends too.

    Signals are taken in the main thread only; elsewhere ``stop`` ends the watch.

    Parameters
    ----------
    lines : Lines
    session : Session
    view : View
    keep : callable, optional
        Called with each alarm when it is raised, before anything is shown of it.
    save : callable, optional
        Called between lines: about once a second, after alarms, and at the end.
    silence : Silence, optional
        Says when nothing comes.
    stop : threading.Event, optional
        Ends the watch once it is set.

    Raises
    ------
    ValueError
        If the first line is no header, and if the lines end before the first sample.
    """
    why = "Stopped by an error"
    with _interruption(stop or Event()) as stopped:
        try:
            _Loop(lines, session, view, keep, save, silence, stopped).run()
            why = "Interrupted" if stopped.is_set() else "End of the input"
            if session.samples == 0 and not stopped.is_set():
                raise ValueError(f"{lines.name} ended without a sample; expected a header line and one row a sample")
        finally:
            lines.close()
            view.close(session.status(), why)


@dataclass
class _Loop:
    """One watch; arguments as of `watch`."""

    lines: Lines
    session: Session
    view: View
    keep: Callable[[Alarm], None] | None
    save: Callable[[], None] | None
    silence: Silence | None
    stopped: Event
    saved: float = -inf
    has_alarms: bool = False

    def run(self) -> None:
        is_whole = True
        while is_whole and not self.stopped.is_set() and (found := self.lines.read(WAIT_SECONDS)) is not None:
            if self.silence is not None:
                self._note(self.silence.says(bool(found)))
            is_whole = all(self._take(self.session.events(item), len(found) - i) for i, item in enumerate(found, 1))
            if is_whole and (self.has_alarms or monotonic() - self.saved >= SECONDS_BETWEEN_STATES):
                self._save()
            self.view.show(self.session.status, 0)
        # A line of which a part was taken only is taken again from the state before it.
        if is_whole and self._take(self.session.finish(), 0):
            self._save()

    def _take(self, events: Iterable[LogEvent], waiting: int) -> bool:
        """Go through what a line comes to, many samples after a gap; whether nothing interrupted it."""
        if self.stopped.is_set() and waiting:
            return False
        for event in events:
            for alarms in self.session.take(event):
                self._raise(alarms)
                self.view.show(self.session.status, waiting)
                if self.stopped.is_set() and event.kind == "missing":
                    return False
        self._note(*self.session.take_notes())
        return True

    def _raise(self, alarms: Sequence[Alarm]) -> None:
        """Store all of a sample before any of them is shown."""
        for alarm in alarms:
            if self.keep is not None:
                self.keep(alarm)
        for alarm in alarms:
            self.view.alarm(alarm)
        self.has_alarms = self.has_alarms or bool(alarms)

    def _note(self, *notes: str | None) -> None:
        for note in notes:
            if note is not None:
                self.view.note(note)

    def _save(self) -> None:
        if self.save is None or self.session.waits:
            return
        try:
            self.save()
        except OSError as error:  # the watch is worth more than the state, and the next second may have space for it
            self._note(f"the state could not be saved: {error.strerror}")
        self.saved, self.has_alarms = monotonic(), False


@contextmanager
def _interruption(event: Event) -> Iterator[Event]:
    """The event, set by Ctrl-C and SIGTERM, so that no sample is cut in half."""
    before = {}
    if current_thread() is main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, lambda *_: event.set())
    try:
        yield event
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
