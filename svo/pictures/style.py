"""The style of all pictures, and times in the digits that they need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from svo.checks import expect_kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's colours, told apart by colour-blind readers; the first is the nominal model's.
COLOURS = ("#5B6470", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
INK, PALE = "#111111", "#30363D"
STYLE: Any = {
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#8A929B",
    "xtick.color": "#3B434B",
    "ytick.color": "#3B434B",
    "legend.frameon": False,
    "savefig.facecolor": "white",
}
DPI = 150


def colours(names: Sequence[str]) -> dict[str, str]:
    """One colour for each model, the nominal one first."""
    return {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size [inches]; no window belongs to it."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def rows_of_axes(figure: Figure, counts: Sequence[int]) -> list[list[Axes]]:
    """Rows of so many panels, each row as wide as the figure: none is left blank."""
    grid = figure.add_gridspec(len(counts), 1)
    rows = [grid[i].subgridspec(1, count) for i, count in enumerate(counts)]
    return [[figure.add_subplot(row[0, k]) for k in range(count)] for row, count in zip(rows, counts, strict=True)]


def axes_or_new(ax: Axes | None, width: float, height: float) -> Axes:
    """The axes that were given, or those of a new figure of pyplot, of a size [inches], which a notebook shows."""
    if ax is not None:
        from matplotlib.axes import Axes

        expect_kind("ax", ax, Axes, "axes of matplotlib, such as plt.subplots()[1], or None for a new figure")
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=(width, height), layout="constrained")[1]


def in_seconds(time: float, Ts: float, sign: str = "-") -> str:
    """A multiple of the sampling time Ts [s] in the digits that it needs; ``sign`` as in a format."""
    digits = next((d for d in range(9) if abs(round(Ts, d) - Ts) <= 1e-6 * Ts), 9)
    return f"{time:{sign}.{digits}f} s"
