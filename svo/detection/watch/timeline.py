"""Which sample a row is: the next, one after a gap, one that was there before, or the first of a restarted clock.

A row whose time does not follow waits for the next one. Only if that agrees with it has time really gone so; else the
row is a bad one, and one wrong cell neither invents a gap nor a restart.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple
from zlib import crc32

from svo.checks import Array
from svo.logs.columns import TIME_TOLERANCE, is_sampled, wrong_step

REMEMBERED = 4096  # rows: what a file that is written anew may repeat of the one before
_CONFIRMS = 10  # samples within which another row must follow one after a gap: lost rows, not another unit of time
_ECHO = 64  # rows alike at the beginning of two runs; with more, one is a copy of the other


class Row(NamedTuple):
    """A row of a log: time [s], inputs (nu,), outputs (ny,), NaN where they are unknown; ``place`` is for messages."""

    time: float
    u: Array
    y: Array
    place: str

    @property
    def key(self) -> int:
        return crc32(self.y.tobytes(), crc32(self.u.tobytes()))


@dataclass(frozen=True)
class Event:
    """What a row comes to.

    Attributes
    ----------
    kind : {"sample", "missing", "restart", "repeat", "bad"}
        A sample; ``count`` samples without a row, up to the next one; a clock that was started again; a row that was
        read before; a row whose time cannot be.
    row : Row
    count : int
    why : str
        For people.
    """

    kind: Literal["sample", "missing", "restart", "repeat", "bad"]
    row: Row
    count: int = 1
    why: str = ""


class Timeline:
    """Sets rows on the grid of the sampling time.

    Parameters
    ----------
    Ts : float
        Sampling time [s].
    column : str
        Name of the column of time, for messages.
    """

    def __init__(self, Ts: float, column: str = "time") -> None:
        self.Ts, self._column = Ts, column
        self.last: float | None = None
        self._waiting: Row | None = None
        self._echo: list[Row] = []
        self._recent: dict[float, int] = {}
        self._first: dict[float, int] = {}

    def add(self, row: Row) -> Iterator[Event]:
        """What the next row comes to, and one that waited for it."""
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            if self._steps(self.last, row.time) == 1:
                yield self._bad(waiting)
            elif self._is_agreed(waiting, row) and not self._is_known(row):
                yield from self._take(waiting)
            else:
                yield self._bad(waiting)
        steps = self._steps(self.last, row.time)
        if steps == 1:
            yield from self._take(row)
        elif self._is_known(row):
            self._echo = [*self._echo, row][-_ECHO:] if self._follows_echo(row) else [row]
            yield Event("repeat", row)
        else:
            self._waiting = row

    def finish(self) -> Iterator[Event]:
        """What a row that still waits comes to when no other one follows: one after a short gap is taken."""
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            is_near = 0 < self._steps(self.last, waiting.time) <= _CONFIRMS
            yield from self._take(waiting) if is_near else [self._bad(waiting)]

    @property
    def waits(self) -> bool:
        """Whether a row waits for the next one."""
        return self._waiting is not None

    def state(self) -> dict[str, Any]:
        """For JSON; a row that waits is not in it."""
        rows = {"_recent": self._recent, "_first": self._first}
        known = {name: [[time.hex(), key] for time, key in keys.items()] for name, keys in rows.items()}
        return {"last": None if self.last is None else self.last.hex(), **known}

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave."""
        self.last = None if state["last"] is None else float.fromhex(state["last"])
        for name in ("_recent", "_first"):
            setattr(self, name, {float.fromhex(time): int(key) for time, key in state[name]})

    def _steps(self, before: float | None, after: float) -> int:
        """Sampling times from one row to another, 0 if that is no positive whole number; a first row follows."""
        if before is None:
            return 1
        steps = round((after - before) / self.Ts)
        # As if every sample in between were a row, within the tolerance of its own step.
        fits = abs(after - before - steps * self.Ts) <= TIME_TOLERANCE * self.Ts * steps
        return steps if steps > 0 and fits else 0

    def _is_agreed(self, waiting: Row, row: Row) -> bool:
        """Whether a row confirms one that waits: soon after it behind a gap, the very next one after a restart."""
        steps = self._steps(waiting.time, row.time)
        return 0 < steps <= _CONFIRMS if self._steps(self.last, waiting.time) else steps == 1

    def _take(self, row: Row) -> Iterator[Event]:
        steps = self._steps(self.last, row.time)
        if steps == 0:
            yield from self._restart(row)
            return
        yield from self._gap(row, steps)
        self._remember(row)
        yield Event("sample", row)

    def _gap(self, row: Row, steps: int) -> Iterator[Event]:
        """The samples without a row before one that comes so many sampling times after the last."""
        if steps > 1:
            yield Event("missing", row, steps - 1)

    def _restart(self, row: Row) -> Iterator[Event]:
        """A new run; rows at its beginning that were taken for repeats of the old one are its first."""
        begun = self._echo if len(self._echo) < _ECHO and self._follows_echo(row) else []
        why = f"the clock went from {self.last:.9g} s to {[*begun, row][0].time:.9g} s"
        self.last, self._recent, self._first = None, {}, {}
        yield Event("restart", row, why=why)
        for first in (*begun, row):
            self._remember(first)
            yield Event("sample", first)

    def _remember(self, row: Row) -> None:
        self.last, self._echo = row.time, []
        self._recent[row.time] = row.key
        if len(self._recent) > REMEMBERED:
            del self._recent[next(iter(self._recent))]
        if len(self._first) < _ECHO:
            self._first[row.time] = row.key

    def _is_known(self, row: Row) -> bool:
        """Whether it was read before, or is between rows that were in a file that repeats them."""
        assert self.last is not None
        if row.time > self.last:
            return False
        for rows in (self._first, self._recent):
            if row.time in rows:
                return rows[row.time] == row.key
        return len(self._echo) == _ECHO and self._follows_echo(row)

    def _follows_echo(self, row: Row) -> bool:
        return bool(self._echo) and is_sampled(self._echo[-1].time, row.time, self.Ts)

    def _bad(self, row: Row) -> Event:
        assert self.last is not None
        where = f"{row.place}, column {self._column!r}"
        return Event("bad", row, why=str(wrong_step(where, self.last, row.time, self.Ts)))


class EventTimeline(Timeline):
    """As `Timeline`, of rows that come at times of their own: each later one is a sample, and there are no gaps.

    One that comes long after the last waits for the next, which must be later still.
    """

    def _steps(self, before: float | None, after: float) -> int:
        """0 for a row that is not later, 1 for one that is, 2 for one that comes long after."""
        if before is None:
            return 1
        return 0 if after <= before else 1 if after - before <= _CONFIRMS * self.Ts else 2

    def _gap(self, row: Row, steps: int) -> Iterator[Event]:
        yield from ()

    def _follows_echo(self, row: Row) -> bool:
        return bool(self._echo) and row.time > self._echo[-1].time

    def _bad(self, row: Row) -> Event:
        assert self.last is not None
        why = f"{row.place}, column {self._column!r}: the time is {row.time:.9g} s after {self.last:.9g} s"
        return Event("bad", row, why=f"{why}; expected a later one, and the next row later still")
