"""The picture of the servo study: a jam, and force pulses that the learning record did not hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._servo_detectors import learn, predictor
from benchmarks._servo_records import halves, jam, record
from svo.interval import IntervalDetector, IntervalRecord
from svo.logs.log import Log

POLE = 0.95
JAM = 5480  # sample of the second half


def draw(folder: Path, path: Path) -> None:
    """Position and residual of a jam; residual of the healthy record with pulses under thresholds of one without."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 7.5), layout="constrained")
    position, jammed, pulses = figure.subplots(3, 1)
    learning, running = halves(record(folder, "standard"))
    fit, noise = learn(learning)
    faulty = jam(running, JAM)
    _draw_position(position, running, faulty)
    _draw_residual(jammed, IntervalDetector(predictor(fit, running), noise, POLE).run(faulty), faulty)
    jammed.set_title(f"Filtered residual, a = {POLE:g}, about the jam")
    pushed = halves(record(folder, "pulses"))[1]
    _draw_residual(pulses, IntervalDetector(predictor(fit, pushed), noise, POLE).run(pushed), pushed)
    pulses.set_title("Healthy, but with force pulses that the learning record does not hold")
    near = running.time[JAM]
    jammed.set(xlim=(near - 0.02, near + 0.02), ylim=(-0.2, 0.6))
    pulses.set_ylim(-0.12, 0.24)
    figure.savefig(path, dpi=100)


def _draw_position(ax: Any, healthy: Log, faulty: Log) -> None:
    ax.plot(healthy.time, 1e3 * healthy.y[:, 0], color="tab:blue", label="recorded")
    ax.plot(faulty.time[JAM:], 1e3 * faulty.y[JAM:, 0], color="tab:red", label="with the injected jam")
    ax.set(xlabel="time [s]", ylabel="position [mm]", title="Second half of the recording EMPS, real and healthy")
    ax.legend()


def _draw_residual(ax: Any, found: IntervalRecord, log: Log) -> None:
    ax.plot(log.time, 1e3 * found.filtered, color="black", lw=0.8, label="filtered residual")
    for sign in (-1, 1):
        ax.plot(
            log.time, sign * 1e3 * found.threshold, color="tab:blue", ls="--", label="threshold" if sign > 0 else None
        )
    alarm = np.where(found.exceeded, 1e3 * found.filtered, np.nan)
    ax.plot(log.time, alarm, color="tab:red", lw=1.6, label="alarm")
    ax.set(xlabel="time [s]", ylabel="residual [mm]")
    ax.legend(loc="upper left", ncols=3)
