"""A multicopter's flight logs at their own times, beside the same logs on grids.

Run with ``python -m benchmarks.recorded_events``; needs the recorded logs (``SVO_DATA``) and pyulog (extra ``ulog``),
whose ``ulog2csv`` exports them. The kinematic model of the height (`docs/examples/height.toml`) has the accelerometer
as its input, 20 Hz, and is read by the barometer, 20 Hz, and by satellites, 10 Hz, each with stamps of its own. On a
grid each reading stands at the nearest sample, and its noise is wider by a bound of its rate times the time moved; the
input is that of the sample, which nothing covers. One grid is that of the sampling time, the other has times to 1 % of
it, and its samples without a reading or a new input are left out. All hold 0.5 s of data. Widths are means over healthy
flight; the fault is that of a motor, whose instant the logs hold. Exit code 1 if the widths at the logs' own times are
not within 1 % of those on the fine grid, or more.
"""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks._observers import table
from svo import Log, WindowObserver, find_plant, read_log
from svo.checks import Array
from svo.logs.columns import LogNote

PLANT = Path(__file__).parents[1] / "docs" / "examples" / "height.toml"
TOPICS = ("vehicle_air_data", "vehicle_gps_position", "vehicle_acceleration")
RATES = np.array([2.0, 2.0, 10.0])  # of the readings [m/s, m/s, m/s^2]
SPAN = 0.5  # seconds of data in a window
SHARE = 0.01  # of the sampling time, to which times are held on the fine grid; and of the widths there
SETTLED = 2.0  # seconds after which widths count


def exported(ulog: Path, folder: Path) -> float:
    """One CSV file a topic of a flight log; the instant of the fault [s], by the log's clock."""
    from pyulog import ULog
    from pyulog.ulog2csv import convert_ulog2csv

    silent, sys.stdout = sys.stdout, open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    try:
        convert_ulog2csv(str(ulog), ",".join(TOPICS), str(folder), ",", None, None)
    finally:
        sys.stdout.close()
        sys.stdout = silent
    for topic in TOPICS:
        (folder / f"{ulog.stem}_{topic}_0.csv").rename(folder / f"{topic}.csv")
    marks = ULog(str(ulog), ["rfly_ctrl_lxl"]).data_list[0].data
    return float(marks["timestamp"][np.flatnonzero(marks["id"] != 0)[0]]) / 1e6


def begin_of(folder: Path) -> float:
    """The first event's own time [s]: that of the first input."""
    line = (folder / "vehicle_acceleration.csv").read_text(encoding="utf-8").splitlines()[1]
    return float(line.partition(",")[0]) / 1e6


def on_grid(log: Log, Ts: float) -> tuple[Log, Array]:
    """The log on a grid, and how far readings were moved at most (ny,) [s]."""
    time = Ts * np.arange(int(log.time[-1] / Ts) + 1)
    y, away = np.full((time.size, log.y.shape[1]), np.nan), np.full((time.size, log.y.shape[1]), np.inf)
    for k, row in zip(np.minimum(np.round(log.time / Ts).astype(int), time.size - 1), range(len(log)), strict=True):
        distance = abs(log.time[row] - time[k])
        nearer = ~np.isnan(log.y[row]) & (distance < away[k])
        y[k, nearer], away[k, nearer] = log.y[row, nearer], distance
    u = log.u[np.searchsorted(log.time, time, side="right") - 1]
    return Log(time, u, y, events=False), np.where(np.isinf(away), 0.0, away).max(axis=0)


def to_a_share(log: Log, h: float) -> tuple[Log, Array]:
    """The events of a log at the nearest multiples of h seconds, and how far readings were moved at most (ny,) [s]."""
    at, first = np.unique(np.round(log.time / h), return_index=True)
    y, away = np.full((at.size, log.y.shape[1]), np.nan), np.zeros(log.y.shape[1])
    for k, row in zip(np.searchsorted(at, np.round(log.time / h)), range(len(log)), strict=True):
        read = ~np.isnan(log.y[row])
        y[k, read] = log.y[row, read]
        away[read] = np.maximum(away[read], abs(log.time[row] - h * at[k]))
    last = np.append(first[1:], len(log)) - 1  # of those that fall on one
    return Log(h * at, log.u[last], y, events=True), away


def seen(model: Any, initial: Any, log: Log, fault: float, steps: int) -> tuple[Array, float | None, int, float]:
    """Mean widths in healthy flight, seconds to the falsification, samples, and milliseconds a sample."""
    begun = process_time()
    record = WindowObserver(model, initial, horizon=steps).run(log)
    cost = 1e3 * (process_time() - begun) / len(log)
    healthy = (log.time > SETTLED) & (log.time < fault) & ~np.isnan(record.lower[:, 0])
    at = record.falsified_at
    return (
        (record.upper - record.lower)[healthy].mean(axis=0),
        None if at is None else float(log.time[at]),
        len(log),
        cost,
    )


def main() -> None:
    """Read every flight both ways and print what is known of height and speed."""
    data = os.environ.get("SVO_DATA")
    if data is None:
        sys.exit("SVO_DATA is not set: it names the folder of the recorded data")
    plant, rows, within = find_plant(PLANT), [], True
    for ulog in sorted((Path(data) / "rflymad").glob("*.ulg")):
        with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
            warnings.simplefilter("ignore", LogNote)
            fault = exported(ulog, Path(name)) - begin_of(Path(name))
            log = read_log(name, plant)
        rate = len(log) / (log.time[-1] - log.time[0])
        sampled, moved = on_grid(log, plant.Ts)
        fine, little = to_a_share(log, SHARE * plant.Ts)
        wider = lambda by: plant.model.replace(n=np.asarray(plant.model.n) + RATES * by)  # noqa: E731
        widths = {}
        for what, model, own, steps in (
            ("events", plant.model, log, round(SPAN * rate)), (f"{SHARE:.0%}", wider(little), fine, round(SPAN * rate)),
            ("grid", wider(moved), sampled, round(SPAN / plant.Ts)),
        ):  # fmt: skip
            widths[what], at, samples, cost = seen(model, plant.initial, own, fault, steps)
            found = "-" if at is None else f"{at - fault:+.2f}"
            rows.append([ulog.stem, what, samples, *(f"{w:.4f}" for w in widths[what]), found, f"{cost:.2f}"])
        within = within and bool((widths["events"] <= (1.0 + SHARE) * widths[f"{SHARE:.0%}"]).all())
    columns = ["flight", "read as", "samples", "height [m]", "speed [m/s]", "falsified after [s]", "ms a sample"]
    table("Widths of the set in healthy flight", columns, rows)
    sys.exit(not within)


if __name__ == "__main__":
    main()
