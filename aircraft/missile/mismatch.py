"""Measures what the observers' embedding leaves out of the simulator, and writes the bounds that they use.

Run ``python -m aircraft.missile.mismatch`` after any change of the airframe, guidance, noise sets or faults. The seeds
are the command's own: no study uses their spawn key.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from aircraft import bounds_file
from aircraft.missile.imu import DELAY, NOISE_SETS, SensorErrors
from aircraft.missile.models import Embedding, MismatchBounds, schedule_of
from aircraft.missile.plant import ENDS, FAULTS, STARTS, fault_of
from aircraft.missile.scenarios import TS, Fault, Flights, Run

SPAWN_KEY = 0x0EC11953  # a study spawns its runs' seeds as 0, 1, 2, ...; this branch is never reached that way
MARGIN = 1.5
RUNS = 200
BOUNDS_PATH = Path(__file__).with_name(bounds_file.NAME)


def mismatch(run: Run, embedding: Embedding, errors: SensorErrors) -> MismatchBounds:
    """The largest mismatch in one flight, given what the actuators achieved."""
    rows = slice(round(STARTS / TS), round(ENDS / TS))
    then = slice(rows.start - DELAY, rows.stop - DELAY)
    blocks = embedding.over(schedule_of(run.flight.y[rows]))
    v, a, u = run.flight.x[then, 3:6], run.flight.acceleration[then], run.flight.achieved[then]
    force = a - blocks["h"] - np.einsum("kij,kj->ki", blocks["G"], u)
    predicted = np.einsum("kij,kj->ki", blocks["A"], v) + TS * (a + blocks["gravity"])
    return MismatchBounds(
        np.abs(force).max(axis=0),
        np.abs(v[1:] - predicted[:-1]).max(axis=0),
        np.abs(errors.scale[:3] - 1.0) * np.abs(a).max(axis=0),
    )


def largest(flights: Flights, noise: str, faults: tuple[Fault, ...], branch: int, runs: int) -> MismatchBounds:
    """``MARGIN`` times the largest mismatch seen over ``runs`` flights."""
    embedding, errors = Embedding(flights.airframe, TS), NOISE_SETS[noise]
    key = (SPAWN_KEY, list(NOISE_SETS).index(noise), branch)
    seen = [
        mismatch(flights.run(faults, errors, np.random.SeedSequence(0, spawn_key=(*key, i)), ENDS), embedding, errors)
        for i in range(runs)
    ]
    return MismatchBounds(**{name: MARGIN * np.max([getattr(s, name) for s in seen], axis=0) for name in vars(seen[0])})


def measure(flights: Flights, runs: int) -> dict[str, dict[str, MismatchBounds]]:
    """Bounds for every noise set and observer; a fault's observer also covers fault-free flight."""
    result: dict[str, dict[str, MismatchBounds]] = {}
    for noise in NOISE_SETS:
        healthy = largest(flights, noise, (), 0, runs)
        result[noise] = {"nominal": healthy}
        for branch, name in enumerate(FAULTS, start=1):
            seen = largest(flights, noise, (fault_of(name),), branch, runs)
            widest = {part: np.maximum(getattr(seen, part), getattr(healthy, part)) for part in vars(seen)}
            result[noise][name] = MismatchBounds(**widest)
    return result


def to_toml(bounds: Mapping[str, Mapping[str, MismatchBounds]], runs: int) -> str:
    """The text of the bounds file."""
    lines = [
        "# Measured, not written by hand: what the observers' embedding leaves out of the simulator,",
        f"# {MARGIN} times the largest value seen in {runs} flights without and with each fault (at least the",
        f"# fault-free bound), from {STARTS:g} to {ENDS:g} s.  python -m aircraft.missile.mismatch --runs {runs}",
        "# force, output: m/s^2 in x, y, z; velocity: m/s per sample",
    ]
    return bounds_file.to_text("\n".join(lines), bounds)


def main(
    runs: Annotated[int, typer.Option(help="Flights of each kind, with each noise set.")] = RUNS,
    out: Annotated[Path, typer.Option(help="Where to write the bounds.")] = BOUNDS_PATH,
) -> None:
    """Measure the mismatch bounds of the missile's observers and write them."""
    text = to_toml(measure(Flights(), runs), runs)
    out.write_text(text, encoding="utf-8")
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
