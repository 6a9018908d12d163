"""Runs of interval detectors as pictures: measurement, bounds and command (paper 001, Figures 3-5)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from svo.indices import judge_alarm
from svo.interval.detector import IntervalRecord
from svo.pictures.style import STYLE, in_seconds, new_figure
from svo.plant import HEALTHY, fault_start, first_faulty_sample
from svo.studies.drawing import Gallery
from svo.studies.page import Picture
from svo.studies.thresholds.run import LearnsDetectors

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MEASURED, _BOUNDS, _COMMAND = "#4C9A5B", "#C0392B", "#2B6CA3"
_HALF_SECONDS = 1.0  # half of a zoom's width in the fault-free run


def write_run_figures(
    folder: Path, plant: LearnsDetectors, noise: str, seed: int, formats: Sequence[str] = ()
) -> list[Picture]:
    """Figures 3, 4 and 5 of the paper redrawn from our runs: fault-free, its zooms, and the paper's scenarios."""
    import matplotlib as mpl

    gallery = Gallery(folder, formats)
    with mpl.rc_context(STYLE):
        healthy = _record(plant, HEALTHY, HEALTHY, noise, seed)
        pictures = [_figure_3(gallery, healthy), _figure_4(gallery, healthy)]
        if plant.detection_reference:
            pictures.append(_figure_5(gallery, plant, noise, seed))
    return pictures


def plot_run(ax: Axes, record: IntervalRecord, window: tuple[float, float] | None = None) -> list[Any]:
    """Measurement, bounds of the prediction and command of a run, all of it or a window [s]; returns the artists."""
    p = record.prediction
    begin, end = (float(p.time[0]), float(p.time[-1])) if window is None else window
    shown = (p.time >= begin) & (p.time <= end)
    t = p.time[shown]
    artists: list[Any] = []
    artists += ax.plot(t, p.y[shown], color=_MEASURED, lw=0.8, label="measured")
    artists += ax.plot(t, p.lower[shown], color=_BOUNDS, lw=0.9, label="bounds of the prediction")
    artists += ax.plot(t, p.upper[shown], color=_BOUNDS, lw=0.9)
    artists += ax.plot(t, p.u[shown], color=_COMMAND, lw=0.8, ls="--", label="command")
    ax.set(xlim=(begin, end), xlabel="time [s]")
    return artists


def _record(plant: LearnsDetectors, fault: str, profile: str, noise: str, seed: int) -> IntervalRecord:
    """A run seen by the detector with the best pole of the paper's near-steady jam: the last but one."""
    log = plant.simulate(fault, profile, noise, seed)
    learnt = plant.characterise([plant.learning_log(noise, s) for s in np.random.SeedSequence(seed).spawn(5)])
    detectors = list(plant.interval_detectors(learnt, float(log.u[0, 0])).values())
    return detectors[max(0, len(detectors) - 2)].run(log)


def _figure_3(gallery: Gallery, record: IntervalRecord) -> Picture:
    figure = new_figure(7.5, 4.6)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    plot_run(top, record)
    top.set(xlabel="", ylabel="position [rad]")
    top.legend(ncols=3, loc="upper right")
    bottom.plot(record.prediction.time, 1e3 * record.prediction.radius, color=_BOUNDS, lw=0.9)
    bottom.set(xlabel="time [s]", ylabel="radius [mrad]")
    text = "As Figure 3 of the paper: the radius grows while the surface moves, and vanishes at rest."
    return gallery.save("run_healthy", figure, "Fault-free run", text)


def _figure_4(gallery: Gallery, record: IntervalRecord) -> Picture:
    p = record.prediction
    figure = new_figure(7.5, 3.0)
    settled = p.time > p.time[0] + 4 * _HALF_SECONDS
    moving = float(p.time[settled][np.argmax(p.radius[settled])])
    average = np.convolve(p.radius, np.ones(201) / 201, "same")
    inside = settled & (p.time < p.time[-1] - 4 * _HALF_SECONDS)
    resting = float(p.time[inside][np.argmin(average[inside])])
    for ax, middle, title in zip(
        figure.subplots(1, 2), (moving, resting), ("while it moves", "near steady state"), strict=True
    ):
        plot_run(ax, record, (middle - _HALF_SECONDS, middle + _HALF_SECONDS))
        ax.set(title=title, ylabel="position [rad]")
    figure.axes[0].legend()
    text = "As Figure 4: the same run where the radius is largest, and where it is smallest."
    return gallery.save("run_zoom", figure, "Zoom of the fault-free run", text)


def _figure_5(gallery: Gallery, plant: LearnsDetectors, noise: str, seed: int) -> Picture:
    scenarios = list(plant.detection_reference)
    figure = new_figure(8.5, 2.5 * len(scenarios))
    for (fault, profile), (wide, near) in zip(
        scenarios, figure.subplots(len(scenarios), 2, squeeze=False), strict=True
    ):
        record = _record(plant, fault, profile, noise, seed)
        start = fault_start(plant, fault, profile)
        first = first_faulty_sample(plant, fault, profile, record.prediction.time)
        delay = judge_alarm(record.first_alarm, first, plant.Ts).delay
        alarm = None if delay is None else start + delay - plant.Ts
        end = start + 0.5 if alarm is None else alarm
        margin = 0.6 * (end - start) + 0.1
        plot_run(wide, record)
        plot_run(near, record, (start - margin, end + margin))
        wide.set(title=plant.label(fault, profile), ylabel="position [rad]")
        for ax in (wide, near):
            ax.axvline(start, color="0.4", lw=0.9, ls=":", label="fault")
            if alarm is not None:
                ax.axvline(alarm, color="black", lw=0.9, label="alarm")
        near.set_title("" if delay is None else f"detected after {in_seconds(delay, plant.Ts)}")
    handles, labels = figure.axes[1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    text = "As Figure 5: the whole run, and the time from fault to alarm (pole of the last filter but one)."
    return gallery.save("run_faults", figure, "Runs with faults", text)
