"""How close each observer comes to the limit: full information says when a fault can be proven first.

Run with ``python -m benchmarks.closeness --runs 200``. Linear plants of 2 to 6 states with a bias or a slow drift of a
sensor from sample 15 on. The limit is the window observer with all data since the start, whose program the tests
compare with an independent one. Beside it: the exact check of every alarm, and what was undecided.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import process_time
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from rich.progress import track

from benchmarks._observers import OBSERVERS, arguments, console, linear_plant, output_directions, save, table, window
from polytopes import HPolytope
from svo import UncertainModel
from svo.faults import Ramp, SensorFault, Step
from svo.logs.drive import drive
from svo.logs.log import Log

SEED, SAMPLES, FAULT_AT, HORIZONS = 20_261_126, 45, 15, (1, 2, 5, 10, 20)
Start = Callable[[UncertainModel, HPolytope], Any]


@dataclass
class Tally:
    """What one observer did over all runs: delay beyond the limit of each run, proofs' times, undecided answers."""

    late: list[float] = field(default_factory=list)
    proofs: list[float] = field(default_factory=list)
    undecided: int = 0
    answers: int = 0


def starts(model: UncertainModel) -> dict[str, Start]:
    """Observers to compare, by name."""
    rows = output_directions(model, 2)
    found: dict[str, Start] = {f"window, N = {N}, box": window(N) for N in HORIZONS}
    found |= {f"window, N = {N}, rows C A^-j": window(N, rows) for N in (1, 5, 10)}
    found["zonotope"] = OBSERVERS["zonotope"]
    if model.n_states <= 3:
        found["polytope, 60 facets (n <= 3)"] = OBSERVERS["polytope"]
    return found


def faulty_log(rng: np.random.Generator, n: int) -> tuple[UncertainModel, Log]:
    """A plant and a run with a fault that takes a few samples to show."""
    model = linear_plant(rng, n, outputs=int(rng.integers(1, 3)))
    log = model.simulate(rng.uniform(-0.5, 0.5, n), np.zeros((SAMPLES, 0)), rng)
    begin = FAULT_AT * model.Ts
    profile = Step(begin) if rng.random() < 0.5 else Ramp(begin, 15 * model.Ts)
    fault = SensorFault(0, "bias", float(rng.uniform(0.15, 0.6)), profile)
    return model, replace(log, y=fault.corrupt(log.time, log.y))


def first_alarm(observer: Any, log: Log, tally: Tally) -> float:
    """Sample of the alarm, or infinity."""
    for k, step in enumerate(drive(observer, log)):
        tally.answers += 1
        tally.undecided += step.verdict == "undecided"
        if step.verdict == "falsified":
            begun = process_time()
            assert step.certificate.verify()
            tally.proofs.append(1e3 * (process_time() - begun))
            return k
    return np.inf


def compare(runs: int) -> tuple[dict[str, Tally], int]:
    """All observers on the same runs; runs that nothing can detect are left out."""
    tallies: dict[str, Tally] = {}
    provable, limit = 0, Tally()
    for i in track(range(runs), "runs", console=console, transient=True):
        rng = np.random.default_rng([SEED, i])
        model, log = faulty_log(rng, 2 + i % 5)
        box = HPolytope.box(-np.ones(model.n_states), np.ones(model.n_states))
        earliest = first_alarm(window(None)(model, box), log, limit)
        if not np.isfinite(earliest):
            continue
        provable += 1
        for name, start in starts(model).items():
            tally = tallies.setdefault(name, Tally())
            tally.late.append(first_alarm(start(model, box), log, tally) - earliest)
    tallies["window, all data"] = limit
    return tallies, provable


def draw(shares: dict[str, float], folder: Path) -> None:
    """Shares of runs at the earliest sample, by observer."""
    figure, ax = plt.subplots(figsize=(7, 4))
    names = list(shares)
    ax.barh(names, [shares[name] for name in names])
    ax.axvline(95, color="black", linestyle="--", label="aim for the default, 95 %")
    ax.set_xlabel("runs with the alarm at the earliest provable sample [%]")
    ax.set_xlim(0, 100)
    ax.invert_yaxis()
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))
    save(figure, folder, "closeness.png")


def main(given: list[str] | None = None) -> None:
    """Compare, print and draw."""
    parser = arguments("closeness", __doc__)
    parser.add_argument("--runs", type=int, default=40)
    options = parser.parse_args([] if given is None else given)
    tallies, provable = compare(options.runs)
    rows, shares = [], {}
    for name, tally in tallies.items():
        late = np.array(tally.late)
        if late.size:
            shares[name] = 100.0 * float((late == 0).mean())
        caught = late[np.isfinite(late)]
        rows.append([
            name, late.size or "limit", f"{shares[name]:.0f}" if late.size else "-",
            f"{caught.mean():.2f}" if caught.size else "-", int(np.isinf(late).sum()), int((late < 0).sum()),
            f"{np.median(tally.proofs):.2f} / {np.max(tally.proofs):.2f}" if tally.proofs else "-",
            f"{tally.undecided} of {tally.answers}",
        ])  # fmt: skip
    columns = ("observer", "runs", "same sample, %", "mean delay beyond, samples", "missed", "earlier (must be 0)",
               "exact check, ms, median / largest", "undecided")  # fmt: skip
    table(f"{provable} of {options.runs} runs with a fault that can be proven, seed {SEED}", columns, rows)
    draw(shares, options.out)


if __name__ == "__main__":
    main(sys.argv[1:])
