"""Soundness of nonlinear models in window observers, at every sample: sets, verdicts, and each linearisation used.

Run with ``python -m benchmarks.nonlinear --samples 100000 --out nonlinear.jsonl``; what the file already holds is not
run again, so that it may be interrupted at any time. Batch i of a plant is drawn from seed (SEED, plant, i): 36
runs with w, p and noise at corners, inside, or w and p constant at a corner; in every second batch all w and p vary
inside samples at random times; in two of four the units are other powers of two; in one of three the samples come at
random intervals, Ts +-90 %. Runaways (a reactor that ignites) are counted apart. Exit code 1 if anything is excluded or
falsified, or if a linearisation does not hold what the plant did.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from rich.progress import track

from benchmarks._observers import console, table
from svo.logs.log import Log
from tests.svo.models.nonlinear_plants import CASES, Case
from tests.svo.models.nonlinear_runs import MUST_NOT, Findings, examine_run
from tests.svo.models.nonlinear_truth import simulated
from tests.svo.models.plants_of_the_field import AIRCRAFT, FIELD, ignition
from tests.svo.models.random_nonlinear import random_plant
from tests.svo.models.units import in_other_units

SEED = 20_261_129
RUN, BATCH = 100, 36  # samples of a run, runs of a batch
MODES = ("corners", "inside", "constant")
INTERVALS = 0.9  # of Ts
RANDOM, MAPS = 20, 5  # plants in continuous and in discrete time
PLANTS: dict[str, Callable[..., Case]] = {
    **CASES, **AIRCRAFT, **FIELD, **{f"random {i}": partial(random_plant, i) for i in range(RANDOM)},
    **{f"random map {i}": partial(random_plant, i, continuous=False) for i in range(RANDOM, RANDOM + MAPS)},
    "ignition": ignition,
}  # fmt: skip


def examine(name: str, i: int, runs: int = BATCH, samples: int = RUN) -> dict[str, Any]:
    """One batch of one plant: what happened."""
    rng = np.random.default_rng([SEED, list(PLANTS).index(name), i])
    case = PLANTS[name](**({"varying": "all"} if i % 2 else {}))
    if i // 2 % 2:
        case = in_other_units(case, rng)
    by_events = i % 3 == 2 and case.model.continuous
    made = simulated(case, samples, rng, [MODES[j % 3] for j in range(runs)], INTERVALS if by_events else 0.0)
    found, begun = Findings(Counter(), []), process_time()
    for j in range(runs):
        examine_run(case, made, j, rng, by_events, found)
    seconds = process_time() - begun
    width = np.mean(found.widths, axis=0) / case.spread if found.widths else np.full(len(case.x0), np.nan)
    return {
        "plant": name, "batch": i, "count": dict(found.count), "width": width.tolist(), "closest": found.closest,
        "unresolved": found.unresolved, "seconds": seconds,
    }  # fmt: skip


def run(case: Case, rng: np.random.Generator, mode: str) -> Log:
    """A log with the truth, w and noise as ``mode`` says."""
    made = simulated(case, RUN, rng, [mode])
    return Log(np.arange(RUN) * case.model.Ts, made.u[..., 0], made.y[..., 0], x=made.x[..., 0])


def stored(path: Path) -> Iterator[dict[str, Any]]:
    """The batches of a file; a line that was cut off by an interruption is none."""
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            yield json.loads(line)
        except json.JSONDecodeError:
            continue


def main() -> None:
    """Examine every plant and print what was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.nonlinear", description=__doc__)
    parser.add_argument("--samples", type=int, default=RUN * BATCH * len(PLANTS), help="of all plants together")
    parser.add_argument("--plants", nargs="*", default=list(PLANTS), choices=list(PLANTS))
    parser.add_argument("--out", type=Path, default=None, help="a file that keeps the batches, and is gone on with")
    chosen = parser.parse_args()
    batches = -(-chosen.samples // (RUN * BATCH * len(chosen.plants)))
    wanted = [(name, i) for i in range(batches) for name in chosen.plants]
    found = {} if chosen.out is None else {(batch["plant"], batch["batch"]): batch for batch in stored(chosen.out)}
    for key in track([key for key in wanted if key not in found], description="batches", console=console):
        found[key] = examine(*key)
        if chosen.out is not None:
            with chosen.out.open("a", encoding="utf-8") as file:
                file.write("\n" + json.dumps(found[key]))
    _report([found[key] for key in wanted], chosen.plants)


def _report(batches: list[dict[str, Any]], plants: list[str]) -> None:
    rows, total = [], Counter[str]()
    for name in plants:
        own = [batch for batch in batches if batch["plant"] == name]
        count = sum((Counter(batch["count"]) for batch in own), Counter[str]())
        total += count
        failures = sum(count[what] for what in MUST_NOT)
        closest, error = (max(batch[what] for batch in own) for what in ("closest", "unresolved"))
        cost = 1e3 * sum(batch["seconds"] for batch in own) / max(1, count["samples"])
        shown = (count[f"undecided in {what}"] for what in ("normal operation", "a runaway"))
        made = count["samples"], count["transitions"], failures, *shown, count["runaway"]
        rows.append([name, *made, f"{closest:.3f}", f"{error:.1e}", f"{cost:.1f}"])
    columns = [
        "plant", "samples", "transitions", "failures", "undecided", "in runaways", "runaway samples", "closest to R",
        "truth's error / R", "ms a sample",
    ]  # fmt: skip
    table("Nonlinear models in window observers", columns, rows)
    for what, number in total.items():
        if ": run" in what:
            print(f"{what} ({number})")
    failures = sum(total[what] for what in MUST_NOT)
    normal = total["samples"] - total["runaway"]
    print(f"undecided in normal operation: {total['undecided in normal operation']} of {normal}")
    print(f"{total['samples']} cases, {failures} failures")
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
