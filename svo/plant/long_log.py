"""A plant's log from a file, in portions: a long one is never in memory as a whole."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.logs import file
from svo.logs.log import Log
from svo.plant.dialects import dialect_of
from svo.plant.log_file import check_measured, imported_log, read_log
from svo.plant.protocol import MonitoredPlant, expect_plant


@dataclass(frozen=True, eq=False)
class LongLog:
    """A log in a file that was read once to check it, and is read again, portion by portion.

    Attributes
    ----------
    path : Path
    plant : MonitoredPlant
        Whose log it is.
    samples : int
    begin_s, end_s : float
        Times of the first and the last sample.
    missing : (ny,) array of int
        Samples without a measurement of each sensor.
    kept : Log or None
        The log itself where it is not read in portions: a `[log]` table of the plant sets it on its grid, or it keeps
        its own times.
    widening : (ny,) array or None
        As that of a `Log`.
    """

    path: Path
    plant: MonitoredPlant
    samples: int
    begin_s: float
    end_s: float
    missing: NDArray[np.int64]
    kept: Log | None = None
    widening: Array | None = None
    _state: tuple[int, int] = field(default=(0, 0), repr=False)

    def portions(self) -> Iterator[Log]:
        """The portions, one after the other, without notes.

        Raises
        ------
        ValueError
            If the file is not what it was when it was checked.
        """
        if self.kept is not None:
            yield self.kept
            return
        self._check_unchanged()
        for portion in file.read_portions(self.path, self.plant.columns, self.plant.Ts, note=lambda _: None):
            yield replace(portion, x=None)
        self._check_unchanged()

    def _check_unchanged(self) -> None:
        if _state_of(self.path) != self._state:
            raise ValueError(
                f"{self.path} was changed while it was read; svo watch follows a log that is still growing"
            )


def survey_log(path: str | Path, plant: MonitoredPlant) -> LongLog:
    """Read a log of any length once, to check all of it before anything is concluded; as `read_log`, but not kept.

    Parameters
    ----------
    path : path
    plant : MonitoredPlant

    Warns
    -----
    LogNote
        As `read_log`.

    Raises
    ------
    TypeError, ValueError, OSError
        As `read_log`.
    """
    expect_plant(plant)
    path = Path(path)
    imported = imported_log(path, plant)
    if imported.events if imported is not None else dialect_of(plant) is not None:
        log = read_log(path, plant)
        missing = np.isnan(log.y).sum(axis=0)
        return LongLog(path, plant, len(log), float(log.time[0]), float(log.time[-1]), missing, log, log.widening)
    samples, begin, end = 0, 0.0, 0.0
    missing = np.zeros(len(plant.columns.outputs), dtype=np.int64)
    before = _state_of(path) if path.exists() else (0, 0)  # reading says best what is wrong with a path
    for portion in file.read_portions(path, plant.columns, plant.Ts):
        begin = begin if samples else float(portion.time[0])
        end = float(portion.time[-1])
        samples += len(portion)
        missing += np.isnan(portion.y).sum(axis=0)
    check_measured(path, plant, missing, samples)
    widening = None if imported is None else imported.wider
    return LongLog(path, plant, samples, begin, end, missing, None, widening, before)


def _state_of(path: Path) -> tuple[int, int]:
    """What tells one content of a file from another."""
    found = path.stat()
    return found.st_size, found.st_mtime_ns
