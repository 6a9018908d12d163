"""Pictures of a study: delays, models alive, sets and bounds of one run. They return artists and show nothing."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from svo.logs.names import Column
from svo.pictures.style import COLOURS, axes_or_new, colours, in_seconds
from svo.plant import HEALTHY, Reference
from svo.plant.choice import what_differs
from svo.studies.isolation.exemplar import Exemplar, Snapshot
from svo.studies.isolation.summary import ConditionSummary
from svo.studies.statistics import Delays

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

FILL = 0.14  # opacity of a set, so that those behind it are seen
_BESIDE = 0.11  # of a condition: the paper's mark stands beside ours
DETECT, ISOLATE, PAPER = "#56B4E9", "#0072B2", "#D55E00"


def plot_delays(
    summaries: Sequence[ConditionSummary],
    Ts: float,
    reference: Mapping[tuple[str, str], Reference] | None = None,
    ax: Axes | None = None,
) -> list[Artist]:
    """Mean times to detect and to isolate as points, with 5-95 % whiskers, on a logarithmic scale.

    Where a delay was not reached in every run, the count stands above the point. ``reference`` figures are drawn as
    diamonds, or as triangles that point down where the paper gives an upper bound.
    """
    ax = axes_or_new(ax, 6.4, 4.8)
    faulty = [s for s in summaries if s.fault != HEALTHY]
    artists: list[Artist] = []
    for offset, name, colour, label in ((-0.19, "detect", DETECT, "detected"), (0.19, "isolate", ISOLATE, "isolated")):
        delays: list[Delays] = [getattr(s, name) for s in faulty]
        at = np.arange(len(faulty)) + offset
        artists += _points(ax, at, delays, Ts / 2, colour, label)
        marks = [(reference or {}).get((s.fault, s.profile)) for s in faulty]
        artists += _reference_marks(ax, at + _BESIDE, [getattr(m, name) if m else "" for m in marks])
    _delay_axes(ax, [f"{s.fault}\n{s.profile}" for s in faulty], Ts / 2)
    return artists


def plot_banks(
    summaries: Sequence[ConditionSummary],
    event: str,
    Ts: float,
    reference: Mapping[tuple[str, str], Reference] | None = None,
    ax: Axes | None = None,
) -> list[Artist]:
    """Mean times to "detect" or "isolate" as points, the banks side by side; otherwise as `plot_delays`."""
    ax = axes_or_new(ax, 6.4, 4.8)
    faulty = [s for s in summaries if s.fault != HEALTHY]
    conditions = list(dict.fromkeys((s.fault, s.profile) for s in faulty))
    banks = list(dict.fromkeys(s.bank for s in faulty))
    width = 0.76 / len(banks)
    artists: list[Artist] = []
    for i, (bank, differs) in enumerate(zip(banks, what_differs(banks), strict=True)):
        chosen = [s for s in faulty if s.bank == bank]
        at = np.array([conditions.index((s.fault, s.profile)) for s in chosen]) + (i - (len(banks) - 1) / 2) * width
        delays = [getattr(s, event) for s in chosen]
        tone = COLOURS[1 + (i + 1) % (len(COLOURS) - 1)]
        artists += _points(ax, at, delays, Ts / 2, tone, differs.title)
    marks = [(reference or {}).get(key) for key in conditions]
    artists += _reference_marks(
        ax, np.arange(len(conditions), dtype=float), [getattr(m, event) if m else "" for m in marks]
    )
    _delay_axes(ax, [f"{fault}\n{profile}" for fault, profile in conditions], Ts / 2)
    return artists


def _points(ax: Axes, at: np.ndarray, delays: Sequence[Delays], floor: float, colour: str, label: str) -> list[Artist]:
    """Means with their whiskers, on a logarithmic axis that begins at ``floor``; no point where there is no mean."""
    means = np.array([np.nan if d.mean is None else d.mean for d in delays])
    look: dict[str, Any] = {"color": colour, "markersize": 6.5, "markeredgecolor": "white", "zorder": 4}
    points = ax.plot(at, means, "o", label=f"{label}: mean, 5–95 %", **look)
    return [*points, *(artist for x, d in zip(at, delays, strict=True) for artist in _whisker(ax, x, d, floor, colour))]


def _delay_axes(ax: Axes, labels: Sequence[str], floor: float) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter

    ax.set(yscale="log", ylim=(floor, None), ylabel="time after the fault [s]")
    ax.set(xticks=range(len(labels)), xticklabels=labels)
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.tick_params(axis="x", length=0)
    ax.grid(axis="y", color="#D9DDE2", linewidth=0.7, zorder=0)
    ax.margins(y=0.15)


def plot_alive(exemplar: Exemplar, fault_time: float, Ts: float, ax: Axes | None = None) -> list[Artist]:
    """Which models were alive over time in one run: a bar each, up to its falsification.

    The time beside a bar is the delay of the falsification (the first faulty sample counts as one sampling time).
    """
    ax = axes_or_new(ax, 6.4, 4.8)
    tone = colours(exemplar.names)
    start, end = time_window(exemplar, fault_time, Ts)
    artists: list[Artist] = []
    for i, name in enumerate(exemplar.names):
        died = exemplar.died_at(i)
        until = end if died is None else float(exemplar.time[died]) - fault_time + Ts
        artists += ax.barh(i, until - start, 0.62, left=start, color=tone[name], zorder=2)
        if died is not None:
            when = f"  {in_seconds(until, Ts)}"
            artists.append(ax.text(until, i, when, va="center", fontsize="small", color="#30363D"))
    artists.append(_fault_line(ax))
    ax.set(yticks=range(len(exemplar.names)), yticklabels=exemplar.names)
    ax.set(xlim=(start, end), xlabel="time after the fault [s]")
    ax.tick_params(axis="y", length=0)
    ax.invert_yaxis()
    return artists


def plot_sets(
    exemplar: Exemplar, snapshot: Snapshot, dims: Sequence[int], states: Sequence[Column], ax: Axes | None = None
) -> list[Artist]:
    """Projections of the sets of the models alive at one sample, with the true state as a cross."""
    ax = axes_or_new(ax, 6.4, 4.8)
    tone = colours(exemplar.names)
    artists: list[Artist] = []
    for name, polytope in snapshot.sets.items():
        drawn = polytope.plot(ax=ax, dims=dims, color=tone[name], linewidth=1.6)
        for patch in set(drawn) & set(ax.patches):
            patch.set(alpha=None, edgecolor=tone[name], facecolor=(tone[name], FILL))
        artists += drawn
    artists += _circles(ax)
    true = exemplar.x[snapshot.sample, list(dims)]
    artists += ax.plot(*true, "x", color="#111111", markersize=7, markeredgewidth=1.8, zorder=5)
    ax.margins(0.08)
    ax.set(xlabel=states[dims[0]].bounded, ylabel=states[dims[1]].bounded)
    return artists


def plot_bounds(
    exemplar: Exemplar, state: int, states: Sequence[Column], fault_time: float, ax: Axes | None = None
) -> list[Artist]:
    """Bounds of one state over time, by the nominal model and by that of the true fault, with the true value."""
    ax = axes_or_new(ax, 6.4, 4.8)
    tone, time = colours(exemplar.names), exemplar.time - fault_time
    artists: list[Artist] = []
    for name in (exemplar.names[0], exemplar.fault):
        i = exemplar.names.index(name)
        low, high = exemplar.lower[:, i, state], exemplar.upper[:, i, state]
        artists.append(
            ax.fill_between(time, low, high, color=tone[name], alpha=0.35, linewidth=0, label=f"{name} model")
        )
    artists += ax.plot(time, exemplar.x[:, state], color="#111111", linewidth=1.1, label="true state")
    artists.append(_fault_line(ax))
    ax.set(xlabel="time after the fault [s]", ylabel=states[state].bounded)
    return artists


def separating_states(exemplar: Exemplar) -> tuple[int, ...]:
    """The two states (or the only one) in which the models' boxes drift furthest apart, relative to their widths."""
    centre, width = (exemplar.lower + exemplar.upper) / 2, exemplar.upper - exemplar.lower
    both = np.asarray(np.isfinite(centre).all(axis=2))
    n = exemplar.x.shape[1]
    apart = np.zeros(n)
    for i in range(len(exemplar.names)):
        for j in range(i):
            k = np.flatnonzero(both[:, [i, j]].all(axis=1))
            if k.size:
                scale = np.maximum(width[k, i] + width[k, j], np.finfo(float).tiny)
                apart = np.maximum(apart, (np.abs(centre[k, i] - centre[k, j]) / scale).max(axis=0))
    return tuple(sorted(np.argsort(-apart, kind="stable")[:2].tolist()))


