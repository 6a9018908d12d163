"""The picture of a comparison: delays of all detectors in every scenario."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from svo.comparison.summary import DetectorComparison
from svo.study.figures import DPI, STYLE, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = {"bounded": "#2B6CA3", "gaussian": "#B5542C"}


def write_comparison(path: Path, summaries: Sequence[DetectorComparison]) -> Picture:
    """Write the picture as a PNG file: one panel a scenario, one line a detector."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        scenarios = summaries[0].scenarios
        detectors = list(dict.fromkeys(s.detector for s in summaries))
        figure = Figure(figsize=(2.2 + 2.1 * len(scenarios), 1.1 + 0.3 * len(detectors)), layout="constrained")
        axes = figure.subplots(1, len(scenarios), squeeze=False, sharey=True)[0]
        for i, ax in enumerate(axes):
            plot_delays(ax, summaries, i)
            ax.set_title(f"{scenarios[i].fault} {scenarios[i].profile}")
        axes[0].set_yticks(range(len(detectors)), detectors)
        axes[0].invert_yaxis()
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        figure.savefig(path, dpi=DPI)
    text = (
        "Points: median; lines: 5–95 % of the runs without an alarm before the fault. No point where more than half of "
        "them are missed, or all have an alarm before it."
    )
    return Picture(path, "Delays at equal false-alarm rate", text)


def plot_delays(ax: Axes, summaries: Sequence[DetectorComparison], scenario: int) -> list[Any]:
    """Delays [s] of every detector in one scenario, by number, for each distribution; returns the artists."""
    detectors = list(dict.fromkeys(s.detector for s in summaries))
    distributions = list(dict.fromkeys(s.distribution for s in summaries))
    artists: list[Any] = []
    for i, distribution in enumerate(distributions):
        group = [s for s in summaries if s.distribution == distribution]
        at = np.array([detectors.index(s.detector) for s in group]) + 0.24 * (i - (len(distributions) - 1) / 2)
        low, median, high = (
            np.array([_finite(getattr(s.scenarios[scenario].detect, q, None)) for s in group])
            for q in ("p05", "median", "p95")
        )
        colour = _COLOURS.get(distribution, "0.4")
        artists.append(ax.hlines(at, low, high, color=colour, lw=1.5))
        artists += ax.plot(median, at, "o", ms=4, color=colour, label=f"{distribution} noise")
    ax.set_xlim(left=0)
    ax.set_xlabel("delay [s]")
    ax.grid(axis="x", color="0.92")
    ax.set_axisbelow(True)
    return artists


def _finite(delay: float | None) -> float:
    return np.nan if delay is None else delay
