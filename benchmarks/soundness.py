"""Soundness of every observer on random plants: exclusions of the true state and false alarms, which must be zero.

Run with ``python -m benchmarks.soundness --observer window --samples 1000000``. Plants have 1 to 6 states, up to two
uncertainties in any of A, B, a, E and C, D, c, F, disturbances shared by state and output, polytopes of w, zero widths
and missing sensors; half of the runs keep w, noise and Delta at the corners of their bounds. Every verdict counts; the
true state is compared with the box at one sample in five. Plant i is drawn from seed (SEED, i), so that a run can go on
where another ended (``--first``). Ends on a line that counts samples and failures; exit code 1 if there are any.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from time import perf_counter, process_time

import numpy as np
from rich.progress import track

from benchmarks._observers import OBSERVERS, arguments, console, table
from polytopes import HPolytope, UndecidedError
from svo import UncertainModel
from svo.logs.drive import drive
from svo.logs.log import Log
from tests.svo.observers.random_plants import random_plant

SEED = 20_261_125
LARGEST = 1e6  # of |x| in a run: beyond, an unstable plant tests overflow
BUDGET = {"window": 1_000_000, "polytope": 20_000, "zonotope": 100_000}
BOX_EVERY = 5
RUN = {"window": 200, "polytope": 20, "zonotope": 100}  # samples of one plant


def examine(name: str, samples: int, i: int) -> Counter[str]:
    """One plant, one log, one observer: what happened, by name."""
    rng = np.random.default_rng([SEED, i])
    model = random_plant(rng, largest=3 if name == "polytope" else 6)
    log, y, initial = _run(rng, model, samples)
    observer = OBSERVERS[name](model, initial)
    count: Counter[str] = Counter(plants=1, uncertain=int(bool(model.uncertainties)), shared=int(model.F is not None))
    begun = process_time()
    try:
        for k, step in enumerate(drive(observer, replace(log, y=y))):
            count["samples"] += 1
            count[step.verdict] += 1
            if step.verdict == "undecided":
                count[f"undecided: plant {i}, sample {k}"] += 1
            if step.verdict == "falsified":
                count[f"falsified: plant {i}, sample {k}"] += 1
                break
            if k % BOX_EVERY == 0:
                count["boxes"] += 1
            if k % BOX_EVERY == 0 and not _contains(step.box, log.x[k]):
                count["exclusions"] += 1
                count[f"excluded: plant {i}, sample {k}"] += 1
    except UndecidedError:
        count["stopped: set too thin"] += 1
    count["milliseconds"] = round(1e3 * (process_time() - begun))
    return count


def _run(rng: np.random.Generator, model: UncertainModel, samples: int) -> tuple[Log, np.ndarray, HPolytope]:
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(samples, model.n_inputs)), rng, corners=bool(rng.random() < 0.5))
    assert log.x is not None
    large = np.flatnonzero(~(np.abs(log.x).max(axis=1) < LARGEST))
    if large.size:
        end = max(2, int(large[0]))
        log = Log(time=log.time[:end], u=log.u[:end], y=log.y[:end], x=log.x[:end])
    y = log.y.copy()
    if rng.random() < 0.5:
        y[rng.random(y.shape) < 0.2] = np.nan
    box = HPolytope.box(np.full(x0.size, -1.5), np.full(x0.size, 1.5))
    if rng.random() < 0.5:
        rows = rng.normal(size=(3, x0.size))
        box = box.intersection(HPolytope(rows, rows @ x0 + rng.uniform(0.0, 0.1, 3)))
    return log, y, box


def _contains(box: tuple[np.ndarray, np.ndarray], x: np.ndarray) -> bool:
    room = 1e-12 * (1.0 + np.abs(x).max())  # the simulation itself rounds
    return bool((box[0] - room <= x).all() and (x <= box[1] + room).all())


def main(given: list[str] | None = None) -> None:
    """Count and print; without arguments a small part of every observer's budget."""
    parser = arguments("soundness", __doc__, out=False)
    parser.add_argument("--observer", choices=OBSERVERS, help="one of them; all by default")
    parser.add_argument("--samples", type=int, help="about so many; a twentieth of the full budget by default")
    parser.add_argument("--first", type=int, default=0, help="number of the first plant")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args([] if given is None else given)
    rows, notes = [], []
    for name in [options.observer] if options.observer else OBSERVERS:
        wanted = options.samples or BUDGET[name] // 20
        OBSERVERS[name](UncertainModel([[1.0]], None, [[1.0]], n=[1.0]), HPolytope.box([-1.0], [1.0])).warm_up()
        plants, total, begun = range(options.first, options.first + -(-wanted // RUN[name])), Counter(), perf_counter()
        with ProcessPoolExecutor(options.processes, mp_context=multiprocessing.get_context("spawn")) as pool:
            found = pool.map(partial(examine, name, RUN[name]), plants, chunksize=8)
            for count in track(found, name, total=len(plants), console=console, transient=True):
                total += count
        notes += [note for note in total if ": plant" in note or note.startswith("stopped")]
        milliseconds = total["milliseconds"] / max(total["samples"], 1)
        rows.append([
            name, total["plants"], total["uncertain"], total["shared"], total["samples"], total["boxes"],
            total["exclusions"], total["falsified"], total["undecided"], f"{milliseconds:.2f}",
            f"{perf_counter() - begun:.0f}",
        ])  # fmt: skip
    columns = ("observer", "plants", "uncertain", "with F", "samples", "boxes", "exclusions", "false alarms",
               "undecided", "CPU ms a sample", "seconds")  # fmt: skip
    table(f"Random plants, seed {SEED}: exclusions and false alarms must be zero", columns, rows)
    for note in notes:
        console.print(note)
    failures = sum(row[6] + row[7] for row in rows)
    print(f"{sum(row[4] for row in rows)} cases, {failures} failures")
    if failures:
        raise SystemExit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
