"""A recorded log as a plain one (``svo import``), with what was read, from where and by which table beside it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from svo.checks import Array
from svo.logs import file
from svo.logs.dialect.read import Reading, noted, read_dialect
from svo.logs.log import Log
from svo.logs.names import Columns
from svo.logs.parquet import told_in, write_parquet
from svo.plant.dialects import dialect_of
from svo.plant.protocol import MonitoredPlant
from svo.store import digest_of, write_whole

SUFFIX = ".parquet"
_KEY = "svo.import"


@dataclass(frozen=True)
class Told:
    """What an imported log says of where it comes from.

    Attributes
    ----------
    source : str
        Name of the file or folder.
    sha256 : mapping of str to str
        Of each file that was read, by its name.
    start : str
        The first sample's own time.
    log : str or None
        The `[log]` table, as JSON; None for a plain log.
    widening : tuple of float or None
        As of `svo.Log`.
    notes : tuple of str
    events : bool
        Whether it keeps its own times.
    """

    source: str
    sha256: Mapping[str, str]
    start: str
    log: str | None
    widening: tuple[float, ...] | None
    notes: tuple[str, ...]
    events: bool = False

    @property
    def wider(self) -> Array | None:
        """The widening as an array (ny,)."""
        return None if self.widening is None else np.array(self.widening)

    def __str__(self) -> str:
        files = ", ".join(f"{name} (SHA-256 {digest})" for name, digest in self.sha256.items())
        return f"imported from {self.source}: {files}"


def told_of(path: str | Path) -> Told | None:
    """What a log says of where it was imported from; None for one that was not.

    Raises
    ------
    ValueError
        If it is damaged.
    """
    path = Path(path)
    text = told_in(path, _KEY) if path.suffix.lower() == SUFFIX and path.is_file() else None
    if text is None:
        return None
    try:
        found = json.loads(text)
        widening = None if found["widening"] is None else tuple(float.fromhex(value) for value in found["widening"])
        return Told(**{**found, "widening": widening, "notes": tuple(found["notes"])})
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"{path}: what it says of its source is damaged ({error!r}); import it again") from error


@dataclass(frozen=True, eq=False)
class Imported:
    """A log that was imported; printed, it says what ``svo import`` says."""

    path: Path
    log: Log
    columns: Columns
    Ts: float
    told: Told

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "path": str(self.path),
            **asdict(self.told),
            "samples": len(self.log),
            "end_s": float(self.log.time[-1]),
            "channels": [
                {"name": name, "unit": unit, "missing": int(np.isnan(values).sum()), "range": _range(values)}
                for name, unit, values in self._channels
            ],
        }

    def __str__(self) -> str:
        each = "at times of their own" if self.told.events else f"of {self.Ts:g} s"
        span = f"{len(self.log)} samples {each}, 0 to {self.log.time[-1]:.9g} s"
        lines = [f"{self.path}: {span}, the first one at {self.told.start}"]
        for name, unit, values in self._channels:
            ends = _range(values)
            between = "no reading" if ends is None else f"{ends[0]:.6g} to {ends[1]:.6g} {unit}"
            lines.append(f"    {name}: {between}, {int(np.isnan(values).sum())} missing")
        for column, wider in zip(self.columns.outputs, self.told.widening or (), strict=False):
            if wider:
                lines.append(f"    n of {column.name} is wider on this log, by {wider:.6g} {column.unit}")
        return "\n".join(lines)

    @property
    def _channels(self) -> list[tuple[str, str, np.ndarray]]:
        groups = (self.columns.inputs, self.log.u), (self.columns.outputs, self.log.y)
        return [(c.name, c.unit, values[:, i]) for group, values in groups for i, c in enumerate(group)]


def import_log(source: str | Path, plant: MonitoredPlant, out: str | Path) -> Imported:
    """Read a log as a plant states it and write it as a plain one.

    Parameters
    ----------
    source : path
        A file or folder of any dialect that the plant's `[log]` states.
    plant : MonitoredPlant
    out : path of a .parquet file
        Replaced if it is there.

    Warns
    -----
    LogNote
        Of whatever was read in a way that its reader should know of.

    Raises
    ------
    ValueError, OSError, ImportError
        As `svo.read_log`; and if ``out`` is no Parquet file, or is the source.
    """
    source, out = Path(source), Path(out)
    if out.suffix.lower() != SUFFIX:
        raise ValueError(
            f"{out} has the suffix {out.suffix!r}; expected {SUFFIX}, which keeps where the log comes from"
        )
    if out.exists() and out.samefile(source):
        raise ValueError(f"{out} is the log itself; give another name, or it would be lost")
    reading = _read(source, plant)
    log, dialect = noted(reading, source), dialect_of(plant)
    told = Told(
        source=source.name,
        sha256={name: digest_of(path) for name, path in _files(source, plant).items()},
        start=reading.start,
        log=None if dialect is None else dialect.stated,
        widening=None if log.widening is None else tuple(log.widening.tolist()),
        notes=reading.notes,
        events=bool(log.events),
    )
    exact = None if told.widening is None else [value.hex() for value in told.widening]
    text = json.dumps({**asdict(told), "widening": exact}, ensure_ascii=False)
    cells = log.to_columns(plant.columns)
    write_whole(out, lambda path: write_parquet(path, cells, {_KEY: text}))
    return Imported(out, log, plant.columns, plant.Ts, told)


def _read(source: Path, plant: MonitoredPlant) -> Reading:
    dialect = dialect_of(plant)
    if dialect is not None:
        return read_dialect(source, plant.columns, plant.Ts, dialect)
    log = file.read_log(source, plant.columns, plant.Ts)
    return Reading(log, f"{log.time[0]:.9g} s", ())


def _files(source: Path, plant: MonitoredPlant) -> dict[str, Path]:
    """The files that were read."""
    dialect = dialect_of(plant)
    if not source.is_dir() or dialect is None:
        return {source.name: source}
    names = dict.fromkeys(channel.file for channel in dialect.channels.values() if channel.file is not None)
    return {name: source / name for name in names}


def _range(values: np.ndarray) -> list[float] | None:
    known = values[~np.isnan(values)]
    return [float(known.min()), float(known.max())] if known.size else None
