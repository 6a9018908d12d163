"""A plant's log from a file."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from svo.logs import file
from svo.logs.columns import LogNote
from svo.logs.dialect.read import noted, read_dialect
from svo.logs.log import Log
from svo.plant.dialects import dialect_of
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
        said = f"{path} has no measurement of {name!r}; nothing is concluded from that sensor"
        warnings.warn(said, LogNote, stacklevel=3)


def _read(path: str | Path, plant: MonitoredPlant) -> Log:
    dialect = dialect_of(plant)
    if dialect is None:
        return file.read_log(path, plant.columns, plant.Ts)
    return noted(read_dialect(path, plant.columns, plant.Ts, dialect), path)
