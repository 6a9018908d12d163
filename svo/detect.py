"""Detection on a log, sample by sample, as an online loop would do it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.alarms import Alarm, write_alarms
from svo.isolation.architectures import ArchitectureI, Verdict
from svo.log import Log
from svo.plant import Plant

Scheduler = Callable[[NDArray[np.float64]], Any]


@dataclass(frozen=True)
class Detection:
    """What a bank said about a log. Times are those of the log [s]; None where it did not happen.

    Attributes
    ----------
    plant, noise : str
    samples : int
    detected_s, isolated_s : float or None
        First falsification of the nominal model, and the first time at which one fault was left.
    fault : str or None
        The fault that was isolated.
    state : str
        State of the bank at the end: "nominal", "detected", "isolated" or "unexplained".
    alive : tuple of str
        Models that still explain the data at the end.
    died_s : mapping of str to float
        When each falsified model was falsified.
    undecided : int
        Answers that were neither a proof nor a point.
    changes : tuple of (time, state, alive)
        The verdict whenever it changed, the first sample included.
    alarms : tuple of Alarm
        Every certified falsification.
    """

    plant: str
    noise: str
    samples: int
    detected_s: float | None
    isolated_s: float | None
    fault: str | None
    state: str
    alive: tuple[str, ...]
    died_s: Mapping[str, float]
    undecided: int
    changes: tuple[tuple[float, str, tuple[str, ...]], ...]
    alarms: tuple[Alarm, ...]

    def to_dict(self) -> dict[str, Any]:
        """Everything but the certificates, for JSON."""
        names = ("plant", "noise", "samples", "detected_s", "isolated_s", "fault", "state", "undecided")
        return {
            **{name: getattr(self, name) for name in names},
            "alive": list(self.alive),
            "died_s": dict(self.died_s),
            "changes": [{"time_s": t, "state": state, "alive": list(alive)} for t, state, alive in self.changes],
        }


def verdicts(bank: ArchitectureI, log: Log, scheduler: Scheduler | None = None) -> Iterator[Verdict]:
    """The bank's verdict at each sample of a log.

    Without a ``scheduler`` the schedule is the log's own. Sets and boxes of a verdict's steps must be read before
    the next verdict is asked for.
    """
    for k in range(len(log)):
        schedule = log.schedule_at(k) if scheduler is None else scheduler(log.y[k])
        if k == 0:
            yield bank.update(log.y[0], u=log.u[0], schedule=schedule)
        else:
            yield bank.step(log.u[k - 1], log.y[k], u_next=log.u[k], schedule=schedule)


def detect(
    plant: Plant,
    log: Log,
    noise: str,
    *,
    source: Mapping[str, str] | None = None,
    progress: Callable[[int], None] | None = None,
) -> Detection:
    """Run a plant's bank over a log and collect what it found.

    Parameters
    ----------
    plant : Plant
    log : Log
        Only time, u and y are used; the plant's own scheduler makes the schedule from y.
    noise : str
        Noise set whose bounds the observers assume.
    source : mapping, optional
        Where the log comes from; stored in each alarm beside plant and noise set.
    progress : callable, optional
        Called with the number of samples done, at each sample.
    """
    bank = plant.bank(noise)
    origin = {"plant": plant.name, "noise": noise, **(source or {})}
    alarms: list[Alarm] = []
    changes: list[tuple[float, str, tuple[str, ...]]] = []
    detected_s = isolated_s = fault = None
    undecided = 0
    living: tuple[str, ...] = tuple(bank.names)
    for k, verdict in enumerate(verdicts(bank, log, plant.scheduler())):
        time = float(log.time[k])
        fallen = [name for name in living if name not in verdict.alive]
        alarms += [Alarm(name, k, time, verdict.steps[name].certificate, origin) for name in fallen]
        living = verdict.alive
        undecided += sum(step.verdict == "undecided" for step in verdict.steps.values())
        if not changes or changes[-1][1:] != (verdict.state, living):
            changes.append((time, verdict.state, living))
        if detected_s is None and verdict.detected_at is not None:
            detected_s = float(log.time[verdict.detected_at])
        if isolated_s is None and verdict.isolated_at is not None:
            isolated_s, fault = float(log.time[verdict.isolated_at]), verdict.fault
        if progress is not None:
            progress(k + 1)
    return Detection(
        plant=plant.name,
        noise=noise,
        samples=len(log),
        detected_s=detected_s,
        isolated_s=isolated_s,
        fault=fault,
        state=changes[-1][1],
        alive=living,
        died_s={alarm.observer: alarm.time for alarm in alarms},
        undecided=undecided,
        changes=tuple(changes),
        alarms=tuple(alarms),
    )


def write_detection(folder: Path, detection: Detection) -> None:
    """Write alarms.jsonl (with certificates) and verdict.json into a folder, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    write_alarms(folder / "alarms.jsonl", detection.alarms)
    (folder / "verdict.json").write_text(json.dumps(detection.to_dict(), indent=2) + "\n", encoding="utf-8")
