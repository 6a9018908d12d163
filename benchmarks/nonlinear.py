"""Soundness of nonlinear models in window observers: exclusions of the true state and false alarms, which must be zero.

Run with ``python -m benchmarks.nonlinear --samples 100000 --out nonlinear.jsonl``; what the file already holds is not
run again, so that it may be interrupted at any time. Run i of a plant is drawn from seed (SEED, plant, i): w, p and
noise at corners, inside, or w and p constant at a corner; held, or all of them varying with switches within a sample.
The truth is integrated by Runge and Kutta's method, finer at kinks. Widths stand beside those of the prototype of the
method where its plant is the same. Exit code 1 if anything is excluded or falsified.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from rich.progress import track

from benchmarks._observers import console, table
from polytopes import HPolytope
from svo import WindowObserver
from svo.checks import Array
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.draws import draw
from svo.models.nonlinear.simulation import integrated
from tests.svo.models.nonlinear_plants import CASES, Case

SEED = 20_261_129
RUN = 100  # samples
SETTLED = 30  # samples after which widths count
PIECES = 4  # of a sample, between which what varies may switch
W_MODES = ("corners", "inside", "constant")
PROTOTYPE = {"cstr": "0.0053 0.247", "three tanks": "0.101 0.095 0.102", "servo": "0.00042"}
TOLERANCE = 1e-3  # of a width: the integrator's error


def examine(name: str, i: int) -> dict[str, Any]:
    """One run of one plant: what happened."""
    rng = np.random.default_rng([SEED, list(CASES).index(name), i])
    case = CASES[name](**({"varying": "all"} if i // 3 % 2 else {}))
    log = run(case, rng, W_MODES[i % 3])
    first = case.x0 - case.spread * rng.uniform(0.0, 2.0, len(case.x0)), log.x[0]
    lower, upper = np.minimum(*first), np.maximum(first[1], case.x0 + case.spread)
    observer = WindowObserver(case.model, HPolytope.box(lower, upper), horizon=10)
    count: Counter[str] = Counter()
    widths, begun = [], process_time()
    for k, step in enumerate(drive(observer, log)):
        count["samples"] += 1
        count[step.verdict] += 1
        if step.verdict == "falsified":
            count[f"falsified: run {i}, sample {k}"] += 1
            break
        low, high = step.box
        room = TOLERANCE * (high - low)
        if not ((log.x[k] >= low - room) & (log.x[k] <= high + room)).all():
            count["excluded"] += 1
            count[f"excluded: run {i}, sample {k}"] += 1
        if step.verdict == "undecided":
            count[f"undecided: run {i}, {step.reason}"] += 1
        if k >= SETTLED:
            widths.append(high - low)
    seconds = process_time() - begun
    return {"plant": name, "run": i, "count": count, "width": np.mean(widths, axis=0).tolist(), "seconds": seconds}


def run(case: Case, rng: np.random.Generator, w_mode: str) -> Log:
    """A log with the truth, which starts in the first set."""
    model, flow, corners = case.model, case.model.flow, w_mode != "inside"
    x, inputs = case.x0 + case.spread * rng.uniform(-1.0, 1.0, len(case.x0)), case.inputs(RUN)
    shift = rng.integers(0, 1000)
    inputs = np.array([case.u(k + shift) for k in range(RUN)], dtype=float).reshape(inputs.shape)
    steps = 20 if case.smooth else 100
    w, states, outputs = draw(*flow.w, rng, True), [], []
    for u in inputs:  # a controller writes into it
        w = w if w_mode == "constant" else draw(*flow.w, rng, corners)
        states.append(x)
        y: Array = model.reading.values(np.concatenate([x, w, u]))
        outputs.append(y + draw(-model.noise, model.noise, rng, corners))
        if case.control is not None:
            u += case.control(outputs[-1])
        pieces = PIECES if flow.varying.any() and w_mode != "constant" else 1
        for piece in range(pieces):
            within = np.where(flow.varying, draw(*flow.w, rng, corners), w) if piece else w
            x = integrated(flow, x, within, u, model.Ts / pieces, steps // (2 if pieces > 1 else 1))
    return Log(np.arange(RUN) * model.Ts, inputs, np.array(outputs), x=np.array(states))


def stored(path: Path) -> Iterator[dict[str, Any]]:
    """The runs of a file; a line that was cut off by an interruption is none."""
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            yield json.loads(line)
        except json.JSONDecodeError:
            continue


def main() -> None:
    """Examine every plant and print what was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.nonlinear", description=__doc__)
    parser.add_argument("--samples", type=int, default=4_800, help="of all plants together")
    parser.add_argument("--plants", nargs="*", default=list(CASES), choices=list(CASES))
    parser.add_argument("--out", type=Path, default=None, help="a file that keeps the runs, and is gone on with")
    chosen = parser.parse_args()
    runs = -(-chosen.samples // (RUN * len(chosen.plants)))
    wanted = [(name, i) for i in range(runs) for name in chosen.plants]
    found = {} if chosen.out is None else {(run["plant"], run["run"]): run for run in stored(chosen.out)}
    for key in track([key for key in wanted if key not in found], description="runs", console=console):
        found[key] = examine(*key)
        if chosen.out is not None:
            with chosen.out.open("a", encoding="utf-8") as file:
                file.write("\n" + json.dumps(found[key]))
    _report([found[key] for key in wanted], chosen.plants)


def _report(runs: list[dict[str, Any]], plants: list[str]) -> None:
    rows, total = [], Counter[str]()
    for name in plants:
        own = [run for run in runs if run["plant"] == name]
        count = sum((Counter(run["count"]) for run in own), Counter[str]())
        total += count
        width = " ".join(f"{v:.3g}" for v in np.mean([run["width"] for run in own], axis=0))
        shown = (count[what] for what in ("samples", "excluded", "falsified", "undecided"))
        cost = 1e3 * sum(run["seconds"] for run in own) / count["samples"]
        rows.append([name, *shown, width, PROTOTYPE.get(name, ""), f"{cost:.1f}"])
    columns = ["plant", "samples", "excluded", "falsified", "undecided", "mean widths", "prototype", "ms a sample"]
    table("Nonlinear models in window observers", columns, rows)
    for what, number in total.items():
        if ": run" in what:
            print(f"{what} ({number})")
    failures = total["excluded"] + total["falsified"]
    print(f"undecided: {total['undecided']}")
    print(f"{total['samples']} cases, {failures} failures")
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
