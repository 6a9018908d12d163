"""Smoke test of the interval detector on a real flight (ALFA): pitch and roll against their commands.

Run with ``SVO_DATA=FOLDER python -m benchmarks.real_flight``. Commands and angles were recorded at about 20 Hz and are
resampled at 20 Hz (the latest value is held). From 10 s to 60 s of the flight g and h of x+ = g x + (1 - g) h u are
identified and the noise is characterised; the detector runs from 60 s to the engine's failure, and after it. The
failure is real but none of pitch or roll, so this shows that the tools take flight data, not that they find it.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks._servo_detectors import gains_of_parts
from benchmarks._servo_records import VARIABLE, data_folder
from svo.interval import GainBounds, IntervalDetector, IntervalPredictor, NoiseCharacterization
from svo.interval.identification import identify_first_order
from svo.logs.log import Log

Ts = 0.05
LEARN = (10.0, 60.0)
POLE, QBAR, SAFETY = 0.9, 100, 1.2


def angle(folder: Path, name: str) -> Log:
    """Command and measurement of an angle [deg], resampled; time since the first airspeed record [s]."""
    stamps, rows = _columns(folder, f"mavros-nav_info-{name}.csv", ("field.commanded", "field.measured"))
    time = np.arange(stamps[0], stamps[-1], Ts)
    latest = np.searchsorted(stamps, time, side="right") - 1
    return Log(time=time, u=rows[latest, :1], y=rows[latest, 1:])


def failure_time(folder: Path) -> float:
    """First record of the engine's failure [s]."""
    return float(_columns(folder, "failure_status-engines.csv", ())[0][0])


def between(log: Log, begin: float, end: float) -> Log:
    """The samples from one time until before another [s]."""
    chosen = (log.time >= begin) & (log.time < end)
    return Log(time=log.time[chosen], u=log.u[chosen], y=log.y[chosen])


def main() -> None:
    """Run and print; without recordings, say so."""
    folder = data_folder()
    if folder is None:
        print(f"skipped: set {VARIABLE} to the folder that has alfa/mavros-nav_info-roll.csv")
        return
    failed = failure_time(folder)
    table = Table(title=f"Samples in alarm, a = {POLE:g}; the engine fails at {failed:.2f} s", title_justify="left")
    for column in ("angle", "g", "h", "lambda_1 [deg]", f"{LEARN[1]:g} s to the failure", "after it", "(7) fails at"):
        table.add_column(column, justify="left" if column == "angle" else "right")
    for name in ("roll", "pitch"):
        table.add_row(*_row(name, angle(folder, name), failed))
    Console(width=130).print(table)


def _row(name: str, log: Log, failed: float) -> list[str]:
    learning, healthy, after = between(log, *LEARN), between(log, LEARN[1], failed), between(log, LEARN[1], np.inf)
    gains = gains_of_parts(identify_first_order(learning, parts=2))
    noise = NoiseCharacterization.from_records(
        _predictor(gains, learning).predict(learning).residual, QBAR, safety_factor=SAFETY
    )
    found = IntervalDetector(_predictor(gains, after), noise, POLE).run(after)
    calm = found.exceeded[: len(healthy)]
    check = noise.check(_predictor(gains, healthy).predict(healthy).residual)
    return [
        name,
        f"{gains.gc:.3f} +- {gains.gr:.3f}",
        f"{gains.hc:.2f} +- {gains.hr:.2f}",
        f"{noise.peak:.1f}",
        f"{int(calm.sum())} of {len(calm)}",
        f"{int(found.exceeded[len(healthy) :].sum())} of {len(after) - len(healthy)}",
        f"{check.violated.size} of {QBAR} q",
    ]


def _predictor(gains: GainBounds, log: Log) -> IntervalPredictor:
    return IntervalPredictor(gains, (float(log.y[0, 0]), 5.0))


def _columns(folder: Path, name: str, columns: tuple[str, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times since the first airspeed record [s], (K,), and columns (K, n) of a file of the flight."""
    with (folder / "alfa" / "mavros-nav_info-airspeed.csv").open(encoding="utf-8") as file:
        start = int(next(csv.DictReader(file))["%time"])
    with (folder / "alfa" / name).open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    values = np.array([[float(row[column]) for column in columns] for row in rows]).reshape(len(rows), len(columns))
    return np.array([1e-9 * (int(row["%time"]) - start) for row in rows]), values


if __name__ == "__main__":
    main()
