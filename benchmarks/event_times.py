"""Samples at times of their own: exclusions of the true state and false alarms, which must be zero.

Run with ``python -m benchmarks.event_times --samples 100000 --out event_times.jsonl``; what the file already holds is
not run again, so that it may be interrupted at any time. Run i of a kind is drawn from seed (SEED, kind, i): intervals
within 90 % of their mean, up to three sensors and the input with clocks of their own, inputs that change between
readings, w, Delta, p and noise at corners or inside, held from event to event or varying within, and stamps that are
exact or off by 5 or 50 % of the sampling time (linear: 1 or 30 %). The truth is an exponential of each
piece of time, or integrated by Runge and Kutta's method. Runaways are counted apart: a reactor from where it ignites,
and a linear plant that grows beyond a million times what moves it (all of its run, whose bounds of the state its model
is given). Exit code 1 if anything is excluded or falsified.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from benchmarks._observers import console, table
from benchmarks.nonlinear import stored
from svo import ConstrainedZonotopeObserver, PolytopeObserver, WindowObserver
from svo.logs.drive import drive
from tests.svo.models.nonlinear_plants import CASES
from tests.svo.observers.event_plants import EventCase, EventPlant
from tests.svo.observers.nonlinear_events import PLANTS, nonlinear_case

SEED = 20_261_129
OBSERVERS = {"window": WindowObserver, "zonotope": ConstrainedZonotopeObserver, "polytope": PolytopeObserver}
RUN = {"polytope": 15}  # samples; 50 of the others
SHARE = {"window": 8, "zonotope": 2, "polytope": 1}  # of the runs; nonlinear plants: 1 each
RUNAWAY = 1e6  # of first states, inputs and w of about 1
TOLERANCE = 1e-3  # of a width: the integrator's error; linear: 1e-9 of the state
SHOWN = ("samples", "excluded", "falsified", "undecided in normal operation", "runaway", "undecided in a runaway")
KINDS = (*OBSERVERS, *PLANTS)


def examine(kind: str, i: int) -> dict[str, Any]:
    """One run: what happened."""
    rng, is_linear = np.random.default_rng([SEED, KINDS.index(kind), i]), kind in OBSERVERS
    off = (0.0, 0.01, 0.3)[i % 3] if is_linear else (0.0, 0.05, 0.5)[i % 3]
    samples = RUN.get(kind, 50)
    case = EventPlant(rng).case(samples, 0.3, 0.3 * off) if is_linear else nonlinear_case(kind, rng, samples, off)
    begun, observer = process_time(), OBSERVERS.get(kind, WindowObserver)(case.model, case.first)
    count = _count(observer, case, _ran_away(kind, case), is_linear, i)
    return {"plant": kind, "run": i, "count": count, "seconds": process_time() - begun}


def _ran_away(kind: str, case: EventCase) -> NDArray[np.bool_]:
    """Of each sample (K,), whether the plant has run away by then."""
    x = np.asarray(case.log.x)
    if kind in OBSERVERS:
        return np.full(len(x), np.abs(x).max() > RUNAWAY)
    normal = CASES[kind]().normal
    if normal is None:
        return np.zeros(len(x), dtype=bool)
    beyond: NDArray[np.bool_] = ((x < normal[0]) | (x > normal[1])).any(axis=1)
    return np.logical_or.accumulate(beyond)


def _count(observer: Any, case: EventCase, away: NDArray[np.bool_], is_linear: bool, i: int) -> Counter[str]:
    count, truth = Counter[str](), case.log.x
    assert truth is not None
    for k, step in enumerate(drive(observer, case.log)):
        count["samples"] += 1
        count["runaway"] += bool(away[k])
        count[step.verdict] += 1
        if step.verdict == "falsified":
            count[f"falsified: run {i}, sample {k}"] += 1
            break
        lower, upper = step.box
        room = 1e-9 * (1.0 + np.abs(truth[k])) if is_linear else TOLERANCE * (upper - lower)
        if not ((truth[k] >= lower - room) & (truth[k] <= upper + room)).all():
            count["excluded"] += 1
            count[f"excluded: run {i}, sample {k}"] += 1
        if step.verdict == "undecided":
            where = "in a runaway" if away[k] else "in normal operation"
            count[f"undecided {where}"] += 1
            count[f"undecided {where}: run {i}, {step.reason}"] += 1
    return count


def runs_of(samples: int) -> list[tuple[str, int]]:
    """So many samples in all, by shares."""
    shares = [kind for kind in KINDS for _ in range(SHARE.get(kind, 1))]
    each = sum(RUN.get(kind, 50) for kind in shares)
    rounds = -(-samples // each)
    return [
        (kind, r * SHARE.get(kind, 1) + j) for r in range(rounds) for kind in KINDS for j in range(SHARE.get(kind, 1))
    ]


def main() -> None:
    """Examine and print what was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.event_times", description=__doc__)
    parser.add_argument("--samples", type=int, default=5_000, help="of all kinds together")
    parser.add_argument("--out", type=Path, default=None, help="a file that keeps the runs, and is gone on with")
    chosen = parser.parse_args()
    wanted = runs_of(chosen.samples)
    found = {} if chosen.out is None else {(run["plant"], run["run"]): run for run in stored(chosen.out)}
    for key in track([key for key in wanted if key not in found], description="runs", console=console):
        found[key] = examine(*key)
        if chosen.out is not None:
            with chosen.out.open("a", encoding="utf-8") as file:
                file.write("\n" + json.dumps(found[key]))
    _report([found[key] for key in wanted])


def _report(runs: list[dict[str, Any]]) -> None:
    rows, total = [], Counter[str]()
    for kind in KINDS:
        own = [run for run in runs if run["plant"] == kind]
        count = sum((Counter(run["count"]) for run in own), Counter[str]())
        total += count
        shown = (count[what] for what in SHOWN)
        cost = 1e3 * sum(run["seconds"] for run in own) / max(1, count["samples"])
        rows.append([kind, len(own), *shown, f"{cost:.1f}"])
    columns = ["observer or plant", "runs", *SHOWN, "ms a sample"]
    table("Samples at times of their own", columns, rows)
    for what, number in total.items():
        if ": run" in what:
            print(f"{what} ({number})")
    failures = total["excluded"] + total["falsified"]
    normal = total["samples"] - total["runaway"]
    print(f"undecided in normal operation: {total['undecided in normal operation']} of {normal}")
    print(f"{total['samples']} cases, {failures} failures")
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
