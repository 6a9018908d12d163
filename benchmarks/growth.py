"""Cost of the observers as the horizon, the number of uncertainties and the length of the log grow.

Run with ``python -m benchmarks.growth``. CPU time of a step, boxes not read, all methods on the same logs in one run:

horizon          a random linear plant of 4 states: the window observer; the same programs over the same windows by
                 HiGHS, warm and rebuilt, and by cvxpy with Clarabel (compiled before, up to N = 20, five samples); the
                 paper's method (`PolytopeObserver`, 60 facets)
uncertainties    q of rank one in the state equation: window, zonotope and polytope observer; a hull over the vertices
                 of Delta in all steps would need 2^(q N) images
memory           resident memory of a window observer over a long log (``--samples``)

What a number of states costs is in ``python -m benchmarks.set_representations``.
"""

from __future__ import annotations

import sys
from time import process_time_ns
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from rich.progress import track

from benchmarks._observers import OBSERVERS, arguments, console, linear_plant, save, table, window
from benchmarks._window_contest import highs, record
from benchmarks._window_references import DUAL, PRIMAL, CvxpyWindow
from benchmarks._window_runs import Times
from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log

SEED, SETTLE, SAMPLES = 20_261_128, 60, 160
HORIZONS, COUNTS = (1, 2, 5, 10, 20, 50), (0, 1, 2, 3, 4, 5, 6)
PAPER_HORIZON, PAPER_COUNT = 5, 3  # the largest for which the explicit sets are run
CVXPY_HORIZON, CVXPY_SAMPLES = 20, range(SETTLE + 3, SAMPLES, 20)  # a problem a size of window: compiling takes long
LONGEST = 4.0  # seconds of CPU time that one method gets for a log


