"""What a bank found in a log, with what it said at each sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import Picture
from polytopes.signatures import options_by_name
from svo.detection.findings import ChangeAt, Findings
from svo.interval.on_log import ThresholdDetection
from svo.isolation import Alarm, BankRecord, Verdict
from svo.logs.log import Log
from svo.plant import MonitoredPlant

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, repr=False)
class Detection(Findings):
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
    def samples(self) -> int:
        return len(self.log)

    @property
    def detected_s(self) -> float | None:
        return self._at(self.record.detected_at)

    @property
    def isolated_s(self) -> float | None:
        return self._at(self.record.isolated_at)

    @property
    def fault(self) -> str | None:
        return self.record.fault

    @property
    def undecided(self) -> int:
        return int(self.record.undecided.sum())

    @property
    def reason(self) -> str | None:
        return self.record.reason

    @property
    def stopped(self) -> int:
        return int(self.record.stopped.sum())

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

    @property
    def changes(self) -> tuple[ChangeAt, ...]:
        alive, states = self.record.alive, self.record.states
        first = [0, *(np.flatnonzero((alive[1:] != alive[:-1]).any(axis=1)) + 1).tolist()]
        said = sorted({*first, *(k for k in range(1, len(states)) if states[k] != states[k - 1])})
        return tuple(ChangeAt(float(self.time[k]), states[k], self._alive(k)) for k in said)

    def _picture(self) -> Picture:
        return self.record._picture()

    def _at(self, sample: int | None) -> float | None:
        return None if sample is None else float(self.time[sample])

    def _alive(self, sample: int) -> tuple[str, ...]:
        return tuple(name for name, alive in zip(self.record.names, self.record.alive[sample], strict=True) if alive)
