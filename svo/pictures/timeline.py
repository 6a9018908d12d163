"""Verdicts over time, above the bounds and readings that they are about."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import in_a_line
from svo.pictures.style import INK, PALE, STYLE, axes_or_new

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_BINS = 1000  # of a picture's width; more samples are drawn by the hull of each bin
_LANE, _GAP = 0.24, 0.34  # height of a lane and of the space above a panel, where a panel is 1
_INCHES = 1.35  # a panel
_NAME = 24  # characters of the name of a lane
_READABLE = 0.1  # of the width: a span that has room for its word


@dataclass(frozen=True)
class Span:
    """Samples ``first`` to ``end`` - 1 of a lane, and what holds there; without a ``text`` it is plain."""

    first: int
    end: int
    colour: str
    text: str = ""
    open: bool = False  # hatched: nothing was decided


@dataclass(frozen=True)
class Lane:
    """One line of verdicts over time, and the samples at which its model fell."""

    label: str
    colour: str
    spans: tuple[Span, ...]
    falls: tuple[int, ...] = ()


@dataclass(frozen=True)
class Panel:
    """One quantity over time.

    Attributes
    ----------
    label : str
        With its unit.
    bounds : mapping of colour to (lower, upper), each (K,)
        Infinite where nothing bounds it, NaN where there are none.
    readings, truth : (K,) arrays, optional
    """

    label: str
    bounds: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    readings: Array | None = None
    truth: Array | None = None


@dataclass(frozen=True)
class Timeline:
    """What is drawn: lanes above panels, over one axis of time.

    Attributes
    ----------
    time : (K,) array
        Seconds.
    lanes, panels : sequences
    marks : mapping of int to str
        Texts at samples.
    """

    time: Array
    lanes: Sequence[Lane]
    panels: Sequence[Panel]
    marks: Mapping[int, str] = field(default_factory=dict)

    def draw(self, ax: Axes | None) -> list[Artist]:
        """Draw it in the place of some axes, or in a new figure; returns the artists."""
        import matplotlib as mpl

        heights = self._heights
        total = float(np.sum(heights + _GAP))
        with mpl.rc_context({**STYLE, "font.size": 8.5, "axes.titlesize": 9.0, "axes.titleweight": "normal"}):
            ax = axes_or_new(ax, self.width, self.height)
            ax.set_axis_off()
            tops = 1.0 - np.cumsum(heights + _GAP) / total
            boxes = [ax.inset_axes((0.0, top, 1.0, height / total)) for top, height in zip(tops, heights, strict=True)]
            artists = self._draw_lanes(boxes[0]) if self.lanes else []
            for box, panel in zip(boxes[-len(self.panels) :] if self.panels else [], self.panels, strict=True):
                artists += self._draw_panel(box, panel)
            artists += self._draw_marks(boxes)
            for box in boxes:
                box.set_xlim(float(self.time[0]), self._end)
            for box in boxes[:-1]:
                box.tick_params(labelbottom=False)
            boxes[-1].set_xlabel("time [s]")
        return artists

    @property
    def width(self) -> float:
        """Of a figure of its own [inches]."""
        return 7.0

    @property
    def height(self) -> float:
        """Of a figure of its own [inches]."""
        return _INCHES * float(np.sum(self._heights + _GAP))

    @property
    def _heights(self) -> Array:
        return np.array([_LANE * len(self.lanes)] * bool(self.lanes) + [1.0] * len(self.panels))

    @property
    def _end(self) -> float:
        """The end of the last sample."""
        return float(self.time[-1]) + (float(self.time[-1] - self.time[-2]) if len(self.time) > 1 else 1.0)

    def _draw_lanes(self, ax: Axes) -> list[Artist]:
        edges = np.append(self.time, self._end)
        artists: list[Artist] = []
        for row, lane in enumerate(self.lanes):
            for span in lane.spans:
                left, right = edges[span.first], edges[span.end]
                open_: dict[str, Any] = {"color": "white", "edgecolor": span.colour, "hatch": "////"}
                look = open_ if span.open else {"color": span.colour}
                artists += ax.barh(row, right - left, 0.66, left=left, linewidth=0, **look)
                if span.text and right - left > _READABLE * (edges[-1] - edges[0]):
                    ink: dict[str, Any] = {"color": "white", "fontsize": 8.0, "ha": "center", "va": "center_baseline"}
                    artists.append(ax.text((left + right) / 2, row, span.text, **ink))
            at = edges[list(lane.falls)]
            artists += ax.plot(
                at, np.full(len(at), row), "x", color=INK, markersize=5, markeredgewidth=1.4, zorder=4, clip_on=False
            )
        ax.set(yticks=range(len(self.lanes)), yticklabels=[in_a_line(lane.label, _NAME) for lane in self.lanes])
        for text, lane in zip(ax.get_yticklabels(), self.lanes, strict=True):
            text.set_color(lane.colour)
        ax.set_ylim(len(self.lanes) - 0.5, -0.5)
        ax.tick_params(axis="y", length=0)
        return artists

    def _draw_panel(self, ax: Axes, panel: Panel) -> list[Artist]:
        lowest, highest = _limits(panel)
        artists: list[Artist] = []
        for colour, (lower, upper) in panel.bounds.items():
            # What is unbounded, or far beyond the rest, reaches the edge of the panel.
            room = highest - lowest
            low, high = (np.clip(end, lowest - room, highest + room) for end in (lower, upper))
            time, low, high = thinned(self.time, low, high)
            look: dict[str, Any] = {"facecolor": (colour, 0.22), "edgecolor": (colour, 0.75), "linewidth": 0.7}
            artists.append(ax.fill_between(time, low, high, **look))
        if panel.truth is not None:
            artists += ax.plot(self.time, panel.truth, color=INK, linewidth=0.9)
        if panel.readings is not None:
            time, low, high = thinned(self.time, panel.readings, panel.readings)
            both = np.concatenate([low, high]) if len(time) < len(self.time) else low
            times = np.concatenate([time, time]) if len(time) < len(self.time) else time
            artists += ax.plot(times, both, ".", color=INK, markersize=2.4)
            for beyond, edge, mark in ((both > highest, highest, "^"), (both < lowest, lowest, "v")):
                at, look = times[beyond], {"color": INK, "markersize": 4, "clip_on": False, "zorder": 4}
                artists += ax.plot(at, np.full(len(at), edge), mark, **look)
        ax.set_ylim(lowest, highest)
        ax.set_title(in_a_line(panel.label, 60) + _legend(panel), pad=3)
        return artists

    def _draw_marks(self, boxes: Sequence[Axes]) -> list[Artist]:
        artists: list[Artist] = []
        line: dict[str, Any] = {"color": PALE, "linewidth": 0.9, "linestyle": (0, (4, 3)), "zorder": 3}
        for sample in self.marks:
            artists += [box.axvline(float(self.time[sample]), **line) for box in boxes]
        if self.marks and self.lanes:
            said = in_a_line(",  ".join(self.marks.values()), 90)
            artists.append(boxes[0].set_title(said, pad=3))
        return artists


def _legend(panel: Panel) -> str:
    parts = {"bounds": bool(panel.bounds), "readings as dots": panel.readings is not None,
             "true value as a line": panel.truth is not None}  # fmt: skip
    told = [name for name, there in parts.items() if there]
    return "" if told == ["true value as a line"] else f": {', '.join(told)}"


def _limits(panel: Panel) -> tuple[float, float]:
    """The range to show: of the readings and the narrowest bounds, with as much again for wider ones that need it."""
    bounds = [np.where(np.isfinite(end), end, np.nan) for pair in panel.bounds.values() for end in pair]
    extra = [values for values in (panel.readings, panel.truth) if values is not None]
    narrow = [_narrowest(bounds[::2], np.fmax), _narrowest(bounds[1::2], np.fmin)] if bounds else []
    core = np.concatenate([*narrow, *extra]) if narrow or extra else np.empty(0)
    core = core[np.isfinite(core)]
    if not core.size:
        return -1.0, 1.0
    low, high = np.quantile(core, [0.005, 0.995])
    room = max(float(high - low), 1e-9 * max(abs(low), abs(high)), 1e-300)
    known = np.concatenate([*bounds, *extra])
    known = known[np.isfinite(known)]
    low, high = max(known.min(), low - room), min(known.max(), high + room)
    return float(low - 0.06 * room), float(high + 0.06 * room)


def _narrowest(ends: Sequence[Array], pick: np.ufunc) -> Array:
    return np.asarray(pick.reduce(ends), dtype=np.float64)


def thinned(time: Array, lower: Array, upper: Array) -> tuple[Array, Array, Array]:
    """Lower and upper ends over a picture's times: of many samples the hull of each bin, NaN only where all are."""
    if len(time) <= 2 * _BINS:
        return time, lower, upper
    starts = np.linspace(0, len(time), _BINS, endpoint=False).astype(int)
    with np.errstate(invalid="ignore"):
        return time[starts], np.fmin.reduceat(lower, starts), np.fmax.reduceat(upper, starts)
