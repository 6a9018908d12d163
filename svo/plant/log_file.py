"""A plant's log from a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from svo.logs import file
from svo.logs.columns import noted as note
from svo.logs.dialect.read import noted, read_dialect
from svo.logs.log import Log
from svo.plant.dialects import dialect_of
from svo.plant.imported import Told, told_of
from svo.plant.protocol import MonitoredPlant, expect_plant


def read_log(path: str | Path, plant: MonitoredPlant) -> Log:
    """A log to judge a plant by.

    Parameters
    ----------
    path : path of a .csv, .parquet or .mat file
        With the plant's columns, under the rules of `svo.logs.columns`; or whatever the `[log]` table of a described
        plant says of it, then also a folder, or a text file of any suffix.
    plant : MonitoredPlant
        As `svo.find_plant` gives it: its columns and sampling time.

    Returns
    -------
    Log
        Without a schedule: the plant's scheduler makes it from y, sample by sample.

    Warns
    -----
    LogNote
        Of a sensor without any measurement, and whatever else was read in a way that its reader should know of.

    Raises
    ------
    TypeError
        If the plant is a name.
    ValueError
        Naming the file, the line or sample and the column, with what was found and what was expected; and if no
        sensor has a measurement.
    OSError
        If the file cannot be opened.
    """
    expect_plant(plant)
    log = _read(path, plant)
    check_measured(path, plant, np.isnan(log.y).sum(axis=0), len(log))
    return log


def check_measured(path: str | Path, plant: MonitoredPlant, missing: NDArray[np.int64], samples: int) -> None:
    """Note the sensors that never measure anything; one that does has to be there.

    Parameters
    ----------
    path : path
    plant : MonitoredPlant
    missing : (ny,) array of int
        Samples without a measurement of each sensor.
    samples : int
    """
    silent = [c.name for c, without in zip(plant.columns.outputs, missing, strict=True) if without == samples]
    if len(silent) == len(plant.columns.outputs):
        raise ValueError(
            f"{path} has no measurement: {', '.join(map(repr, silent))} empty in every row; expected numbers in one of "
            "these columns at least"
        )
    for name in silent:
        note(f"{path} has no measurement of {name!r}; nothing is concluded from that sensor")


def _read(path: str | Path, plant: MonitoredPlant) -> Log:
    dialect, imported = dialect_of(plant), imported_log(path, plant)
    if dialect is None or imported is not None:
        log = file.read_log(path, plant.columns, None if imported is not None and imported.events else plant.Ts)
        return log if imported is None else replace(log, widening=imported.wider)
    return noted(read_dialect(path, plant.columns, plant.Ts, dialect), path)


def imported_log(path: str | Path, plant: MonitoredPlant) -> Told | None:
    """What a log that ``svo import`` wrote for a ``plant`` says of itself, which is noted; None for others."""
    told = told_of(path)
    if told is None:
        return None
    dialect = dialect_of(plant)
    note(f"{path} was {told}")
    if told.log != (None if dialect is None else dialect.stated):
        note(f"{path} was imported by another [log] table than that of {plant.name}")
    if told.widening is not None and len(told.widening) != len(plant.columns.outputs):
        wanted = f"{len(plant.columns.outputs)}, as {plant.name} has"
        raise ValueError(f"{path} was imported for {len(told.widening)} outputs; expected {wanted}")
    return told
