"""One picture of a comparison: delays of every detector in every scenario, and what they cost in false alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from svo.studies.comparison.table import ComparisonRow

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"bounded": "#0072B2", "gaussian": "#D55E00"}  # Okabe and Ito
_APART = {"bounded": -0.16, "gaussian": 0.16}  # lines of a detector with both kinds of noise
_GRID = "#D9DDE2"


def plot_comparison(rows: Sequence[ComparisonRow], rate: float, Ts: float, longest: float) -> Figure:
    """A column of panels for each scenario, a line for each detector, a colour for each distribution of the noise.

    A dot is the median delay to the first alarm with a line from 5 to 95 %, a cross the median delay to isolate the
    right fault; on the right edge stands what is not reached in half of the runs. The last panel has the
    false-alarm rate on judged runs without a fault with its 95 % interval, and the rate that was tuned for.

    Parameters
    ----------
    rows : sequence of ComparisonRow
    rate : float
        False-alarm rate tuned for.
    Ts, longest : float
        Sampling time and length of the longest run after its fault [s]: the edges of the time axis.
    """
    from matplotlib import pyplot as plt

    detectors = list(dict.fromkeys(row.detector for row in rows))
    scenarios = list(dict.fromkeys((row.fault, row.profile) for row in rows))
    height = 1.8 + 0.36 * len(detectors)
    figure, axes = plt.subplots(
        1, len(scenarios) + 1, figsize=(2.6 + 1.75 * (len(scenarios) + 1), height), sharey=True, squeeze=False
    )
    never = 2.2 * longest
    both = len({row.distribution for row in rows}) > 1
    offsets = {name: apart if both else 0.0 for name, apart in _APART.items()}
    for ax, scenario in zip(axes[0], scenarios, strict=False):
        for row in rows:
            if (row.fault, row.profile) == scenario:
                _delays(ax, detectors.index(row.detector) + offsets[row.distribution], row, never)
        _time_axis(ax, f"{scenario[0]}, {scenario[1]}", Ts, never)
    _false_alarms(axes[0][-1], detectors, rows, rate, offsets)
    first = axes[0][0]
    first.set(yticks=range(len(detectors)), yticklabels=detectors, ylim=(len(detectors) - 0.5, -0.5))
    figure.supxlabel("time after the fault [s]", fontsize=10, x=0.5)
    _legend(figure, [row.distribution for row in rows])
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.45 / height))
    return figure


def _delays(ax: Axes, y: float, row: ComparisonRow, never: float) -> None:
    colour = COLOURS[row.distribution]
    if row.detect.p05 is not None:
        end = never if row.detect.p95 is None else row.detect.p95
        ax.plot([row.detect.p05, end], [y, y], color=colour, linewidth=1.4, solid_capstyle="butt", zorder=2)
    ax.plot(_or(row.detect.median, never), y, "o", color=colour, markersize=5, zorder=3, clip_on=False)
    if row.isolate.reached.count or row.wrong_isolations.count:
        at = _or(row.isolate.median, never)
        ax.plot(at, y, "x", color=colour, markersize=7, markeredgewidth=1.6, zorder=4, clip_on=False)


def _time_axis(ax: Axes, title: str, Ts: float, never: float) -> None:
    ticks = [t for t in (0.01, 0.1, 1.0, 10.0) if 0.6 * Ts < t < 0.4 * never]
    ax.set(
        xscale="log", xlim=(0.6 * Ts, never), xticks=[*ticks, never], xticklabels=[*(f"{t:g}" for t in ticks), "never"]
    )
    _dress(ax, title)


def _false_alarms(
    ax: Axes, detectors: Sequence[str], rows: Sequence[ComparisonRow], rate: float, offsets: Mapping[str, float]
) -> None:
    shares = {(row.detector, row.distribution): row.false_alarms for row in rows}
    for (detector, distribution), share in shares.items():
        y = detectors.index(detector) + offsets[distribution]
        low, high = share.interval
        ax.plot([100 * low, 100 * high], [y, y], color=COLOURS[distribution], linewidth=1.4)
        ax.plot(100 * share.value, y, "o", color=COLOURS[distribution], markersize=5, clip_on=False)
    ax.axvline(100 * rate, color="#5B6470", linewidth=1, linestyle="--")
    ax.set_xscale("symlog", linthresh=5.0)
    ax.set(xlim=(0, 100), xticks=[0, 2, 5, 20, 100], xticklabels=["0", "2", "5", "20", "100"])
    _dress(ax, f"false alarms [%]\ntuned for {100 * rate:g} %")


def _dress(ax: Axes, title: str) -> None:
    """Title, grid and ticks as in every panel."""
    ax.set_title(title, fontsize=10)
    ax.minorticks_off()
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="both", color=_GRID, linewidth=0.6, zorder=0)
    ax.set_axisbelow(True)


def _legend(figure: Figure, distributions: Sequence[str]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=COLOURS[name], marker="s", linestyle="", label=f"{name} noise")
        for name in dict.fromkeys(distributions)
    ]
    grey = "#333333"
    handles += [
        Line2D([], [], color=grey, marker="o", linewidth=1.4, label="first alarm: median, 5–95 %"),
        Line2D([], [], color=grey, marker="x", linestyle="", markeredgewidth=1.6, label="right fault isolated: median"),
    ]
    figure.legend(handles=handles, loc="upper center", ncols=len(handles), frameon=False, fontsize=9)


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value
