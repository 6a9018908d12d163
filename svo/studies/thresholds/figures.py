"""Pictures of a study of interval detectors: detection times beside a paper's, and where assumption (7) fails."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from svo.pictures.style import STYLE, new_figure, rows_of_axes
from svo.plant import HEALTHY
from svo.store import file_name
from svo.studies.drawing import Gallery
from svo.studies.page import Picture
from svo.studies.thresholds.run import LearnsDetectors
from svo.studies.thresholds.summary import AssumptionSummary, DetectorSummary, learning_records

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = {1: "#B5542C", 5: "#2B6CA3"}


def write_pictures(
    folder: Path,
    plant: LearnsDetectors,
    summaries: Sequence[DetectorSummary],
    assumption: Sequence[AssumptionSummary],
    windows: int,
    formats: Sequence[str] = (),
) -> list[Picture]:
    """Write the pictures of a study into a folder, as PNG files and in other ``formats``.

    ``windows`` is the longest window length q.
    """
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        return list(_pictures(Gallery(folder, formats), plant, summaries, assumption, windows))


def _pictures(
    gallery: Gallery,
    plant: LearnsDetectors,
    summaries: Sequence[DetectorSummary],
    assumption: Sequence[AssumptionSummary],
    windows: int,
) -> Iterator[Picture]:
    for noise in dict.fromkeys(s.noise for s in summaries):
        chosen = [s for s in summaries if s.noise == noise and s.fault != HEALTHY]
        if chosen:
            text = (
                "Points: median; lines: 5–95 % of the runs, none where it is infinite. Diamonds: the paper's Table 1."
            )
            figure = _times(plant, chosen)
            name = f"detection_times_{file_name(noise)}"
            yield gallery.save(name, figure, f"Detection times, {noise} noise", text)
        checked = [s for s in assumption if s.noise == noise]
        if checked:
            text = "Share of fault-free runs whose moving average over q samples exceeds the learnt bound."
            title = f"Where assumption (7) fails, {noise} noise"
            name = f"assumption_{file_name(noise)}"
            yield gallery.save(name, _assumption(checked, windows), title, text)


def _times(plant: LearnsDetectors, summaries: Sequence[DetectorSummary]) -> Figure:
    scenarios = list(dict.fromkeys((s.fault, s.profile) for s in summaries))
    rows = np.array_split(np.arange(len(scenarios)), -(-len(scenarios) // 3))
    figure = new_figure(3.5 * len(rows[0]), 2.5 * len(rows) + 0.3)
    axes = [ax for row in rows_of_axes(figure, [len(row) for row in rows]) for ax in row]
    for ax, (fault, profile) in zip(axes, scenarios, strict=True):
        plot_times(ax, [s for s in summaries if (s.fault, s.profile) == (fault, profile)])
        ax.set_title(plant.label(fault, profile))
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def plot_times(ax: Axes, summaries: Sequence[DetectorSummary]) -> list[Any]:
    """Detection delays [s] of one scenario over the detectors, for each number of records; returns the artists."""
    detectors = list(dict.fromkeys(s.detector for s in summaries))
    artists: list[Any] = []
    counts = list(dict.fromkeys(s.records for s in summaries))
    for i, records in enumerate(counts):
        group = [s for s in summaries if s.records == records]
        at = np.array([detectors.index(s.detector) for s in group]) + 0.16 * (i - (len(counts) - 1) / 2)
        low, median, high = (
            np.array([np.nan if d is None else d for d in (getattr(s.detect, q) for s in group)])
            for q in ("p05", "median", "p95")
        )
        artists.append(ax.vlines(at, low, high, color=_COLOURS.get(records, "0.4"), lw=1.5))
        artists += ax.plot(at, median, "o", ms=4, color=_COLOURS.get(records, "0.4"), label=learning_records(records))
    paper = [(detectors.index(s.detector), s.paper - s.start + s.Ts) for s in summaries if s.paper is not None]
    if paper:
        artists += ax.plot(*zip(*paper, strict=True), "D", ms=5, mfc="none", mec="black", label="paper")
    ax.set_xticks(range(len(detectors)), [d.removeprefix("a = ") for d in detectors])
    what = "pole a of the residual filter" if detectors[0].startswith("a = ") else "detector"
    ax.set(xlabel=what, ylabel="delay [s]", ylim=(0, None))
    return artists


def _assumption(summaries: Sequence[AssumptionSummary], windows: int) -> Figure:
    figure = new_figure(7, 3)
    ax = figure.subplots()
    q = np.arange(1, windows + 1)
    for s in summaries:
        share = np.array([s.by_window.get(int(i), 0) / s.runs.of for i in q])
        ax.plot(q, 100 * share, color=_COLOURS.get(s.records, "0.4"), label=learning_records(s.records))
    ax.set(xlabel="window length q [samples]", ylabel="fault-free runs that\nexceed λ_q [%]", ylim=(0, None))
    ax.legend()
    return figure
