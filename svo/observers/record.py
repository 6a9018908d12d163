"""A log seen by one observer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

from polytopes.shown import Picture, Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, optional_import
from svo.logs.log import Log
from svo.models import Labels
from svo.observers.answers import VerdictName
from svo.observers.certificate import Certificate
from svo.pictures.style import COLOURS, in_seconds
from svo.pictures.timeline import Lane, Panel, Span, Timeline

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_MODEL = COLOURS[2]


@dataclass(frozen=True, eq=False, repr=False)
class Record(Shown):
    """A log of K samples seen by one observer.

    Attributes
    ----------
    verdicts : tuple of str
    lower, upper : (K, n) arrays
        Bounds of the state: infinite while the set is outgrown, NaN once the model is falsified.
    seconds : (K,) array
        Wall time of each step.
    certificate : Certificate or None
        Proof of the falsification.
    log : Log
    labels : Labels
        Names of states and outputs.
    stopped : int
        Programs that ended at a limit, as `Observer.stopped`, those of boxes among them.
    """

    verdicts: tuple[VerdictName, ...]
    lower: Array
    upper: Array
    seconds: Array
    certificate: Certificate | None
    log: Log
    labels: Labels
    stopped: int = 0

    @property
    def time(self) -> Array:
        """The log's own times (K,) [s]."""
        return self.log.time

    @property
    def falsified_at(self) -> int | None:
        """Sample at which the model was falsified; None if it never was."""
        return self.verdicts.index("falsified") if "falsified" in self.verdicts else None

    @options_by_name
    def plot(self, ax: Axes | None = None, *, channels: Sequence[str] | None = None) -> list[Artist]:
        """Draw verdicts over time, above the bounds of each state and the readings.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Drawn in its place; a new figure if absent.
        channels : sequence of str, optional
            Names of the states and outputs to draw; all by default.

        Returns
        -------
        list of Artist
        """
        return self._timeline(channels).draw(ax)

    def _timeline(self, channels: Sequence[str] | None) -> Timeline:
        at = self.falsified_at
        lane = Lane("verdict", _MODEL, tuple(self._spans()), () if at is None else (at,))
        marks = {} if at is None else {at: f"falsified at {in_seconds(self.time[at], self.labels.Ts)}"}
        panels = panels_of(self.log, self.labels, {_MODEL: (self.lower, self.upper)}, channels)
        return Timeline(self.time, [lane], panels, marks)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame`, a row a sample: time, verdict, readings, and bounds of each state."""
        cells: dict[str, Any] = {"time_s": self.time, "verdict": list(self.verdicts)}
        cells |= dict(zip(self.labels.outputs, self.log.y.T, strict=True))
        for i, name in enumerate(self.labels.states):
            cells |= {f"{name}_lower": self.lower[:, i], f"{name}_upper": self.upper[:, i]}
        return optional_import("pandas", "study", "data frames").DataFrame(cells)

    def __repr__(self) -> str:
        at, Ts = self.falsified_at, self.labels.Ts
        undecided = self.verdicts.count("undecided")
        found = "consistent to the end" if at is None else f"falsified at sample {at} ({in_seconds(self.time[at], Ts)})"
        more = f", {undecided} undecided" if undecided else ""
        return f"<Record of {len(self.verdicts)} samples: {found}{more}>"

    def _picture(self) -> Picture:
        timeline = self._timeline(None)
        return Picture(timeline.draw, timeline.width, timeline.height)

    def _spans(self) -> Iterator[Span]:
        for verdict, first, end in runs(self.verdicts):
            if verdict != "falsified":
                yield Span(first, end, _MODEL, verdict, open=verdict == "undecided")


def runs(values: Sequence[Any]) -> Iterator[tuple[Any, int, int]]:
    """Values that stand one after the other: each with its first sample and the one after its last."""
    k = 0
    for value, group in groupby(values):
        first, k = k, k + sum(1 for _ in group)
        yield value, first, k


def panels_of(
    log: Log, labels: Labels, bounds: dict[str, tuple[Array, Array]], channels: Sequence[str] | None
) -> list[Panel]:
    """Panels of states with their bounds (K, n) by colour and of readings, by their names; all by default."""
    states, outputs = labels.chosen(channels)
    panels = []
    for i in states:
        j = labels.reading_of(i)
        own = {colour: (lower[:, i], upper[:, i]) for colour, (lower, upper) in bounds.items()}
        truth = log.x[:, i] if log.x is not None and log.x.shape[1] == len(labels.states) else None
        panels.append(Panel(labels.state_titles[i], own, None if j is None else log.y[:, j], truth))
    return panels + [Panel(labels.output_titles[j], readings=log.y[:, j]) for j in outputs]
