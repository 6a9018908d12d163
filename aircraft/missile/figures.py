"""Pictures of the missile benchmark: trajectories (Fig. 3 of Marzat et al., SysTol 2010) and residuals (Figs. 4-6)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aircraft.missile.adaptive import ModelError
from aircraft.missile.imu import NOISE_SETS
from aircraft.missile.redundancy import ETA, RESIDUALS, residuals
from aircraft.missile.scenarios import DURATION, SCENARIOS, TS, Flights, Run, Scenario
from svo.store import write_whole

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#111111", "#0072B2", "#009E73", "#CC79A7")
TARGET, BOUND, FAULT = "#D55E00", "#D55E00", "#5B6470"
TRAJECTORY_DURATION = 80.0
DPI = 150


def write_figures(folder: Path, flights: Flights, seed: int, noise: str = "gaussian") -> dict[str, Path]:
    """Write trajectories.png and scenario_1.png to scenario_3.png; returns title -> path."""
    from matplotlib.figure import Figure

    written = {}
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    plot_trajectories(flights, seed, noise, figure.add_subplot(projection="3d"))
    written["Trajectories (Fig. 3)"] = folder / "trajectories.png"
    _save(written["Trajectories (Fig. 3)"], figure)
    for number, scenario in SCENARIOS.items():
        run = flights.run(scenario.faults, NOISE_SETS[noise], seed)
        figure = Figure(figsize=(8.0, 1.9 * len(scenario.shown) + 0.4), layout="constrained")
        axes = figure.subplots(len(scenario.shown), 1, sharex=True)
        for ax, name in zip(axes, scenario.shown, strict=True):
            plot_residual(flights, run, scenario, name, ax)
        axes[-1].set_xlabel("time [s]")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=len(handles), frameon=False)
        title = f"Residuals of scenario {number} (Fig. {number + 3})"
        written[title] = folder / f"scenario_{number}.png"
        _save(written[title], figure)
    return written


def _save(path: Path, figure: Figure) -> None:
    write_whole(path, lambda file: figure.savefig(file, dpi=DPI))


def plot_trajectories(flights: Flights, seed: int, noise: str, ax: Axes) -> list[Artist]:
    """Missile and target in 3-D, without a fault and in the three scenarios, to the closest approach [km]."""
    artists: list[Artist] = []
    cases = {"no fault": Scenario(())} | {f"scenario {i}": s for i, s in SCENARIOS.items()}
    for colour, (name, scenario) in zip(COLOURS, cases.items(), strict=True):
        flight = flights.run(scenario.faults, NOISE_SETS[noise], seed, TRAJECTORY_DURATION).flight
        closest = int(np.argmin(flight.distance))
        x, y, z = flight.x[: closest + 1, :3].T / 1000
        label = f"{name}: misses by {flight.distance[closest]:.0f} m"
        artists += ax.plot(x, y, -z, color=colour, linewidth=1.6, label=label)
        if name == "no fault":
            tx, ty, tz = flight.target[: closest + 1].T / 1000
            artists += ax.plot(tx, ty, -tz, color=TARGET, linestyle="--", linewidth=1.6, label="target")
        for start, _ in scenario.events:
            k = round(start / TS)
            artists += ax.plot([x[k]], [y[k]], [-z[k]], "o", color=colour, markersize=4)
    ax.set(xlabel="x [km]", ylabel="y [km]", zlabel="height [km]")
    ax.set_title("Dots: a fault begins", fontsize="medium")
    ax.legend(loc="upper left", frameon=False)
    ax.view_init(elev=20, azim=-50)  # type: ignore[attr-defined]
    return artists


def plot_residual(flights: Flights, run: Run, scenario: Scenario, name: str, ax: Axes) -> list[Artist]:
    """One residual over time with its adaptive bounds and the starts of the faults."""
    log = residuals(run.flight.y, run.aligned_inputs, flights.airframe, (name,))
    error = ModelError(run.errors, flights.model_error)
    bound = error.residual_bounds(run.flight.y, flights.airframe, (name,))[:, 0]
    scale, unit = (1.0, "-") if RESIDUALS[name].target == ETA else (float(np.degrees(1.0)), "deg")
    artists: list[Artist] = list(ax.plot(run.time, scale * log[name], color="#0072B2", linewidth=0.6, label="residual"))
    artists += ax.plot(run.time, scale * bound, color=BOUND, linewidth=1.0, label="adaptive bounds")
    artists += ax.plot(run.time, -scale * bound, color=BOUND, linewidth=1.0)
    for start, fault in scenario.events:
        artists.append(ax.axvline(start, color=FAULT, linestyle=(0, (4, 3)), linewidth=1.0))
        place = ax.get_xaxis_transform()
        artists.append(ax.text(start, 1.01, fault, transform=place, ha="center", va="bottom", fontsize="small"))
    seen = slice(0, round(70.0 / TS))  # the last seconds, near the intercept, would hide the rest
    extent = 1.1 * scale * max(float(np.nanmax(np.abs(log[name][seen]))), float(np.nanmax(bound[seen])))
    ax.set(xlim=(0.0, DURATION), ylim=(-extent, extent), ylabel=f"{name} [{unit}]")
    return artists
