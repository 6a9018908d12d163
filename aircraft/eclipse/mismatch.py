"""Measures what the observers' models leave out of the simulator, and writes the bounds that they use.

Run ``python -m aircraft.eclipse.mismatch`` after any change of the derivatives, the surrogate, the
autopilot, the noise sets or the table. The seeds are the command's own: no study uses their spawn key.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from aircraft import bounds_file
from aircraft.eclipse.models import NAMES, MismatchBounds
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.scenarios import FAULTS, HEALTHY, PROFILES, Run, Scenarios
from svo.checks import Array
from svo.faults import ActuatorFault, PlantFault

SPAWN_KEY = 0x0EC11953  # a study spawns its runs' seeds as 0, 1, 2, ...; this branch is never reached that way
# A faulty flight's mismatch is mostly the manoeuvre, which repeats; a fault-free one's is all chance, quadratic in
# the gusts, and its largest value still grows with the number of flights.
MARGIN = 1.5
HEALTHY_MARGIN = 2.5
RUNS = 500
BOUNDS_PATH = Path(__file__).with_name(bounds_file.NAME)


@dataclass(frozen=True)
class Mismatch:
    """What the fault's own model, with the true Delta and the true gusts, leaves out of one flight.

    ``state`` (K - 1, 4) is x(k+1) minus its prediction; ``output`` (K, 4) is h(x) - C x - c.
    """

    state: Array
    output: Array


def mismatch(run: Run, scenarios: Scenarios) -> Mismatch:
    """One-step mismatch of the scheduled model against the simulator along a flight."""
    blocks = scenarios.model.blocks.over(run.schedule)
    x, u = run.flight.x[:, :4], run.flight.u
    predicted = _apply(blocks["A"], x) + _apply(blocks["B"], u) + blocks["a"] + _apply(blocks["E"][:, :, :3], run.gusts)
    if isinstance(run.fault, ActuatorFault):
        lost = run.fault.delta(run.time)[:, None] * u
        predicted[:, :] -= blocks["B"][:, :, 0] * lost[:, :1]
    if isinstance(run.fault, PlantFault):
        direction = _apply(blocks["moment"], x) + blocks["moment_offset"]
        predicted += run.fault.delta(run.time)[:, None] * direction
    true_output = np.column_stack([np.hypot(x[:, 0], x[:, 1]), np.arctan2(x[:, 1], x[:, 0]), x[:, 2:]])
    return Mismatch(x[1:] - predicted[:-1], true_output - _apply(blocks["C"], x) - blocks["c"])


def largest(scenarios: Scenarios, fault: str, noise: str, runs: int, excitation: Array | None = None) -> MismatchBounds:
    """The largest mismatch seen over ``runs`` flights of each profile of a fault (or fault-free)."""
    state, output = np.zeros(4), np.zeros(4)
    for seed in seeds(noise, fault, runs):
        for profile in PROFILES if fault != HEALTHY else ("",):
            seen = mismatch(scenarios.run(fault, profile, noise, seed, excitation), scenarios)
            state = np.maximum(state, np.abs(seen.state).max(axis=0))
            output = np.maximum(output, np.abs(seen.output).max(axis=0))
    return MismatchBounds(state, output)


def measure(scenarios: Scenarios, runs: int) -> dict[str, dict[str, MismatchBounds]]:
    """Bounds for every noise set and observer; a fault's observer also covers fault-free flight."""
    return {noise: measure_one(scenarios, noise, runs) for noise in NOISE_SETS}


def measure_one(
    scenarios: Scenarios, noise: str, runs: int, excitation: Array | None = None
) -> dict[str, MismatchBounds]:
    """Bounds for one noise set, of flights with an input superposed on the autopilot's (`Scenarios.run`), if any."""
    seen = largest(scenarios, HEALTHY, noise, runs, excitation)
    healthy = MismatchBounds(HEALTHY_MARGIN * seen.state, HEALTHY_MARGIN * seen.output)
    result = {"nominal": healthy}
    for fault in FAULTS:
        seen = largest(scenarios, fault, noise, runs, excitation)
        state = np.maximum(MARGIN * seen.state, healthy.state)
        result[fault] = MismatchBounds(state, np.maximum(MARGIN * seen.output, healthy.output))
    return result


def _apply(matrices: Array, vectors: Array) -> Array:
    return np.einsum("kij,kj->ki", matrices, vectors)


def seeds(noise: str, fault: str, runs: int) -> Iterator[np.random.SeedSequence]:
    branch = (SPAWN_KEY, list(NOISE_SETS).index(noise), (HEALTHY, *FAULTS).index(fault))
    return (np.random.SeedSequence(0, spawn_key=(*branch, i)) for i in range(runs))


def to_toml(bounds: Mapping[str, Mapping[str, MismatchBounds]], runs: int) -> str:
    """The text of the bounds file."""
    lines = [
        "# Measured, not written by hand: the mismatch of the scheduled models against the simulator,",
        f"# {HEALTHY_MARGIN} times the largest value seen in {runs} fault-free flights with each noise set, {MARGIN}",
        f"# times the largest in {runs} flights of each fault and profile (at least the fault-free bound).",
        f"# python -m aircraft.eclipse.mismatch --runs {runs}",
        f"# state: per sample, {', '.join(NAMES['states'])} [m/s, m/s, rad, rad/s];"
        f" output: {', '.join(NAMES['outputs'])} [m/s, rad, rad, rad/s]",
    ]
    return bounds_file.to_text("\n".join(lines), bounds)


def main(
    runs: Annotated[int, typer.Option(help="Flights of each fault and profile, with each noise set.")] = RUNS,
    out: Annotated[Path, typer.Option(help="Where to write the bounds.")] = BOUNDS_PATH,
) -> None:
    """Measure the mismatch bounds of the Eclipse's observers and write them."""
    text = to_toml(measure(Scenarios(), runs), runs)
    out.write_text(text, encoding="utf-8")
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
