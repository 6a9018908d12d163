"""The pictures of a report: the verdicts of the bank, and each quantity with its bounds and readings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from svo.isolation import BankRecord
from svo.pictures.style import colours
from svo.pictures.timeline import Timeline
from svo.store import file_name, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("svg", "pdf", "png")
_OPTIONS: dict[str, dict[str, Any]] = {
    "svg": {"metadata": {"Date": None}}, "pdf": {"metadata": {"CreationDate": None}}, "png": {"dpi": 300},
}  # fmt: skip
_PANEL, _BELOW, _RIGHT = 2.1, 0.5, 0.35  # inches: a panel with its title, its axis of time, the margin beside it
_ABOVE = 0.2  # inches of the room above a title that are left out
_LETTER, _LEAST = 0.072, 0.65  # inches: of a lane's name, and the least margin, which numbers need
_NAME = 24  # letters of a lane's name that are shown


@dataclass(frozen=True)
class ReportPicture:
    """One picture of a report.

    Attributes
    ----------
    name : str
        Of its file, without the suffix.
    title : str
    timeline : Timeline
    is_choice : bool
        Whether a reader of the page may hide it.
    margin : float
        On its left [inches].
    """

    name: str
    title: str
    timeline: Timeline
    is_choice: bool
    margin: float

    def figure(self) -> Figure:
        """Drawn, in a figure of its own; the times of all pictures of a report stand below one another."""
        from matplotlib.figure import Figure

        width = self.timeline.width
        height = (_PANEL if self.timeline.panels else self.timeline.height) + _BELOW
        figure = Figure(figsize=(width, height))
        left, below = self.margin / width, _BELOW / height
        above = 1.0 - below + _ABOVE / height
        self.timeline.draw(figure.add_axes((left, below, 1.0 - left - _RIGHT / width, above)))
        return figure

    def write(self, folder: Path, formats: Sequence[str]) -> list[Path]:
        """Write it into a folder, a file for each format; returns their paths."""
        figure, paths = self.figure(), []
        for kind in formats:
            path = folder / f"{file_name(self.name)}.{kind}"
            write_whole(path, partial(figure.savefig, format=kind, **_OPTIONS[kind]))
            paths.append(path)
        return paths


def pictures_of(record: BankRecord, channels: Sequence[str] | None) -> Iterator[ReportPicture]:
    """The verdicts, then each state and output that is asked for; errors as of `BankRecord.timeline`."""
    whole = record.timeline(channels)
    margin = max(_LEAST, _LETTER * max(min(len(lane.label), _NAME) for lane in whole.lanes) + 0.15)
    yield ReportPicture("verdicts", "Verdicts of the bank", replace(whole, panels=()), False, margin)
    states, outputs = record.labels.chosen(channels)
    names = [("bounds", record.labels.states[i]) for i in states]
    names += [("readings", record.labels.outputs[j]) for j in outputs]
    for panel, (kind, name) in zip(whole.panels, names, strict=True):
        only = replace(whole, lanes=(), panels=(panel,))
        yield ReportPicture(f"{kind}_{name}", f"{panel.label}: {kind}", only, True, margin)


def legend_of(record: BankRecord) -> list[tuple[str, str]]:
    """Each model with its colour."""
    return list(colours(record.names).items())
