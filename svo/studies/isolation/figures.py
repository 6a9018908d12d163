"""The pictures of a study as files, each composed of the panels of `svo.studies.isolation.plots`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from svo.pictures.style import STYLE, colours, in_seconds, new_figure, rows_of_axes
from svo.plant import HEALTHY, Plant, fault_start
from svo.store import file_name
from svo.studies.drawing import Gallery
from svo.studies.isolation import plots
from svo.studies.isolation.exemplar import Exemplar
from svo.studies.isolation.summary import ConditionSummary
from svo.studies.isolation.tables import bank_titles
from svo.studies.page import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_pictures(
    folder: Path,
    plant: Plant,
    summaries: Sequence[ConditionSummary],
    exemplars: Sequence[Exemplar],
    formats: Sequence[str] = (),
) -> list[Picture]:
    """Write the pictures of a study into a folder, as PNG files and in other ``formats``."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        return list(_pictures(Gallery(folder, formats), plant, summaries, exemplars))


def _pictures(
    gallery: Gallery, plant: Plant, summaries: Sequence[ConditionSummary], exemplars: Sequence[Exemplar]
) -> Iterator[Picture]:
    for noise in dict.fromkeys(s.noise for s in summaries):
        chosen = [s for s in summaries if s.noise == noise and s.fault != HEALTHY]
        if not chosen:
            continue
        text = "Points: mean; lines: 5–95 % of the runs; a count where not every run got there."
        if plant.reference:
            text += " Diamonds: the paper's figures; triangles point down from its upper bounds."
        title = f"Times to detect and to isolate, {noise} noise"
        banks = bank_titles(chosen)
        draw = _delays if len(banks) == 1 else _banks
        yield gallery.save(f"delays_{file_name(noise)}", draw(plant, chosen), title, text)
        for bank, title in banks.items():
            shown = [e for e in exemplars if (e.noise, e.bank) == (noise, bank) and e.fault != HEALTHY]
            where = ", ".join(filter(None, (f"{noise} noise", title and bank.title)))
            yield from _of_runs(gallery, plant, shown, where, file_name("_".join(filter(None, (noise, title)))))


def _of_runs(gallery: Gallery, plant: Plant, shown: Sequence[Exemplar], where: str, suffix: str) -> Iterator[Picture]:
    """The pictures of exemplary runs of one bank with one noise set."""
    title = f"Models alive over time, {where}"
    text = "One run of each fault and profile. A bar ends where the model is falsified, with the delay beside it."
    yield gallery.save(f"alive_{suffix}", _alive(plant, shown), title, text)
    slow = _slowest(shown)
    if slow[0].x.shape[1] > 1:
        title = f"Sets of the models and the true state, {where}"
        text = (
            "Projections on the two states in which the models drift furthest apart, in the slowest exemplary run "
            "of each fault, at the last samples before models are falsified. The cross is the true state; a model "
            "is falsified when its set becomes empty."
        )
        yield gallery.save(f"sets_{suffix}", _sets(plant, slow), title, text)
    title = f"Bounds and true state, {where}"
    text = "The same runs: what the nominal model (until it is falsified) and the true fault's model allow."
    yield gallery.save(f"bounds_{suffix}", _bounds(plant, slow), title, text)


def _banks(plant: Plant, summaries: Sequence[ConditionSummary]) -> Figure:
    conditions = len({(s.fault, s.profile) for s in summaries})
    figure = new_figure(max(6.5, 1.0 * conditions), 6.0)
    axes = figure.subplots(2, 1, sharex=True)
    for ax, event in zip(axes, ("detect", "isolate"), strict=True):
        plots.plot_banks(summaries, event, plant.Ts, plant.reference, ax)
        ax.set_ylabel(f"time to {event} [s]")
    _delay_legend(figure, plant, summaries)
    return figure


def _delays(plant: Plant, summaries: Sequence[ConditionSummary]) -> Figure:
    figure = new_figure(max(5.5, 1.0 * len(summaries)), 3.9)
    ax = figure.subplots()
    plots.plot_delays(summaries, plant.Ts, plant.reference, ax)
    _delay_legend(figure, plant, summaries)
    return figure


