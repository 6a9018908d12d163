"""Three tanks simulated by others, with noise and four faults: what a bank of nonlinear models finds in the records.

Run with ``SVO_DATA=FOLDER python -m benchmarks.three_tanks``. Bounds are from the first half of the healthy record; the
second half must leave all models of the bank alive, and each faulty record is run with the levels alone and with the
difference of achieved and commanded flow as a further reading. ``--healthy`` shortens the second half.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.progress import track
from scipy.io import loadmat

from benchmarks._observers import console, table
from benchmarks._servo_records import VARIABLE, data_folder, halves, part
from polytopes import HPolytope
from svo import ArchitectureI, Log, NonlinearModel, WindowObserver
from svo.checks import Array
from svo.faults import ParameterFault, SensorFault, Step
from svo.functions import sqrt, sroot

AREA, G2 = 154.0, 2 * 981.0  # cm^2, cm/s^2
PIPE_13, PIPE_32, OUTLET = 0.46 * 0.5, 0.45 * 0.5, 0.60 * 0.5  # coefficient times cross section, cm^2
HORIZON = 10
BEGIN = 200  # first faulty sample
SMOOTHED = 61  # samples of a mean that stands for the true level
MARGINS = (1.17, 2.1, 1.25)  # of the bounds over what a healthy record shows
FAULTS = ("fault01", "fault04", "fault07", "fault10")


def records(folder: Path) -> dict[str, Log]:
    """The healthy record and the four faulty ones: commanded flows, three levels, and achieved less commanded flow."""
    tables = {name: found for file in ("train", "faults_1_4_7_10") for name, found in _tables(folder, file).items()}
    return {name: _log(values) for name, values in tables.items()}


def _tables(folder: Path, file: str) -> dict[str, Array]:
    found = loadmat(folder / "three_tank" / f"{file}.mat")
    return {name: values for name, values in found.items() if not name.startswith("_")}


def _log(values: Array) -> Log:
    return Log(
        np.arange(len(values)) * 1.0, values[:, :2], np.column_stack([values[:, 4:], values[:, 2] - values[:, 0]])
    )


def without_flow(log: Log) -> Log:
    """The levels alone."""
    return Log(log.time, log.u, log.y[:, :3])


class Bounds(NamedTuple):
    """Of a level's noise [cm], of what the equations miss of its rate [cm/s], and of the achieved flow [cm^3/s]."""

    noise: float
    rate: float
    flow: float


def measured(log: Log) -> Bounds:
    """What a healthy record shows.

    The largest distance of a level from its mean over a minute, the standard deviation of what the equations miss of
    that mean's rate over a minute, and the largest difference of achieved and commanded flow.
    """
    levels, inside = log.y[:, :3], slice(SMOOTHED // 2, len(log) - SMOOTHED // 2)
    smooth = np.stack([np.convolve(level, np.full(SMOOTHED, 1 / SMOOTHED), "valid") for level in levels.T], axis=1)
    healthy = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (len(smooth), 1))  # no disturbance, no fault
    rates = plant(Bounds(1.0, 1.0, 1.0)).flow.tape.values(np.column_stack([smooth, healthy, log.u[inside]]))
    risen = np.vstack([np.zeros(3), np.cumsum(rates, axis=0)])
    missed = (smooth[60:] - smooth[:-60] - (risen[60:-1] - risen[:-61])) / 60.0
    return Bounds(np.abs(levels[inside] - smooth).max(), missed.std(), np.abs(log.y[:, 3]).max())


def learnt(log: Log) -> Bounds:
    """Bounds from a healthy record, with two digits."""
    shown = zip(MARGINS, measured(log), strict=True)
    return Bounds(*(float(f"{margin * value:.1e}") for margin, value in shown))


def plant(bounds: Bounds, with_flow: bool = False) -> NonlinearModel:
    """The healthy tanks, of commanded flows; the difference of flows is then zero within its bound."""

    def f(h, u, w, p):
        q13 = PIPE_13 * p[2] * sroot(G2 * (h[0] - h[2]))
        q32, q20 = PIPE_32 * sroot(G2 * (h[2] - h[1])), OUTLET * sqrt(G2 * h[1])
        leak = p[1] * sqrt(G2 * h[0])
        return [(u[0] + p[0] - q13 - leak) / AREA + w[0], (u[1] + q32 - q20) / AREA + w[1], (q13 - q32) / AREA + w[2]]

    return NonlinearModel(
        f, (lambda h, p: [h[0], h[1], h[2], p[0]]) if with_flow else (lambda h: h),
        states=["h1", "h2", "h3"], inputs=["Q1", "Q2"], disturbances=["d1", "d2", "d3"], w=[bounds.rate] * 3,
        outputs=["level 1", "level 2", "level 3", *(["flow 1 less command"] if with_flow else [])],
        parameters={"flow": (0.0, 0.0), "hole": (0.0, 0.0), "pipe": (1.0, 1.0)},
        n=[bounds.noise] * 3 + [bounds.flow] * with_flow, Ts=1.0, physical=([0.0] * 3, [62.0] * 3),
    )  # fmt: skip


def bank(bounds: Bounds, with_flow: bool = False) -> ArchitectureI:
    """The healthy tanks and a model of each fault, of every size from none on."""
    begin, healthy = Step(float(BEGIN)), plant(bounds, with_flow)
    faulty = {
        "flow 1": healthy.replace(parameters={**healthy.parameters, "flow": (-45.0, 45.0)}),
        "sensor 1": SensorFault(0, "drift", 10.0, begin).model(healthy),
        "leak 1": ParameterFault("hole", 0.1, begin).model(healthy),
        "pipe 1-3": ParameterFault("pipe", -0.4, begin).model(healthy),
    }
    first = HPolytope.box([0.0] * 3, [62.0] * 3)
    observer = lambda model: WindowObserver(model, first, horizon=HORIZON)  # noqa: E731
    return ArchitectureI(observer(healthy), {name: observer(model) for name, model in faulty.items()})


def main() -> None:
    """Run and print; without the records, say so."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.three_tanks", description=__doc__)
    parser.add_argument("--healthy", type=int, default=None, help="samples of the second half, all by default")
    chosen = parser.parse_args()
    folder = data_folder()
    if folder is None:
        print(f"skipped: set {VARIABLE} to the folder that has three_tank/train.mat")
        return
    logs = records(folder)
    first, second = halves(logs["normal"])
    shown, bounds = measured(first), learnt(first)
    rows = [[*pair] for pair in zip(("level, cm", "rate, cm/s", "flow, cm^3/s"), shown, bounds, strict=True)]
    table("First half of the healthy record", ["", "shown", "bound"], [[a, f"{b:.3g}", f"{c:.3g}"] for a, b, c in rows])
    runs = [("second half, healthy", part(second, 0, chosen.healthy))] + [(name, logs[name]) for name in FAULTS]
    pairs = [(name, log, with_flow) for name, log in runs for with_flow in (False, True)]
    found = [_row(bounds, *pair) for pair in track(pairs, description="records", console=console)]
    table(f"Three tanks, faults from sample {BEGIN}", ["record", "readings", "detected", "isolated", "alive"], found)


def _row(bounds: Bounds, name: str, log: Log, with_flow: bool) -> list[str]:
    record = bank(bounds, with_flow).run(log if with_flow else without_flow(log))
    isolated = "-" if record.isolated_at is None else f"{record.isolated_at}: {record.fault}"
    readings = "levels and flow" if with_flow else "levels"
    return [name, readings, str(record.detected_at or "-"), isolated, ", ".join(record.verdict.alive)]


if __name__ == "__main__":
    main()
