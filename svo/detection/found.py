"""What a bank found in a log: what the command line prints of it, and writes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polytopes.signatures import options_by_name
from svo.detection.alarm_folder import ALARMS, VERDICT, check_no_results
from svo.interval.on_log import ThresholdDetection
from svo.isolation import Alarm, BankRecord, Verdict, write_alarms
from svo.logs.log import Log
from svo.plant import MonitoredPlant
from svo.plant.description import check_kept_description, keep_description
from svo.store import write_text, write_whole
from svo.terminal import line

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, repr=False)
class Detection:
    """What a plant's bank found in a log; printed, it says what ``svo detect`` says.

    Attributes
    ----------
    plant : MonitoredPlant
    noise : str
        The noise set whose bounds were assumed.
    log : Log
    record : BankRecord
    alarms : tuple of Alarm
        Every certified falsification, in order of time.
    thresholds : ThresholdDetection or None
        What an interval detector beside the bank says, if the plant has one; it is no proof.
    """

    plant: MonitoredPlant
    noise: str
    log: Log
    record: BankRecord
    alarms: tuple[Alarm, ...]
    thresholds: ThresholdDetection | None = None

    @property
    def time(self) -> NDArray[np.float64]:
        """The log's own times (K,) [s]."""
        return self.log.time

    @property
    def verdict(self) -> Verdict:
        """The bank's conclusion at the last sample, without steps."""
        return self.record.verdict

    @property
    def detected_s(self) -> float | None:
        """Time of the first falsification of the nominal model."""
        return self._at(self.record.detected_at)

    @property
    def isolated_s(self) -> float | None:
        """First time at which exactly one fault was left."""
        return self._at(self.record.isolated_at)

    @property
    def alive(self) -> tuple[str, ...]:
        """Models that explain the data to the end."""
        return self._alive(-1)

    @property
    def restarted(self) -> tuple[str, ...]:
        """Models that were falsified, began again (`recovery` of the bank) and explain the data to the end."""
        falsified = {alarm.observer for alarm in self.alarms}
        return tuple(name for name in self.alive if name in falsified)

    @options_by_name
    def plot(self, ax: Axes | None = None, *, channels: Sequence[str] | None = None) -> list[Artist]:
        """Draw what the bank concluded and which models were alive, above their bounds of each state and the readings.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Drawn in its place; a new figure if absent.
        channels : sequence of str, optional
            Names of the columns to draw, of states and outputs; all by default.

        Returns
        -------
        list of Artist
        """
        return self.record.plot(ax, channels=channels)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the certificates, for JSON; ``changes`` lists the verdict whenever it changed."""
        record = self.record
        return {
            "plant": self.plant.name,
            "noise": self.noise,
            "samples": len(self.time),
            "state": record.states[-1],
            "detected_s": self.detected_s,
            "isolated_s": self.isolated_s,
            "fault": record.fault,
            "alive": list(self.alive),
            "restarted": list(self.restarted),
            "falsified_s": {alarm.observer: alarm.time for alarm in self.alarms},
            "undecided": int(record.undecided.sum()),
            "stopped": int(record.stopped.sum()),
            "changes": [
                {"time_s": float(self.time[k]), "state": record.states[k], "alive": list(self._alive(k))}
                for k in range(len(self.time))
                if k == 0 or (record.states[k], self._alive(k)) != (record.states[k - 1], self._alive(k - 1))
            ],
        } | ({} if self.thresholds is None else {"interval_detector": self.thresholds.to_dict()})

    def save(self, folder: str | Path) -> None:
        """Write alarms.jsonl (with certificates) and verdict.json into a folder, which is made if need be.

        A plant's description is copied beside them, so that `svo.verify` finds the model that they are about.

        Parameters
        ----------
        folder : path

        Raises
        ------
        ValueError
            If the folder holds results already, or another description; nothing is overwritten.
        """
        folder = Path(folder)
        check_no_results(folder)
        check_kept_description(self.plant, folder)
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(folder / ALARMS, lambda file: write_alarms(file, self.alarms))
        write_text(folder / VERDICT, json.dumps(self.to_dict(), indent=2) + "\n")
        keep_description(self.plant, folder)

    def __str__(self) -> str:
        return "\n".join(line(text) for text in self._lines())

    def __repr__(self) -> str:
        said = line(next(self._lines()))
        return f"<Detection of {self.plant.name!r:.40}, {len(self.time)} samples: {said:.200}>"

    def _lines(self) -> Iterator[str]:
        yield from self._conclusion()
        for alarm in self.alarms:
            yield f"    {alarm.observer}: falsified at {alarm.time:g} s"
        for name in self.alive:
            again = ", begun again after it was falsified (recovery)" if name in self.restarted else ""
            yield f"    {name}: explains the data to the end{again}"
        if not self.alive:
            yield f"No model explains the data from {max(alarm.time for alarm in self.alarms):g} s on."
        undecided, stopped = int(self.record.undecided.sum()), int(self.record.stopped.sum())
        if undecided:
            yield f"    undecided answers: {undecided}"
        if stopped:
            yield f"    programs that ended at a limit, so that sets are wider: {stopped}"
        if self.thresholds is not None:
            yield self.thresholds.to_text()

    def _conclusion(self) -> Iterator[str]:
        if self.detected_s is None:
            yield f"No fault: the nominal model explains all {len(self.time)} samples ({self.noise} noise)."
            return
        yield f"Fault detected at {self.detected_s:g} s: the nominal model is falsified ({self.noise} noise)."
        if self.isolated_s is not None:
            yield f"Fault isolated at {self.isolated_s:g} s: {self.record.fault}."
        elif self.alive:
            yield "Not isolated: more than one model explains the data."

    def _at(self, sample: int | None) -> float | None:
        return None if sample is None else float(self.time[sample])

    def _alive(self, sample: int) -> tuple[str, ...]:
        return tuple(name for name, alive in zip(self.record.names, self.record.alive[sample], strict=True) if alive)
