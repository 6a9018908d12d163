"""Figures of studies, and how they are written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from svo.pictures.style import DPI
from svo.store import write_whole
from svo.studies.page import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_picture(path: Path, figure: Figure, title: str, caption: str) -> Picture:
    """Write a figure as a PNG file, whole or not at all."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure.set_dpi(DPI)
    write_whole(path, FigureCanvasAgg(figure).print_png)  # savefig would draw all of it once more, for the layout
    return Picture(path, title, caption)
