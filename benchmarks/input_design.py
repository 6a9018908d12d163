"""A designed input on the Eclipse: a small loss of the elevator isolated in excited and in regulated flight.

Run with ``python -m benchmarks.input_design --out DIR``. The input is designed on the observers' models (`svo
design-input`) and superposed on the autopilot's from the first faulty sample on. It leads to flights for which the
bounds of the observers' models were not measured, so they are measured again, on such flights and on seeds of their
own; regulated flights are judged with the plant's own bounds and with these wider ones. Besides: what the same input
does to the dynamics fault, and the separations of both faults, which say why.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from aircraft.eclipse.mismatch import measure_one
from aircraft.eclipse.plant import Eclipse
from aircraft.eclipse.scenarios import HEALTHY, Scenarios
from svo.analysis.isolability import FaultFreeFlight
from svo.analysis.model_pair import ModelPair
from svo.analysis.plant_input import PlantInput, plant_input
from svo.logs.log import Log

Array = NDArray[np.float64]
FAULT, OTHER, PROFILE = "elevator", "dynamics", "step"
# Names of the three ways to fly and to judge.
OWN, WIDE, EXCITED = "regulated", "regulated, wider bounds", "designed input"


@dataclass(frozen=True)
class Outcome:
    """Delays [s] of one flight, None where not reached, and whether the true model was falsified."""

    detected: float | None
    isolated: float | None
    wrong: bool


def main(arguments: Sequence[str] | None = None) -> None:
    """Design, fly, print and draw."""
    options = _parser().parse_args([] if arguments is None else arguments)
    plant, console = Eclipse(model_kind="lpv"), Console(width=130)
    found = plant_input(plant, options.noise, FAULT, options.horizon, hold=options.hold, size=options.size)
    print(found.to_text(), flush=True)
    if found.design.u is None:
        return
    excitation = found.design.u - found.design.reference
    bounds = measure_one(plant.scenarios, options.noise, options.flights, excitation)
    wide = replace(plant, bounds={options.noise: bounds})
    ways = {OWN: (plant, None), WIDE: (wide, None), EXCITED: (wide, excitation)}
    outcomes = {
        (fault, way): [judged(bank, fault, options.size, options.noise, seed, moved) for seed in range(options.runs)]
        for fault in (FAULT, OTHER, HEALTHY)
        for way, (bank, moved) in ways.items()
    }
    console.print(delay_table(outcomes, options.size, options.noise))
    console.print(separation_table(plant, options.noise, options.size, found))
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
        picture(found, outcomes, options.size, options.noise).savefig(options.out / "input_design.png", dpi=150)
        print(f"Picture: {options.out / 'input_design.png'}")


def judged(plant: Eclipse, fault: str, size: float, noise: str, seed: int, excitation: Array | None) -> Outcome:
    """Fly one fault at a fraction of its size, and run the plant's bank over the flight."""
    run = Scenarios(plant.scenarios.model, size).run(fault, PROFILE, noise, seed, excitation)
    record = plant.bank(noise).run(Log(time=run.time, u=run.flight.u, y=run.flight.y, schedule=run.schedule))
    first = round(plant.fault_time / plant.Ts)
    delays = [None if k is None else (k - first + 1) * plant.Ts for k in (record.detected_at, record.isolated_at)]
    wrong = record.detected_at is not None if fault == HEALTHY else record.died_at[fault] is not None
    return Outcome(delays[0], delays[1], wrong)


