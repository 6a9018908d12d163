"""What a report is to show, checked before anything is computed for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from svo.detection.found import Detection
from svo.detection.report.pictures import FORMATS
from svo.isolation import NOMINAL
from svo.models import Labels
from svo.plant import MonitoredPlant


@dataclass(frozen=True)
class ReportOptions:
    """A choice of what a report shows.

    Attributes
    ----------
    channels : tuple of str
        Names of states and outputs; all if empty.
    formats : tuple of str
        In which the pictures are written as files too.
    """

    channels: tuple[str, ...] = ()
    formats: tuple[str, ...] = ()

    @classmethod
    def of(cls, channels: Sequence[str], formats: Sequence[str]) -> ReportOptions:
        """Of texts that may name several with commas between them.

        Raises
        ------
        ValueError
            For a format that is not one of `FORMATS`.
        """
        kinds = _listed(formats)
        for kind in kinds:
            if kind.lower() not in FORMATS:
                raise ValueError(f"format is {kind!r}; expected any of {', '.join(FORMATS)}, with commas between them")
        return cls(_listed(channels), tuple(dict.fromkeys(kind.lower() for kind in kinds)))

    def check(self, plant: MonitoredPlant, noise: str) -> None:
        """Raise a ValueError for a name that is no state and no output of a plant."""
        labels = Labels.of(plant.bank(noise).observers[NOMINAL].model).in_columns(plant.columns)
        labels.chosen(self.channels or None)

    def write(self, folder: Path, found: Detection, path: Path, command: Sequence[str]) -> Path:
        """The report; see `svo.detection.report.report.write_report`."""
        from svo.detection.report.report import write_report

        options = [word for name in self.channels for word in ("--states", name)]
        options += ["--format", ",".join(self.formats)] if self.formats else []
        again = [*command, "--out", "DIR", "--report", *options]
        return write_report(folder, found, path, channels=self.channels or None, formats=self.formats, command=again)


def _listed(texts: Sequence[str]) -> tuple[str, ...]:
    parts = (part.strip() for text in texts for part in text.split(","))
    return tuple(dict.fromkeys(part for part in parts if part))