def zoom(ax: Axes, exemplar: Exemplar, state: int, fault_time: float, window: tuple[float, float]) -> None:
    """Show one state's bounds in a window of time [s after the fault], with the vertical range that it needs."""
    time = exemplar.time - fault_time
    inside = np.flatnonzero((time >= window[0]) & (time <= window[1]))
    chosen = [0, exemplar.names.index(exemplar.fault)]
    low, high = (bound[inside][:, chosen, state] for bound in (exemplar.lower, exemplar.upper))
    span = np.nanmax(high) - np.nanmin(low)
    ax.set(xlim=window, ylim=(np.nanmin(low) - 0.05 * span, np.nanmax(high) + 0.05 * span))


def time_window(exemplar: Exemplar, fault_time: float, Ts: float) -> tuple[float, float]:
    """From shortly before the fault to shortly after the last falsification, or to the end of the run [s]."""
    end = float(exemplar.time[-1]) - fault_time + Ts
    last = float(exemplar.time[exemplar.last_falsification]) - fault_time + Ts
    if last > 0:
        end = min(end, max(1.5 * last, 10 * Ts))
    return max(float(exemplar.time[0]) - fault_time, -0.25 * end), end


def _whisker(ax: Axes, x: float, delays: Delays, floor: float, colour: str) -> list[Artist]:
    artists: list[Artist] = []
    top = delays.mean or floor
    if delays.p05 is not None and delays.p95 is not None:
        artists += ax.plot([x, x], [delays.p05, delays.p95], color=colour, linewidth=1.8, zorder=3)
        top = max(top, delays.p95)
    if delays.reached.count < delays.reached.of:
        text = f"{delays.reached.count}/{delays.reached.of}"
        artists.append(ax.annotate(text, (x, top), (0, 5), textcoords="offset points", ha="center", fontsize="small"))
    return artists


def _reference_marks(ax: Axes, at: np.ndarray, texts: Sequence[str]) -> list[Artist]:
    artists: list[Artist] = []
    for x, text in zip(at, texts, strict=True):
        number = re.search(r"\d+(\.\d+)?", text)
        if number:
            marker, size = ("v", 8) if "<" in text else ("D", 6)
            artists += ax.plot(
                x, float(number[0]), marker, color=PAPER, markersize=size, markeredgecolor="white", zorder=4
            )
    return artists


def _fault_line(ax: Axes) -> Artist:
    return ax.axvline(0.0, color="#111111", linewidth=1.0, linestyle=(0, (4, 3)), zorder=3)


def _circles(ax: Axes) -> list[Artist]:
    """A circle around each patch that is too small to be seen."""
    whole = ax.dataLim
    artists: list[Artist] = []
    for patch in ax.patches:
        box = patch.get_path().get_extents()
        if max(box.width / whole.width, box.height / whole.height) < 0.04:
            centre = (box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2
            artists += ax.plot(*centre, "o", color=patch.get_edgecolor(), markersize=10, fillstyle="none", zorder=4)
    return artists
