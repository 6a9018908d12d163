"""The real recordings of the electro-mechanical positioning servo EMPS, as logs (reference in, position out)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from svo.logs.file import read_log
from svo.logs.log import Log
from svo.plant import Column, Columns

VARIABLE = "SVO_DATA"
COLUMNS = Columns(inputs=(Column("qg", "m"),), outputs=(Column("qm", "m"),), time="t")
Ts = 1e-3
RECORDS = {"standard": "DATA_EMPS.mat", "pulses": "DATA_EMPS_PULSES.mat"}


def data_folder() -> Path | None:
    """Where recorded data are, by the environment; None if it does not say."""
    folder = os.environ.get(VARIABLE)
    return Path(folder) if folder else None


def record(folder: Path, name: str) -> Log:
    """One recording of 24.84 s."""
    return read_log(folder / "emps" / RECORDS[name], COLUMNS, Ts)


def part(log: Log, begin: int, end: int | None, step: int = 1) -> Log:
    """Some samples of a log."""
    chosen = slice(begin, end, step)
    return Log(time=log.time[chosen], u=log.u[chosen], y=log.y[chosen])


def halves(log: Log) -> tuple[Log, Log]:
    """The first half, to learn from, and the second, to run on."""
    middle = len(log) // 2
    return part(log, 0, middle), part(log, middle, None)


def jam(log: Log, sample: int) -> Log:
    """The position stands still from a sample on."""
    y = log.y.copy()
    y[sample:] = y[sample]
    return Log(time=log.time, u=log.u, y=y)


def runaway(log: Log, sample: int, rate: float) -> Log:
    """The position drifts away from what it was, at a rate [m/s], from a sample on."""
    y = log.y.copy()
    elapsed = np.arange(1, len(y) - sample + 1) * Ts
    y[sample:, 0] += rate * elapsed
    return Log(time=log.time, u=log.u, y=y)
