"""What a watch shows: a live table in a terminal, plain lines elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from time import monotonic
from typing import Protocol

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from svo.detection.watch.session import Counts, Session, Status
from svo.isolation import Alarm
from svo.terminal import line

SECONDS_BETWEEN_PICTURES = 0.1
SECONDS_BETWEEN_LINES = 1.0
SHOWN_ALARMS = 6
SHOWN_NOTES = 3
_ANY_WIDTH = 10_000


class View(Protocol):
    """Where a watch shows what it finds."""

    def alarm(self, alarm: Alarm) -> None:
        """A model was falsified."""
        ...

    def note(self, text: str) -> None:
        """Something that a reader should know of: a bad line, a gap, another file, silence."""
        ...

    def show(self, status: Callable[[], Status | None], waiting: int) -> None:
        """Called often; ``status`` is asked only when something is drawn. ``waiting`` lines have not been read."""
        ...

    def close(self, status: Status | None, why: str) -> None:
        """The watch is over."""
        ...


def view_of(console: Console, session: Session) -> View:
    """The view that suits an output."""
    return LiveView(console, session) if console.is_terminal else PlainView(console, session)


class PlainView:
    """A line for each alarm, one for the bank's state after it, and one each second in which data come."""

    def __init__(self, console: Console, session: Session) -> None:
        self._console, self._session = console, session
        self._latest, self._shown = -inf, 0

    def alarm(self, alarm: Alarm) -> None:
        self._print(alarm_text(alarm))
        self._latest = -inf

    def note(self, text: str) -> None:
        self._print(f"note: {text}")

    def show(self, status: Callable[[], Status | None], waiting: int) -> None:
        now = monotonic()
        if now - self._latest < SECONDS_BETWEEN_LINES or self._session.samples == self._shown:
            return
        found = status()
        if found is not None:
            self._print(_status_text(found, self._session.states))
            self._latest, self._shown = now, found.samples

    def close(self, status: Status | None, why: str) -> None:
        if status is not None:
            self._print(_status_text(status, self._session.states))
        self._print(summary(status, why))

    def _print(self, text: str) -> None:
        self._console.print(line(text), highlight=False, markup=False, soft_wrap=True)
        self._console.file.flush()


class LiveView:
    """A table that is drawn again ten times a second; it stays on the screen at the end."""

    def __init__(self, console: Console, session: Session) -> None:
        self._console, self._session = console, session
        self._alarms: list[str] = []
        self._notes: list[str] = []
        self._drawn = monotonic()
        self._live = Live(self._picture(None, 0), console=console, auto_refresh=False)
        self._live.start(refresh=True)

    def alarm(self, alarm: Alarm) -> None:
        self._alarms.append(alarm_text(alarm))

    def note(self, text: str) -> None:
        self._notes = [*self._notes, text][-SHOWN_NOTES:]

    def show(self, status: Callable[[], Status | None], waiting: int) -> None:
        now = monotonic()
        if now - self._drawn >= SECONDS_BETWEEN_PICTURES:
            self._live.update(self._picture(status(), waiting), refresh=True)
            self._drawn = now

    def close(self, status: Status | None, why: str) -> None:
        self._live.update(self._picture(status, 0), refresh=True)
        self._live.stop()
        self._console.print(line(summary(status, why)), highlight=False, markup=False)

    def _picture(self, status: Status | None, waiting: int) -> RenderableType:
        session = self._session
        title = Text.assemble((line(session.plant.title), "bold"), line(f" ({session.noise} noise), {session.source}"))
        notes = [Text(f"note: {line(text)}", style="yellow") for text in self._notes]
        if status is None:
            return Group(title, *notes, Text("waiting for the first sample; Ctrl-C ends", style="dim"))
        load = 100 * status.seconds_per_sample / session.plant.Ts
        foot = (
            f"{status.samples} samples, {1e3 * status.seconds_per_sample:.2f} ms each ({load:.0f} % of real time), "
            f"{waiting} lines waiting, {status.undecided} undecided; Ctrl-C ends"
        )
        shown = [Text(line(text), style="red") for text in self._alarms[-SHOWN_ALARMS:]]
        if len(self._alarms) > SHOWN_ALARMS:
            shown.insert(0, Text(f"{len(self._alarms) - SHOWN_ALARMS} earlier alarms are not shown", style="dim"))
        return Group(title, self._headline(status), *self._tables(status), *shown, *notes, Text(foot, style="dim"))

    def _headline(self, status: Status) -> RenderableType:
        style = {"nominal": "green", "detected": "yellow", "isolated": "red"}.get(status.verdict.state, "magenta")
        return Text(line(f"{status.time:.3f} s  {conclusion(status)}"), style=f"bold {style}")

    def _tables(self, status: Status) -> list[RenderableType]:
        """Bounds by every model beside it where the terminal is wide enough, else by the first one alive, below."""
        wide = self._models(status, self._session.states)
        unlimited = self._console.options.update_width(_ANY_WIDTH)
        if self._console.measure(wide, options=unlimited).maximum <= self._console.width:
            return [wide]
        return [self._models(status, ()), *self._bounds(status)]

    def _models(self, status: Status, states: Sequence[str]) -> Table:
        table = _table("model", "status", *states)
        for name in self._session.names:
            # The models of faults may have states of their own after the plant's.
            bounds = zip(*status.boxes[name], strict=True) if name in status.boxes else ()
            cells = [_interval(low, high) for low, high in bounds][: len(states)]
            table.add_row(Text(line(name)), self._life(name, status), *(Text(cell) for cell in cells))
        return table

    def _bounds(self, status: Status) -> list[Table]:
        if not status.boxes:
            return []
        name, (lower, upper) = next(iter(status.boxes.items()))
        table = _table("state", f"bounds by {name}")
        for state, low, high in zip(self._session.states, lower, upper, strict=False):
            table.add_row(Text(line(state)), Text(_interval(low, high)))
        return [table]

    def _life(self, name: str, status: Status) -> Text:
        if name in status.verdict.alive:
            return Text("alive", style="green")
        when = f" at {status.dead[name]:.9g} s" if name in status.dead else ""
        return Text(f"falsified{when}", style="red")


