"""Widths of the sets of nonlinear models beside those of the prototype of the method, on the same runs.

Run with ``python -m benchmarks.prototype_widths``. Six runs of 100 samples a plant: w, p and noise at corners, inside,
or w constant at a corner, held, then the same varying. The prototype's linearisations (affine forms with secants, one
narrowing pass, no second substep) were handed to the same window observer, once, on 29 November 2026; its mean widths
over the samples from 30 on are the constants below. Exit code 1 if a mean width is more than 5 % above.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np

from benchmarks._observers import table
from benchmarks.nonlinear import MODES, SEED, run
from polytopes import HPolytope
from svo import WindowObserver
from svo.checks import Array
from svo.logs.drive import drive
from svo.logs.log import Log
from tests.svo.models.nonlinear_plants import CASES, Case

RUNS, SETTLED, HORIZON = 6, 30, 10
ALLOWED = 1.05
PROTOTYPE = {
    "cstr": [0.0038455, 0.17487],
    "tank": [0.026509, 0.024133, 0.049056, 0.042769],
    "pendulum": [0.0041572, 0.030449],
    "lorenz": [0.063153, 0.24705, 0.4368],
    "three tanks": [0.086519, 0.074665, 0.080193],
    "servo": [0.0004733],
    "friction": [0.00093182, 0.021693],
}


def runs(name: str) -> Iterator[tuple[Case, HPolytope, Log]]:
    """Plant, first set and log of each run."""
    for i in range(RUNS):
        rng = np.random.default_rng([SEED, list(CASES).index(name), 1000 + i])
        case = CASES[name](**({"varying": "all"} if i // 3 % 2 else {}))
        lower, upper = case.x0 - 2.0 * case.spread, case.x0 + 2.0 * case.spread
        if case.model.physical_range is not None:
            lower, upper, _ = case.model.physical_range.cut(lower, upper)
        yield case, HPolytope.box(lower, upper), run(case, rng, MODES[i % 3])


def mean_width(model: object, initial: HPolytope, log: Log) -> Array:
    """Of the settled sets, each state (n,)."""
    boxes = [np.array(step.box) for step in drive(WindowObserver(model, initial, horizon=HORIZON), log)]
    return np.asarray(np.mean([high - low for low, high in boxes[SETTLED:]], axis=0))


def main() -> None:
    """Print the widths of every plant that the prototype has."""
    rows, worst = [], 0.0
    for name, theirs in PROTOTYPE.items():
        ours = np.mean([mean_width(case.model, initial, log) for case, initial, log in runs(name)], axis=0)
        ratio = ours / theirs
        worst = max(worst, float(ratio.max()))
        shown = (" ".join(f"{v:.3g}" for v in values) for values in (ours, theirs))
        rows.append([name, *shown, " ".join(f"{v:.2f}" for v in ratio)])
    table("Mean widths", ["plant", "ours", "prototype's", "ours / prototype's"], rows)
    sys.exit(worst > ALLOWED)


if __name__ == "__main__":
    main()
