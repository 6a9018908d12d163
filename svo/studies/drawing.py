"""Figures of studies as files: PNG, which pages show, and what other formats are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from svo.checks import expect_one_of
from svo.pictures.style import DPI
from svo.store import write_whole
from svo.studies.page import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")


@dataclass(frozen=True)
class Gallery:
    """A folder of pictures.

    Parameters
    ----------
    folder : path
    formats : sequence of str
        Any of "png", "svg" and "pdf"; a PNG file, which the page shows, is written in any case.

    Raises
    ------
    ValueError
        For another format.
    """

    folder: Path
    formats: Sequence[str] = ()

    def __post_init__(self) -> None:
        for name in self.formats:
            expect_one_of("format", name, FORMATS)

    def save(self, name: str, figure: Figure, title: str, caption: str) -> Picture:
        """Write a figure, each file whole or not at all, under a ``name`` without suffix."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        for suffix in dict.fromkeys(self.formats):
            if suffix != "png":
                write_whole(self.folder / f"{name}.{suffix}", partial(figure.savefig, format=suffix, dpi=DPI))
        figure.set_dpi(DPI)
        path = self.folder / f"{name}.png"
        write_whole(path, FigureCanvasAgg(figure).print_png)  # savefig would draw all of it once more, for the layout
        return Picture(path, title, caption)
