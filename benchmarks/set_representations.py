"""Window, polytope or constrained zonotope: width, delay and cost for 2 to 20 states.

Run with ``python -m benchmarks.set_representations``. Random linear plants with a bias of one sensor from sample 30 on;
the limit is full information. Width: mean of the box over healthy samples 10 to 29, relative to that of full
information. Delay: samples after the earliest provable alarm. Cost: mean CPU time of a step, boxes not read. The
polytope observer is run up to 4 states.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import process_time_ns
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from rich.progress import track

from benchmarks._observers import OBSERVERS, arguments, console, linear_plant, save, table, window
from polytopes import HPolytope
from svo import ConstrainedZonotopeObserver, UncertainModel
from svo.logs.drive import drive
from svo.logs.log import Log

SEED, SIZES, SAMPLES, FAULT_AT, FIRST_WIDTH = 20_261_129, (2, 4, 6, 8, 12, 16, 20), 50, 30, 10
LARGEST_POLYTOPE = 4
Start = Callable[[UncertainModel, HPolytope], Any]
METHODS: dict[str, Start] = {
    "window, N = 1": window(1),
    "window, N = 5": window(5),
    "window, N = 10": window(10),
    "window, N = 20": window(20),
    "zonotope (8 n, 3 n)": OBSERVERS["zonotope"],
    "zonotope (4 n, n)": lambda model, box: ConstrainedZonotopeObserver(
        model, box, max_generators=4 * box.dim, max_constraints=box.dim
    ),
    "polytope, 60 facets": OBSERVERS["polytope"],
}


def observe(observer: Any, log: Log) -> tuple[np.ndarray, float, float]:
    """Mean width of each state, sample of the alarm (or infinity), mean microseconds."""
    times, widths = [], []
    alarm = np.inf
    answers = drive(observer, log)
    for k in range(len(log)):
        begun = process_time_ns()
        step = next(answers)
        times.append(1e-3 * (process_time_ns() - begun))
        if step.verdict == "falsified":
            alarm = k
            break
        if FIRST_WIDTH <= k < FAULT_AT and k % 4 == 0:
            lower, upper = step.box
            widths.append(upper - lower)
    return np.mean(widths, axis=0), alarm, float(np.mean(times[FIRST_WIDTH:]))


def compare(plants: int) -> dict[tuple[str, int], list[tuple[float, float, float]]]:
    """Width ratio, delay beyond the limit and cost of every run, by method and number of states."""
    found: dict[tuple[str, int], list[tuple[float, float, float]]] = {}
    cases = [(n, i) for n in SIZES for i in range(plants)]
    for n, i in track(cases, "plants", console=console, transient=True):
        rng = np.random.default_rng([SEED, n, i])
        model = linear_plant(rng, n, outputs=max(1, n // 3), disturbances=max(1, n // 3))
        log = model.simulate(rng.uniform(-0.5, 0.5, n), np.zeros((SAMPLES, 0)), rng)
        log.y[FAULT_AT:, 0] += 0.5
        box = HPolytope.box(-np.ones(n), np.ones(n))
        limit_width, earliest, _ = observe(window(None)(model, box), log)
        for name, start in METHODS.items():
            if name.startswith("polytope") and n > LARGEST_POLYTOPE:
                continue
            width, alarm, cost = observe(start(model, box), log)
            delay = alarm - earliest if np.isfinite(earliest) else np.nan
            found.setdefault((name, n), []).append((float(np.mean(width / limit_width)), delay, cost))
    return found


def main(given: list[str] | None = None) -> None:
    """Compare, print and draw."""
    parser = arguments("set_representations", __doc__)
    parser.add_argument("--plants", type=int, default=3, help="of each number of states")
    options = parser.parse_args([] if given is None else given)
    OBSERVERS["window"](linear_plant(np.random.default_rng(0), 2), HPolytope.box(-np.ones(2), np.ones(2))).warm_up()
    found = compare(options.plants)
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.3))
    labels = ("width of the box, relative to full information", "alarm at the earliest sample [% of runs]",
              "mean CPU time a sample [us]")  # fmt: skip
    for column, (ax, label) in enumerate(zip(axes, labels, strict=True)):
        rows = []
        for name in METHODS:
            values = {n: np.array([run[column] for run in found[name, n]]) for n in SIZES if (name, n) in found}
            if column == 1:
                known = {n: v[~np.isnan(v)] for n, v in values.items()}
                shown = {n: 100.0 * float((v == 0).mean()) for n, v in known.items() if v.size}
            else:
                shown = {n: float(np.median(v)) for n, v in values.items()}
            rows.append([name, *(f"{shown[n]:.3g}" if n in shown else "-" for n in SIZES)])
            ax.plot(list(shown), list(shown.values()), marker="o", markersize=4, label=name)
        table(label, ("observer, states:", *map(str, SIZES)), rows)
        ax.set_xlabel("number of states")
        ax.set_xticks(SIZES)
        ax.set_ylabel(label)
        if column != 1:
            ax.set_yscale("log")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="lower center", ncols=4, bbox_to_anchor=(0.5, 0.9))
    save(figure, options.out, "set_representations.png")


if __name__ == "__main__":
    main(sys.argv[1:])