def _table(*columns: str) -> Table:
    """Columns of numbers to the right, after two of words."""
    table = Table()
    for i, name in enumerate(columns):
        table.add_column(Text(line(name)), justify="left" if i < 2 else "right", no_wrap=True)
    return table


def conclusion(status: Status) -> str:
    """The state of the bank in words."""
    verdict = status.verdict
    if verdict.state == "isolated":
        return f"isolated: {verdict.fault}"
    if verdict.state == "unexplained":
        return "unexplained: no model is left"
    return f"{verdict.state}; alive: {', '.join(verdict.alive)}"


def alarm_text(alarm: Alarm) -> str:
    """A falsification and what its certificate says, checked again here, and what that rests on."""
    certificate = alarm.certificate
    first = alarm.sample + 1 - len(certificate.samples)
    window = f"sample {first}" if first == alarm.sample else f"samples {first} to {alarm.sample}"
    holds = "holds in exact arithmetic" if certificate.verify() else "DOES NOT HOLD"
    what = f"its certificate over {window} {holds}, given {certificate.premise(alarm.sample)}"
    return f"ALARM {alarm.time:.9g} s: {alarm.observer} is falsified; {what}"


def summary(status: Status | None, why: str) -> str:
    """The last line of a watch."""
    if status is None:
        return f"{why}: no new samples."
    odd = "".join(f", {text}" for text in _odd(status.counts))
    milliseconds = 1e3 * status.seconds_per_sample
    return f"{why}: {status.samples} samples{odd}, {milliseconds:.2f} ms each; {conclusion(status)}."


def _odd(counts: Counts) -> list[str]:
    """What was not as it should be."""
    texts = {
        f"{counts.missing} of them without a reading": counts.missing,
        f"{counts.held} with an input taken to be held": counts.held,
        f"{counts.bad} bad lines": counts.bad,
        f"{counts.repeats} repeated rows": counts.repeats,
        f"in {counts.runs} runs": counts.runs - 1,
    }
    return [text for text, count in texts.items() if count]


def _status_text(status: Status, states: tuple[str, ...]) -> str:
    text = f"{status.time:.3f} s  {conclusion(status)}"
    if status.boxes:
        name, (lower, upper) = next(iter(status.boxes.items()))
        bounds = "  ".join(f"{s} {_interval(a, b)}" for s, a, b in zip(states, lower, upper, strict=False))
        text += f"  |  by {name}: {bounds}"
    return text


def _interval(lower: float, upper: float) -> str:
    return f"[{lower:.4g}, {upper:.4g}]"