def delay_table(outcomes: dict[tuple[str, str], list[Outcome]], size: float, noise: str) -> Table:
    """Delays of both faults and alarms of healthy flights, one row a fault and way."""
    table = Table(title=f"Faults at {size:g} of their size (step), {noise} noise, seconds", title_justify="left")
    for name in ("fault", "flight", "detected", "median", "isolated", "median", "largest", "true model falsified"):
        table.add_column(name)
    for (fault, way), runs in outcomes.items():
        cells = [fault, way]
        for event in ("detected", "isolated"):
            delays = np.array([np.inf if d is None else d for d in (getattr(o, event) for o in runs)])
            median = np.sort(delays)[len(delays) // 2]
            cells += [f"{np.isfinite(delays).sum()}/{len(runs)}", _seconds(median)]
        cells += [_seconds(delays.max()), f"{sum(o.wrong for o in runs)}/{len(runs)}"]
        table.add_row(*cells)
    return table


def separation_table(plant: Eclipse, noise: str, size: float, found: PlantInput) -> Table:
    """How far apart the models are over the horizon, in regulated flight and with the designed input."""
    samples = len(found.design.reference)
    flight = FaultFreeFlight.of(plant, noise, found.seed, samples)
    title = f"Separation over {samples} samples in noise widths (below 0: not distinguishable): regulated -> designed"
    table = Table(title=title, title_justify="left")
    for name in ("plant with fault", *flight.models):
        table.add_column(name)
    stated = {FAULT: size, OTHER: 1.0}
    for fault, fraction in stated.items():
        case = plant.stated_faults(noise, fraction)[fault]
        cells = [case.description]
        for name, model in flight.models.items():
            values = []
            for u in (found.design.reference, found.design.u):
                pair = ModelPair(
                    case.model, model, samples, flight.known["nominal"], flight.known[name], u, flight.schedule
                )
                values.append(pair.solve(samples, least=-1.0).separation)
            cells.append("its own" if name == fault else f"{values[0]:+.3f} -> {values[1]:+.3f}")
        table.add_row(*cells)
    return table


def picture(found: PlantInput, outcomes: dict[tuple[str, str], list[Outcome]], size: float, noise: str) -> Figure:
    """The designed elevator command, and the delay of isolation of each flight."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.4))
    time = np.arange(len(found.design.reference)) * found.Ts
    left.step(time, found.design.reference[:, 0], where="post", label="autopilot, fault-free flight", color="0.5")
    left.step(time, found.design.u[:, 0], where="post", label="with the designed input", color="C3")
    left.axhline(25.0, color="k", linewidth=0.8, linestyle=":")
    left.annotate("limit", (0.0, 25.0), textcoords="offset points", xytext=(2, 3), fontsize=8)
    left.set_xlabel("time since the fault [s]")
    left.set_ylabel("elevator [deg]")
    left.set_ylim(0.0, 28.0)
    left.legend(loc="lower right", fontsize=8)
    never = 10.0
    for x, way in enumerate((OWN, WIDE, EXCITED)):
        delays = [never if o.isolated is None else o.isolated for o in outcomes[FAULT, way]]
        spread = np.linspace(-0.25, 0.25, len(delays))
        right.plot(x + spread, delays, "o", markersize=4, color="C3" if way == EXCITED else "0.4")
    right.axhline(5.0, color="k", linewidth=0.8, linestyle=":")
    right.set_yscale("log")
    right.set_ylim(0.01, 15.0)
    right.set_yticks([0.01, 0.1, 1.0, never], ["0.01", "0.1", "1", "not in\n5 s"])
    right.set_xticks(range(3), [OWN, "regulated,\nwider bounds", "designed input,\nwider bounds"])
    right.set_xlim(-0.6, 2.6)
    right.set_ylabel("time to isolate [s]")
    right.set_title(f"{50 * size:g} % loss of the elevator, {noise} noise, a dot a flight", fontsize=9)
    return figure


def _seconds(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "∞"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.input_design", description=__doc__.split("\n")[0])
    parser.add_argument("--noise", default="conservative", help="noise set")
    parser.add_argument("--size", type=float, default=0.3, help="of the fault, as a fraction of the paper's")
    parser.add_argument("--horizon", type=int, default=10, help="samples within which the models must separate")
    parser.add_argument("--hold", type=int, default=5, help="samples over which the input is constant")
    parser.add_argument("--runs", type=int, default=20, help="flights of each kind")
    parser.add_argument("--flights", type=int, default=100, help="flights of each kind that give the wider bounds")
    parser.add_argument("--out", type=Path, help="folder for the picture")
    return parser


if __name__ == "__main__":
    main(sys.argv[1:])
