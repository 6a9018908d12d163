"""What a bank found in a log, whoever read it: what the command line prints of it, and writes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from polytopes.shown import Shown, in_a_line
from polytopes.signatures import options_by_name
from svo.detection.alarm_folder import ALARMS, VERDICT, check_no_results, remove_report
from svo.interval.on_log import ThresholdDetection
from svo.isolation import Alarm, write_alarms
from svo.pictures.style import in_seconds
from svo.plant import MonitoredPlant
from svo.plant.description import check_kept_description, keep_description
from svo.store import write_text, write_whole
from svo.terminal import json_text, line


class ChangeAt(NamedTuple):
    """From a time [s] on a bank's state, and the models that it does not declare falsified."""

    time: float
    state: str
    alive: tuple[str, ...]


class Findings(Shown, ABC):
    """What a plant's bank found in a log; printed, it says what ``svo detect`` says.

    Attributes
    ----------
    plant : MonitoredPlant
    noise : str
        The noise set whose bounds were assumed.
    alarms : tuple of Alarm
        Every certified falsification, in order of time.
    thresholds : ThresholdDetection or None
        What an interval detector beside the bank says, if the plant has one; it is no proof.
    """

    plant: MonitoredPlant
    noise: str
    alarms: tuple[Alarm, ...]
    thresholds: ThresholdDetection | None

    @property
    @abstractmethod
    def samples(self) -> int:
        """Of the log."""

    @property
    @abstractmethod
    def detected_s(self) -> float | None:
        """Time of the first falsification of the nominal model."""

    @property
    @abstractmethod
    def isolated_s(self) -> float | None:
        """First time at which exactly one fault was left."""

    @property
    @abstractmethod
    def fault(self) -> str | None:
        """The fault that was isolated then."""

    @property
    @abstractmethod
    def changes(self) -> tuple[ChangeAt, ...]:
        """What the bank says from the first sample on, and then whenever that changes."""

    @property
    @abstractmethod
    def undecided(self) -> int:
        """Answers that were neither a proof nor a point."""

    @property
    @abstractmethod
    def reason(self) -> str | None:
        """Of the first undecided answer that has one: the observer, the sample, and why."""

    @property
    @abstractmethod
    def stopped(self) -> int:
        """Programs that ended at a limit."""

    @property
    def state(self) -> str:
        """Of the bank at the end."""
        return self.changes[-1].state

    @property
    def alive(self) -> tuple[str, ...]:
        """Models that explain the data to the end."""
        return self.changes[-1].alive

    @property
    def restarted(self) -> tuple[str, ...]:
        """Models that were falsified, began again (`recovery` of the bank) and explain the data to the end."""
        falsified = {alarm.observer for alarm in self.alarms}
        return tuple(name for name in self.alive if name in falsified)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the certificates, for JSON; ``changes`` lists the verdict whenever it changed."""
        return {
            "plant": self.plant.name,
            "noise": self.noise,
            "samples": self.samples,
            "state": self.state,
            "detected_s": self.detected_s,
            "isolated_s": self.isolated_s,
            "fault": self.fault,
            "alive": list(self.alive),
            "restarted": list(self.restarted),
            "falsified_s": {alarm.observer: alarm.time for alarm in self.alarms},
            "undecided": self.undecided,
            "stopped": self.stopped,
            **({} if self.reason is None else {"undecided_because": self.reason}),
            "changes": [{"time_s": c.time, "state": c.state, "alive": list(c.alive)} for c in self.changes],
        } | ({} if self.thresholds is None else {"interval_detector": self.thresholds.to_dict()})

    @options_by_name
    def save(self, folder: str | Path, *, overwrite: bool = False) -> None:
        """Write alarms.jsonl (with certificates) and verdict.json into a folder, which is made if need be.

        A plant's description is copied beside them, so that `svo.verify` finds the model that they are about.

        Parameters
        ----------
        folder : path
        overwrite : bool
            Replace what was saved there before.

        Raises
        ------
        ValueError
            If the folder holds results already, or another description; where these are to be overwritten, if it
            holds those of another command.
        """
        folder = Path(folder)
        check_no_results(folder, overwrite)
        if not overwrite:
            check_kept_description(self.plant, folder)
        folder.mkdir(parents=True, exist_ok=True)
        if overwrite:
            remove_report(folder)
        write_whole(folder / ALARMS, lambda file: write_alarms(file, self.alarms))
        write_text(folder / VERDICT, json_text(self.to_dict(), indent=2) + "\n")
        keep_description(self.plant, folder, overwrite)

    def __str__(self) -> str:
        return "\n".join(line(text) for text in self._lines())

    def __repr__(self) -> str:
        about = f"{self.plant.name!r:.60}, {self.samples} samples"
        return in_a_line(f"<{type(self).__name__} of {about}: {next(self._lines())}>")

    def _lines(self) -> Iterator[str]:
        yield from self._conclusion()
        for alarm in self.alarms:
            yield f"    {alarm.observer}: falsified at {self._when(alarm.time)}"
        for name in self.alive:
            again = ", begun again after it was falsified (recovery)" if name in self.restarted else ""
            yield f"    {name}: explains the data to the end{again}"
        if not self.alive:
            yield f"No model explains the data from {self._when(max(alarm.time for alarm in self.alarms))} on."
        if self.undecided:
            first = "" if self.reason is None else f", the first of {self.reason}"
            yield f"    undecided answers: {self.undecided}{first}"
        if self.stopped:
            yield f"    programs that ended at a limit, so that sets are wider: {self.stopped}"
        if self.thresholds is not None:
            yield self.thresholds.to_text()

    def _when(self, time: float) -> str:
        return in_seconds(time, self.plant.Ts)

    def _conclusion(self) -> Iterator[str]:
        if self.detected_s is None:
            yield f"No fault: the nominal model explains all {self.samples} samples ({self.noise} noise)."
            return
        yield f"Fault detected at {self._when(self.detected_s)}: the nominal model is falsified ({self.noise} noise)."
        if self.isolated_s is not None:
            yield f"Fault isolated at {self._when(self.isolated_s)}: {self.fault}."
        elif self.alive:
            yield "Not isolated: more than one model explains the data."
