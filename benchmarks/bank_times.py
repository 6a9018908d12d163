"""What a sample of the Eclipse's two banks takes: the one with the simulator's equations beside the linear one.

Run with ``python -m benchmarks.bank_times``. Both follow the same healthy flight, one after the other, ``--turns``
times; CPU microseconds of a whole run by the samples of the log, for the bank of four and for each of its observers.
The machine may have other work, which slows both alike: what counts is the median of the ratios of neighbouring turns.
"""

from __future__ import annotations

import argparse
import os
from statistics import median
from time import process_time

from aircraft.eclipse.plant import Eclipse
from benchmarks._observers import table
from svo.logs.log import Log
from svo.plant import HEALTHY
from svo.plant.scheduling import scheduled

NOISE, SEED = "quiet", 5
PLANTS = {kind: Eclipse().with_models(kind) for kind in ("nonlinear", "lpv")}  # type: ignore[arg-type]
OBSERVERS = 4


def turn(kind: str, log: Log) -> float:
    """CPU microseconds a sample of a bank over a log that it has not seen."""
    bank = PLANTS[kind].bank(NOISE)
    begun = process_time()
    bank.run(log)
    return 1e6 * (process_time() - begun) / len(log)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bank_times", description=__doc__)
    parser.add_argument("--turns", type=int, default=7)
    turns = parser.parse_args().turns
    given = PLANTS["lpv"].simulate(HEALTHY, HEALTHY, NOISE, SEED)
    logs = {kind: scheduled(plant.scheduler(), given) for kind, plant in PLANTS.items()}
    for kind, log in logs.items():
        turn(kind, log)
    times = [{kind: turn(kind, log) for kind, log in logs.items()} for _ in range(turns)]
    rows = [[kind, f"{(least := min(at[kind] for at in times)):.0f}", f"{least / OBSERVERS:.0f}"] for kind in PLANTS]
    table(f"CPU us a sample, best of {turns}", ["models", "bank of four", "an observer"], rows)
    print(f"nonlinear / lpv, median: {median(at['nonlinear'] / at['lpv'] for at in times):.2f}")
    print(f"load: {' '.join(f'{load:.1f}' for load in os.getloadavg())}")


if __name__ == "__main__":
    main()
