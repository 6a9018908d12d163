"""A bank fed with the lines of a CSV log, one at a time."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.detection.bank_alarms import KEPT_SCHEDULES, alarm_of, source_of_bank
from svo.detection.watch.lines import Line, Notice
from svo.detection.watch.rows import RowReader
from svo.detection.watch.timeline import Event, EventTimeline, Row, Timeline
from svo.isolation import GLOBAL, Alarm, Verdict
from svo.logs.dialect.live import check_live, live_widening
from svo.logs.drive import advance
from svo.models import Labels
from svo.plant import MonitoredPlant, resume_schedule, saved_schedule, schedule_of
from svo.plant.description import description_digest
from svo.plant.dialects import dialect_of, widened


@dataclass(frozen=True, eq=False)
class Status:
    """What a bank says at the latest sample.

    Attributes
    ----------
    samples : int
        Samples so far, those without a row included.
    time : float
        Time of the latest one [s].
    verdict : Verdict
    boxes : mapping of str to (lower, upper)
        Bounds (n,) of the state by each model that is alive.
    dead : mapping of str to float
        Time [s] at which each model that is not was falsified.
    undecided : int
        Answers so far that were neither a proof nor a point.
    seconds_per_sample : float
        Time of computation, as a mean over all samples.
    counts : Counts
    """

    samples: int
    time: float
    verdict: Verdict
    boxes: Mapping[str, tuple[Array, Array]]
    dead: Mapping[str, float]
    undecided: int
    seconds_per_sample: float
    counts: Counts


@dataclass
class Counts:
    """What was not as it should be in the lines so far.

    Attributes
    ----------
    bad : int
        Lines that could not be read, or whose time cannot be.
    missing : int
        Samples without a row, or with one that could not be read: their readings are taken as missing.
    held : int
        Of these, samples whose input was not read either: that of the sample before is taken to be held.
    repeats : int
        Rows that were read before.
    runs : int
        Runs that the log consists of: one more than its clock was started again.
    """

    bad: int = 0
    missing: int = 0
    held: int = 0
    repeats: int = 0
    runs: int = 1


class Session:
    """Reads a log line by line and drives a plant's bank; what it cannot read is counted, reported and goes on.

    Parameters
    ----------
    plant : MonitoredPlant
    noise : str
        Noise set whose bounds the observers assume.
    source : str
        Name of the log, for messages and alarms.

    Attributes
    ----------
    names : tuple of str
        The models.
    states : tuple of str
        Names of the nominal model's states with their units.
    counts : Counts
    """

    def __init__(self, plant: MonitoredPlant, noise: str, source: str) -> None:
        dialect = dialect_of(plant)
        if dialect is not None:
            check_live(dialect)
            plant = widened(plant, live_widening(dialect, plant.columns))
        self.plant, self.noise, self.source = plant, noise, source
        self.counts = Counts()
        self._notes: list[str] = []
        self._reader = RowReader(source, plant.columns, self._bad, dialect)
        self._keeps_times = dialect is not None and dialect.events
        self._timeline = (EventTimeline if self._keeps_times else Timeline)(plant.Ts, plant.columns.time)
        self._samples = self._undecided = 0
        self._seconds = 0.0
        self._start()
        self.names = self._bank.names
        self.states = Labels.of(self._bank.observers["nominal"].model).in_columns(plant.columns).state_titles

    def _start(self) -> None:
        """The first sample comes next."""
        self._bank = self.plant.bank(self.noise)
        self._scheduler = self.plant.scheduler()
        if self._keeps_times and self._bank.jitter is not None and self.plant.columns.inputs:
            raise ValueError(
                '[log] states times = "events" and [model] jitter, and which input such a reading had is known only '
                "afterwards; expected svo detect for the whole log"
            )
        self._schedules: deque[Any] = deque(maxlen=KEPT_SCHEDULES)
        self._times: deque[float] = deque(maxlen=KEPT_SCHEDULES)
        self._held: Array | None = None
        self._time = 0.0
        self._verdict: Verdict | None = None
        self._dead: dict[str, float] = {}

    def warm_up(self) -> float:
        """Load whatever a sample can need; returns the seconds that it took."""
        return self._bank.warm_up()

    def feed(self, item: Line | Notice | str) -> list[Alarm]:
        """The next line, and all alarms that it leads to; see `events` and `take`."""
        return [alarm for event in self.events(item) for alarms in self.take(event) for alarm in alarms]

    def events(self, item: Line | Notice | str) -> Iterator[Event]:
        """What the next line of the log comes to; the header comes first.

        Raises
        ------
        ValueError
            If the first line of the log is no header of the plant's columns.
        """
        if isinstance(item, Notice):
            self._notes.append(item.text)
            if item.new_file:
                self._reader.begin_file()
            return
        if isinstance(item, str):
            item = Line(self._reader.line + 1, item)
        row = self._reader.row(item)
        if row is not None:
            yield from self._timeline.add(row)

    def finish(self) -> Iterator[Event]:
        """What is left when no line follows."""
        return self._timeline.finish()

    def take(self, event: Event) -> Iterator[list[Alarm]]:
        """Go through an event, sample by sample.

        Yields
        ------
        list of Alarm
            Models that a sample falsified, with their proofs.
        """
        if event.kind == "bad":
            self._bad(event.why)
        elif event.kind == "repeat":
            self.counts.repeats += 1
        elif event.kind == "restart":
            self._start_again(f"{event.row.place}: {event.why}")
        elif event.kind == "missing":
            yield from self._gap(event)
        else:
            yield from self._row(event.row)

    def take_notes(self) -> list[str]:
        """What a reader should know of, since this was last asked."""
        notes, self._notes = self._notes, []
        return notes

    @property
    def samples(self) -> int:
        """Samples so far."""
        return self._samples

    @property
    def waits(self) -> bool:
        """Whether a row waits for the one that confirms its time; then there is no `state` to save."""
        return self._timeline.waits

    def state(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Everything that the next samples depend on: named arrays, and what JSON can hold.

        Raises
        ------
        TypeError
            If an observer, or the plant's scheduler, cannot be saved.
        """
        arrays = {f"bank.{name}": value for name, value in self._bank.state_dict().items()}
        arrays |= {f"schedule.{name}": value for name, value in saved_schedule(self._scheduler).items()}
        if self._held is not None:
            arrays["held"] = self._held
        if all(isinstance(value, float) for value in self._schedules):
            arrays["schedules"] = np.array(self._schedules, dtype=np.float64)
        if self._keeps_times:
            arrays["times"] = np.array(self._times, dtype=np.float64)
        totals = {"samples": self._samples, "undecided": self._undecided, "seconds": self._seconds}
        rest = {"header": self._reader.state(), "timeline": self._timeline.state(), "counts": asdict(self.counts)}
        return arrays, {**totals, **rest, "time": self._time, "dead": self._dead}

    def resume(self, arrays: Mapping[str, NDArray[Any]], rest: Mapping[str, Any]) -> None:
        """Go on from what `state` gave, before the first line.

        Raises
        ------
        KeyError, TypeError, ValueError
            If it is not the state of such a session.
        """
        self._bank.load_state_dict(_part(arrays, "bank."))
        resume_schedule(self._scheduler, _part(arrays, "schedule."))
        self._held = arrays.get("held")
        self._schedules.extend(arrays.get("schedules", np.zeros(0)).tolist())
        self._times.extend(arrays.get("times", np.zeros(0)).tolist())
        self._samples, self._undecided = int(rest["samples"]), int(rest["undecided"])
        self._seconds, self._time = float(rest["seconds"]), float(rest["time"])
        self._dead = {str(name): float(time) for name, time in rest["dead"].items()}
        self.counts = Counts(**rest["counts"])
        self._timeline.resume(rest["timeline"])
        self._reader.resume(rest["header"])

    def status(self) -> Status | None:
        """The conclusion at the latest sample, with bounds of the states; None before the first one."""
        verdict = self._verdict
        if verdict is None:
            return None
        boxes = {name: verdict.steps[name].box for name in verdict.alive if name in verdict.steps}
        per_sample = self._seconds / self._samples
        return Status(
            self._samples, self._time, verdict, boxes, dict(self._dead), self._undecided, per_sample, self.counts
        )

    def _gap(self, event: Event) -> Iterator[list[Alarm]]:
        """Samples without a row, at times between those of the rows beside them."""
        assert self._held is not None
        before, step = self._time, (event.row.time - self._time) / (event.count + 1)
        nothing = np.full(event.row.y.shape, np.nan)
        self._notes.append(
            f"{event.row.place}: {event.count} samples have no row; their readings are missing, and the input of "
            f"{before:.9g} s is taken to be held"
        )
        for i in range(1, event.count + 1):
            self.counts.held += 1
            yield self._sample(before + i * step, self._held, nothing, True)

    def _row(self, row: Row) -> Iterator[list[Alarm]]:
        u, unknown = row.u, np.isnan(row.u)
        if self._held is None and unknown.any():
            self._notes.append(f"{row.place}: the first sample needs its inputs; the next row is the first one")
            return
        if unknown.any():
            assert self._held is not None
            u = np.where(unknown, self._held, u)
            self.counts.held += not self._keeps_times
        is_unread = bool(np.isnan(row.y).all())
        if self._keeps_times and is_unread and self._held is not None and np.array_equal(u, self._held):
            return  # no event
        try:
            yield self._sample(row.time, u, row.y, is_unread and not self._keeps_times)
        except ValueError as error:  # numbers beyond what a model can take
            self._bad(f"{row.place}: {error}")
            self._start_again(f"{row.place}: the bank refused the sample")

    def _start_again(self, why: str) -> None:
        self.counts.runs += 1
        self._notes.append(f"{why}; a new run begins with the next sample, from the set of first states on")
        self._start()

    def _sample(self, time: float, u: Array, y: Array, missing: bool) -> list[Alarm]:
        begun = perf_counter()
        schedule = schedule_of(self._scheduler, y, u)
        self._schedules.append(schedule)
        own = {} if self._held is None or not self._keeps_times else {"dt": time - self._time}
        verdict = advance(self._bank, self._held, y, u, schedule, **own)
        self._times.append(time)
        self._held, self._time, self._verdict = u, time, verdict
        self._samples += 1
        self.counts.missing += missing
        self._undecided += sum(step.verdict == "undecided" for step in verdict.steps.values())
        alarms = self._alarms(verdict)
        self._seconds += perf_counter() - begun
        return alarms

    def _alarms(self, verdict: Verdict) -> list[Alarm]:
        """Models that died just now; one that is alive again is forgotten."""
        alive = verdict.alive if verdict.state == "unexplained" else (*verdict.alive, GLOBAL)
        self._dead = {name: time for name, time in self._dead.items() if name not in alive}
        origin: dict[str, Any] = source_of_bank(self.plant) | {"noise": self.noise, "log": Path(self.source).name}
        new = []
        for name in (*self.names, GLOBAL):
            step = verdict.steps.get(name)
            if step is not None and step.certificate is not None and name not in alive and name not in self._dead:
                proof, observer = step.certificate, self._bank.observers[name]
                values = list(self._schedules)[-len(proof.samples) :]
                alarm = alarm_of(name, verdict.sample, self._time, proof, origin, observer, values)
                times = list(self._times)[-len(proof.samples) :]
                new.append(replace(alarm, dt=np.diff(times)) if self._keeps_times else alarm)
        self._dead |= {alarm.observer: alarm.time for alarm in new}
        return new

    def _bad(self, why: str) -> None:
        """Count a line that cannot be used, and report the first ones, then ever fewer."""
        self.counts.bad += 1
        count = self.counts.bad
        if count <= 10 or count & (count - 1) == 0:
            self._notes.append(f"bad line {count}: {why}")


def identity_of(plant: MonitoredPlant, noise: str, log: str) -> dict[str, str]:
    """What a watch is about: its alarms and its state are no other one's; a log "-" is a stream."""
    where = log if log == "-" else os.path.abspath(log)
    return {**source_of_bank(plant), "noise": noise, "log": where, **description_digest(plant)}


def _part(arrays: Mapping[str, NDArray[Any]], prefix: str) -> dict[str, NDArray[Any]]:
    return {name.removeprefix(prefix): value for name, value in arrays.items() if name.startswith(prefix)}
