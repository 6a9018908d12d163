"""The window observer against HiGHS and against cvxpy with Clarabel, and its cost as the window grows.

Run with ``python -m benchmarks.window_observer``. One flight of the Eclipse (quiet noise, fixed seed), the nominal
observer, N = 10, box template. All methods solve the same programs over the same windows: the arrival sets are those
that the observer found. They take turns of 20 samples on the same samples, so that the machine's noise hits all alike;
ratios are medians over the samples. Wall time counts what the scheduler takes away, CPU time (of the whole process)
does not.

Two schedules:

as used       the observer slides by 2N//5 = 4 samples at once, and spreads the 2n = 8 supports of the next arrival set
              over the samples before: 2 supports a sample, the first of which also decides emptiness
every sample  the window slides by one sample: 8 supports at each; the first one also decides emptiness

A call includes everything from the new measurement to the verdict. HiGHS and cvxpy get the scaled numbers for nothing.
"""

from __future__ import annotations

import argparse
import sys

from rich.console import Console

from aircraft.eclipse.plant import Eclipse
from benchmarks._window_contest import compete, tabulate_contest
from benchmarks._window_cost import grow, tabulate_alone, tabulate_first_steps, tabulate_growth
from benchmarks._window_runs import NOISE, SCHEDULES, SEED


def main(arguments: list[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.window_observer", description=__doc__.split("\n")[0])
    parser.add_argument("--flights", type=int, default=3, help="flights of 10 s for the absolute times")
    options = parser.parse_args([] if arguments is None else arguments)
    console, plant = Console(width=170), Eclipse(model_kind="lpv")
    plant.bank(NOISE).warm_up()
    logs = [plant.simulate("none", "none", NOISE, SEED + i) for i in range(max(1, options.flights))]
    model = plant.models(NOISE)["nominal"]
    console.print(tabulate_contest({schedule: compete(model, logs[0], schedule) for schedule in SCHEDULES}))
    console.print("Largest difference: of a bound from ours, relative to the width of the window's arrival box there.")
    console.print(tabulate_alone(plant, logs))
    console.print(tabulate_growth(grow(plant, logs[0])))
    console.print(tabulate_first_steps())


if __name__ == "__main__":
    main(sys.argv[1:])
