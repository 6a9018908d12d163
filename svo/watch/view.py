"""What a watch shows: a live table in a terminal, plain lines elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from time import monotonic
from typing import TYPE_CHECKING, Protocol

from svo.alarms import Alarm
from svo.watch.session import Session, Status

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

SECONDS_BETWEEN_PICTURES = 0.1
SECONDS_BETWEEN_LINES = 1.0
SHOWN_ALARMS = 6


class View(Protocol):
    """Where a watch shows what it finds."""

    def alarm(self, alarm: Alarm) -> None:
        """A model was falsified."""
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
    """A line for each alarm, one for the bank's state after it, and one each second."""

    def __init__(self, console: Console, session: Session) -> None:
        self._console, self._session = console, session
        self._latest = -inf

    def alarm(self, alarm: Alarm) -> None:
        self._print(alarm_text(alarm))
        self._latest = -inf

    def show(self, status: Callable[[], Status | None], waiting: int) -> None:
        now = monotonic()
        if now - self._latest < SECONDS_BETWEEN_LINES:
            return
        found = status()
        if found is not None:
            self._print(_status_text(found, self._session.states))
            self._latest = now

    def close(self, status: Status | None, why: str) -> None:
        if status is not None:
            self._print(_status_text(status, self._session.states))
        self._print(summary(status, why))

    def _print(self, text: str) -> None:
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)
        self._console.file.flush()


class LiveView:
    """A table that is drawn again ten times a second; it stays on the screen at the end."""

    def __init__(self, console: Console, session: Session) -> None:
        from rich.live import Live

        self._console, self._session = console, session
        self._alarms: list[str] = []
        self._drawn = monotonic()
        self._live = Live(self._picture(None, 0), console=console, auto_refresh=False)
        self._live.start(refresh=True)

    def alarm(self, alarm: Alarm) -> None:
        self._alarms.append(alarm_text(alarm))

    def show(self, status: Callable[[], Status | None], waiting: int) -> None:
        now = monotonic()
        if now - self._drawn >= SECONDS_BETWEEN_PICTURES:
            self._live.update(self._picture(status(), waiting), refresh=True)
            self._drawn = now

    def close(self, status: Status | None, why: str) -> None:
        self._live.update(self._picture(status, 0), refresh=True)
        self._live.stop()
        self._console.print(summary(status, why), highlight=False, markup=False)

    def _picture(self, status: Status | None, waiting: int) -> RenderableType:
        from rich.console import Group
        from rich.markup import escape
        from rich.text import Text

        session = self._session
        title = Text.from_markup(f"[bold]{escape(session.plant.title)}[/] ({session.noise} noise), {session.source}")
        if status is None:
            return Group(title, Text("waiting for the first sample; Ctrl-C ends", style="dim"))
        load = 100 * status.seconds_per_sample / session.plant.Ts
        foot = (
            f"{status.samples} samples, {1e3 * status.seconds_per_sample:.2f} ms each ({load:.0f} % of real time), "
            f"{waiting} lines waiting, {status.undecided} undecided; Ctrl-C ends"
        )
        shown = [Text(text, style="red") for text in self._alarms[-SHOWN_ALARMS:]]
        if len(self._alarms) > SHOWN_ALARMS:
            shown.insert(0, Text(f"{len(self._alarms) - SHOWN_ALARMS} earlier alarms are not shown", style="dim"))
        return Group(title, self._headline(status), self._table(status), *shown, Text(foot, style="dim"))

    def _headline(self, status: Status) -> RenderableType:
        from rich.text import Text

        style = {"nominal": "green", "detected": "yellow", "isolated": "red"}.get(status.verdict.state, "magenta")
        return Text(f"{status.time:.3f} s  {conclusion(status)}", style=f"bold {style}")

    def _table(self, status: Status) -> RenderableType:
        from rich.markup import escape
        from rich.table import Table

        table = Table()
        table.add_column("model")
        table.add_column("status")
        for name in self._session.states:
            table.add_column(escape(name), justify="right", no_wrap=True)
        for name in self._session.names:
            table.add_row(*self._row(name, status))
        return table

    def _row(self, name: str, status: Status) -> list[str]:
        from rich.markup import escape

        empty = [""] * len(self._session.states)
        if name in status.boxes:
            # The models of faults may have states of their own after the plant's.
            bounds = list(zip(*status.boxes[name], strict=True))[: len(empty)]
            return [escape(name), "[green]alive[/]", *(escape(_interval(low, high)) for low, high in bounds)]
        if name in status.dead:
            return [escape(name), f"[red]falsified at {status.dead[name].time:g} s[/]", *empty]
        return [escape(name), "alive" if name in status.verdict.alive else "[red]falsified[/]", *empty]


def conclusion(status: Status) -> str:
    """The state of the bank in words."""
    verdict = status.verdict
    if verdict.state == "isolated":
        return f"isolated: {verdict.fault}"
    if verdict.state == "unexplained":
        return "unexplained: no model is left"
    return f"{verdict.state}; alive: {', '.join(verdict.alive)}"


def alarm_text(alarm: Alarm) -> str:
    """A falsification and what its certificate says, checked again here."""
    certificate = alarm.certificate
    steps = certificate.last - certificate.first
    window = f"samples {alarm.sample - steps} to {alarm.sample}"
    holds = "holds in exact arithmetic" if certificate.verify() else "DOES NOT HOLD"
    return f"ALARM {alarm.time:g} s: {alarm.observer} is falsified; its certificate over {window} {holds}"


def summary(status: Status | None, why: str) -> str:
    """The last line of a watch."""
    if status is None:
        return f"{why}: no samples."
    return f"{why}: {status.samples} samples, {1e3 * status.seconds_per_sample:.2f} ms each; {conclusion(status)}."


def _status_text(status: Status, states: tuple[str, ...]) -> str:
    text = f"{status.time:.3f} s  {conclusion(status)}"
    if status.boxes:
        name, (lower, upper) = next(iter(status.boxes.items()))
        bounds = "  ".join(f"{s} {_interval(a, b)}" for s, a, b in zip(states, lower, upper, strict=False))
        text += f"  |  by {name}: {bounds}"
    return text


def _interval(lower: float, upper: float) -> str:
    return f"[{lower:.4g}, {upper:.4g}]"
