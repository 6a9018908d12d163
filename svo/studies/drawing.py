"""Figures of studies: the style that all share, and how they are written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from svo.store import write_whole
from svo.studies.page import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size [inches]; no window belongs to it."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def save_picture(path: Path, figure: Figure, title: str, caption: str) -> Picture:
    """Write a figure as a PNG file, whole or not at all."""
    write_whole(path, lambda file: figure.savefig(file, dpi=DPI))
    return Picture(path, title, caption)