def cost(observer: Any, log: Log) -> float:
    """Mean CPU microseconds of a step."""
    times: list[float] = []
    first = process_time_ns()
    answers = drive(observer, log)
    for _ in range(len(log)):
        begun = process_time_ns()
        step = next(answers)
        times.append(1e-3 * (process_time_ns() - begun))
        assert step.verdict != "falsified"
        if 1e-9 * (process_time_ns() - first) > LONGEST:
            break
    return float(np.mean(times[min(SETTLE, len(times) // 2) :]))


def general_solvers(model: UncertainModel, box: HPolytope, log: Log, N: int) -> dict[str, float]:
    """Mean CPU microseconds of a sample's programs, as the window observer of N steps solved them, by other solvers."""
    recording = record(window(N)(model, box), log)
    samples, boxes, _, _ = recording.scaled(model)
    result = {}
    for name, options, rebuild in (("HiGHS, warm", PRIMAL, False), ("HiGHS, rebuilt", DUAL, True)):
        solve, times = highs(samples, recording, boxes, options, rebuild), Times()
        for k in range(len(log)):
            times.measure(solve, k)
        result[name] = float(times.microseconds("cpu", range(SETTLE, len(log))).mean())
    if N <= CVXPY_HORIZON:
        times = Times()
        for k in CVXPY_SAMPLES:
            query = recording.queries[k]
            problem = CvxpyWindow(samples, query.time - query.base, query.programs, query.target - query.base)
            problem.solve(query, *boxes[k])  # compiles it
            times.measure(lambda k, q=query, p=problem: p.solve(q, *boxes[k]), k)  # type: ignore[misc]
        result["cvxpy + Clarabel"] = float(times.microseconds("cpu").mean())
    return result


def over_horizons(rng: np.random.Generator) -> dict[str, dict[int, float]]:
    """Cost by method and N."""
    model = linear_plant(rng, 4)
    log = model.simulate(np.zeros(4), np.zeros((SAMPLES, 0)), rng)
    box = HPolytope.box(-np.ones(4), np.ones(4))
    result: dict[str, dict[int, float]] = {}
    for N in track(HORIZONS, "horizon", console=console, transient=True):
        costs = {"window observer": cost(window(N)(model, box), log)} | general_solvers(model, box, log, N)
        if N <= PAPER_HORIZON:
            costs["paper's method, 60 facets"] = cost(OBSERVERS["polytope"](model, box, N), log)
        for name, value in costs.items():
            result.setdefault(name, {})[N] = value
    return result


def uncertain_plant(rng: np.random.Generator, base: UncertainModel, count: int) -> UncertainModel:
    """With so many uncertainties of rank one in A, each of 2 % of its norm."""
    n = base.n_states
    parts = [np.outer(rng.normal(size=n), rng.normal(size=n)) for _ in range(count)]
    return base.replace(uncertainties=[Uncertainty(A=0.02 * part / np.linalg.norm(part, 2)) for part in parts])


def over_uncertainties(rng: np.random.Generator) -> dict[str, dict[int, float]]:
    """Cost by method and number of uncertainties, N = 10."""
    base = linear_plant(rng, 3)
    box = HPolytope.box(-np.ones(3), np.ones(3))
    result: dict[str, dict[int, float]] = {"window observer, N = 10": {}, "zonotope observer": {}, "paper": {}}
    for q in track(COUNTS, "uncertainties", console=console, transient=True):
        model = uncertain_plant(rng, base, q)
        log = model.simulate(np.zeros(3), np.zeros((SAMPLES, 0)), rng)
        result["window observer, N = 10"][q] = cost(window(10)(model, box), log)
        result["zonotope observer"][q] = cost(OBSERVERS["zonotope"](model, box), log)
        if q <= PAPER_COUNT:
            result["paper"][q] = cost(OBSERVERS["polytope"](model, box), log)
    result["paper's method, N = 1, 60 facets"] = result.pop("paper")
    return result


def resident_megabytes() -> float:
    """Resident memory of this process (Linux)."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096 / 1e6


def memory(rng: np.random.Generator, samples: int) -> tuple[list[int], list[float]]:
    """Resident memory along a log of so many samples, from the first tenth on."""
    model = linear_plant(rng, 2)
    observer, at, used = WindowObserver(model, HPolytope.box(-np.ones(2), np.ones(2))), [], []
    chunk = max(samples // 20, 1)
    x = np.zeros(2)
    for part in track(range(-(-samples // chunk)), "memory", console=console, transient=True):
        log = model.simulate(x, np.zeros((chunk + 1, 0)), rng)
        for step in drive(observer, log, start=int(part > 0)):
            assert step.verdict == "consistent"
        x = log.x[-1]
        at.append((part + 1) * chunk + 1)
        used.append(resident_megabytes())
    return at, used


def main(given: list[str] | None = None) -> None:
    """Measure, print and draw."""
    parser = arguments("growth", __doc__)
    parser.add_argument("--samples", type=int, default=20_000, help="of the log for the memory")
    options = parser.parse_args([] if given is None else given)
    rng = np.random.default_rng(SEED)
    small = linear_plant(rng, 2)
    for start in OBSERVERS.values():
        start(small, HPolytope.box(-np.ones(2), np.ones(2))).warm_up()
    panels = {"steps N": over_horizons(rng), "uncertainties": over_uncertainties(rng)}
    at, used = memory(rng, options.samples)
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.3))
    for ax, (what, methods) in zip(axes, panels.items(), strict=False):
        values = sorted({v for times in methods.values() for v in times})
        rows = [[name, *(f"{t[v]:.0f}" if v in t else "-" for v in values)] for name, t in methods.items()]
        table(f"Mean CPU microseconds a sample, by number of {what}", ("method", *map(str, values)), rows)
        for name, times in methods.items():
            ax.plot(list(times), list(times.values()), marker="o", label=name)
        ax.set_xlabel(f"number of {what}")
        ax.set_ylabel("mean CPU time a sample [us]")
        ax.set_yscale("log")
    axes[0].set_xscale("log")
    axes[0].set_xticks(HORIZONS, list(map(str, HORIZONS)))
    axes[0].minorticks_off()
    unit = panels["uncertainties"]["window observer, N = 10"][0]
    vertices = [(q, 2.0 ** (10 * q)) for q in COUNTS if q <= 2]
    costs = [unit * v for _, v in vertices]
    axes[1].plot([q for q, _ in vertices], costs, "k:", label="window at q = 0, times 2^(10 q)")
    for ax in axes[:2]:
        ax.legend(fontsize=8)
    axes[2].plot(at, used, marker="o")
    axes[2].set_ylim(0, 1.2 * max(used))
    axes[2].set_xlabel("samples")
    axes[2].set_ylabel("resident memory [MB]")
    times = panels["steps N"]["window observer"]
    rivals = {name: other for name, other in panels["steps N"].items() if name != "window observer"}
    ratios = [[name, *(f"{t[N] / times[N]:.1f}" if N in t else "-" for N in HORIZONS)] for name, t in rivals.items()]
    table("Cost in units of the window observer's, by number of steps N", ("method", *map(str, HORIZONS)), ratios)
    slope = np.polyfit(np.log([5, 10, 20, 50]), np.log([times[N] for N in (5, 10, 20, 50)]), 1)[0]
    console.print(f"window observer: N^{slope:.2f} from 5 to 50 (aim 1.3)")
    middle = len(used) // 2
    console.print(f"memory over {at[-1]} samples: {used[middle]:.1f} MB half way, {used[-1]:.1f} MB at the end")
    save(figure, options.out, "growth.png")


if __name__ == "__main__":
    main(sys.argv[1:])