def _delay_legend(figure: Figure, plant: Plant, summaries: Sequence[ConditionSummary]) -> None:
    from matplotlib.lines import Line2D

    handles = figure.axes[0].get_legend_handles_labels()[0]
    if any((s.fault, s.profile) in plant.reference for s in summaries):
        look: Any = {"color": plots.PAPER, "linestyle": "", "markeredgecolor": "white"}
        handles.append(Line2D([], [], marker="D", label="paper", **look))
        handles.append(Line2D([], [], marker="v", label="paper: below this", **look))
    figure.legend(handles=handles, loc="outside upper left", ncols=len(handles))


def _alive(plant: Plant, exemplars: Sequence[Exemplar]) -> Figure:
    faults = list(dict.fromkeys(e.fault for e in exemplars))
    rows = [[e for e in exemplars if e.fault == fault] for fault in faults]
    figure = new_figure(3.3 * max(map(len, rows)) + 0.6, 1.75 * len(faults) + 0.3)
    for chosen, row in zip(rows, rows_of_axes(figure, [len(chosen) for chosen in rows]), strict=True):
        for exemplar, ax in zip(chosen, row, strict=True):
            plots.plot_alive(exemplar, _start(plant, exemplar), plant.Ts, ax)
            ax.set_title(f"{exemplar.fault}, {exemplar.profile}")
            if ax is not row[0]:
                ax.set_yticklabels([])
            if chosen is not rows[-1]:
                ax.set_xlabel("")
    return figure


def _sets(plant: Plant, exemplars: Sequence[Exemplar]) -> Figure:
    from matplotlib.ticker import MaxNLocator

    # The end of a run, with one set left, says nothing where there is something to see before.
    shown = [e.snapshots[:-1] or e.snapshots for e in exemplars]
    counts = [len(snapshots) for snapshots in shown]
    figure = new_figure(3.4 * max(counts) + 0.4, 2.7 * len(exemplars) + 0.4)
    for row, exemplar, snapshots in zip(rows_of_axes(figure, counts), exemplars, shown, strict=True):
        dims = plots.separating_states(exemplar)
        for ax, snapshot in zip(row, snapshots, strict=True):
            plots.plot_sets(exemplar, snapshot, dims, plant.columns.states, ax)
            after = exemplar.time[snapshot.sample] - _start(plant, exemplar)
            when = in_seconds(after, plant.Ts, "+")
            ax.set_title(f"{exemplar.fault}, {exemplar.profile}: {when}\n{snapshot.event}", fontsize=9.5)
            ax.xaxis.set_major_locator(MaxNLocator(4))
            ax.yaxis.set_major_locator(MaxNLocator(5))
    _model_legend(figure, exemplars[0].names)
    return figure


def _bounds(plant: Plant, exemplars: Sequence[Exemplar]) -> Figure:
    columns = min(2, len(plant.columns.states))
    figure = new_figure(4.6 * columns, 2.2 * len(exemplars) + 0.4)
    axes = figure.subplots(len(exemplars), columns, squeeze=False)
    for row, exemplar in zip(axes, exemplars, strict=True):
        window = plots.time_window(exemplar, _start(plant, exemplar), plant.Ts)
        for ax, state in zip(row, plots.separating_states(exemplar), strict=True):
            plots.plot_bounds(exemplar, state, plant.columns.states, _start(plant, exemplar), ax)
            plots.zoom(ax, exemplar, state, _start(plant, exemplar), window)
        row[0].set_title(f"{exemplar.fault}, {exemplar.profile}")
    for ax in axes[:-1].ravel():
        ax.set_xlabel("")
    _model_legend(figure, exemplars[0].names)
    return figure


def _model_legend(figure: Figure, names: Sequence[str]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Patch | Line2D] = [
        Patch(label=f"{name} model", edgecolor=colour, facecolor=(colour, 2.5 * plots.FILL), linewidth=1.5)
        for name, colour in colours(names).items()
    ]
    handles.append(Line2D([], [], color="#111111", marker="x", markeredgewidth=1.8, linewidth=1.1, label="true state"))
    figure.legend(handles=handles, loc="outside upper left", ncols=len(handles))


def _slowest(exemplars: Sequence[Exemplar]) -> list[Exemplar]:
    """Of each fault, the exemplary run in which most samples pass before the last falsification."""
    slowest: dict[str, Exemplar] = {}
    for exemplar in exemplars:
        best = slowest.get(exemplar.fault)
        if best is None or exemplar.last_falsification > best.last_falsification:
            slowest[exemplar.fault] = exemplar
    return list(slowest.values())


def _start(plant: Plant, exemplar: Exemplar) -> float:
    return fault_start(plant, exemplar.fault, exemplar.profile)
