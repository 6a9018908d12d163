"""What the window observer does over a long time, and what an alarm costs.

Run with ``python -m benchmarks.window_endurance --samples 1000000``. First one observer with an uncertainty over many
samples of random disturbances, often at their bounds: memory of the process, undecided verdicts and true states outside
at ten stages. Then flights of the Eclipse with every fault and profile: time of the sample that raises the nominal
observer's alarm, time of the exact check of its certificate, and the share of undecided verdicts of all four observers.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from time import process_time

import numpy as np
from rich.console import Console
from rich.table import Table

from aircraft.eclipse.plant import Eclipse
from polytopes import HPolytope
from svo.models.model import UncertainModel, Uncertainty
from svo.observers.window.observer import WindowObserver

STAGES = 10
NOISE, SEED = "quiet", 20_130_613


def resident_mebibytes() -> float:
    """Memory of this process that is in use."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def plant() -> UncertainModel:
    """Three lightly damped states, two sensors, an uncertain stiffness and a shared disturbance."""
    A = np.array([[0.98, 0.1, 0.0], [-0.1, 0.98, 0.05], [0.0, 0.0, 0.95]])
    stiffness = Uncertainty(A=np.outer([0.0, 0.01, 0.0], [1.0, 0.0, 0.0]), bounds=(-1.0, 1.0))
    return UncertainModel(
        A, None, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], E=[[0.0], [0.02], [0.05]], w=[1.0], n=[0.05, 0.02],
        uncertainties=[stiffness],
    )  # fmt: skip


def endure(samples: int) -> Table:
    """One observer over so many samples."""
    table = Table(title=f"One observer over {samples} samples, N = 10, an uncertainty")
    for column in ("samples", "memory, MiB", "CPU us a sample", "not consistent", "true state outside"):
        table.add_column(column, justify="right")
    observer, rng = WindowObserver(plant(), HPolytope.box([-1.0] * 3, [1.0] * 3)), np.random.default_rng(SEED)
    observer.warm_up()
    wrong, outside, begun = 0, 0, process_time()
    stage = max(1, samples // STAGES)
    for k, (x, y) in enumerate(_run(rng, samples)):
        step = observer.update(y) if k == 0 else observer.step(None, y)
        wrong += step.verdict != "consistent"
        if k % 10 == 0:
            lower, upper = step.box
            outside += not ((lower <= x).all() and (x <= upper).all())
        if (k + 1) % stage == 0:
            spent = (process_time() - begun) / stage
            numbers = (f"{resident_mebibytes():.1f}", f"{1e6 * spent:.0f}", str(wrong), str(outside))
            table.add_row(str(k + 1), *numbers)
            begun = process_time()
    return table


def _run(rng: np.random.Generator, samples: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """States and measurements; every third sample has its unknowns at their bounds."""
    model = plant()
    stack, (_, w_upper, noise) = model.stack(), model.bounds()
    x = np.zeros(3)
    for k in range(samples):
        unknown = rng.uniform(-1.0, 1.0, 4)
        unknown = np.sign(unknown) if k % 3 == 0 else unknown
        total = stack[0] + unknown[0] * stack[1]
        yield x, total[3:, :3] @ x + noise * unknown[1:3]
        x = total[:3, :3] @ x + total[:3, 4] * w_upper[0] * unknown[3]


def alarms(runs: int) -> Table:
    """Flights with faults: what the nominal observer's alarm costs."""
    eclipse, first, check = Eclipse(model_kind="lpv"), [], []
    verdicts = undecided = proven = 0
    eclipse.bank(NOISE).warm_up()
    for fault in eclipse.faults:
        for profile in eclipse.faults[fault]:
            for run in range(runs):
                log = eclipse.simulate(fault, profile, NOISE, SEED + run)
                record = eclipse.bank(NOISE).run(log)
                verdicts += record.undecided.size
                undecided += int(record.undecided.sum())
                at = record.died_at["nominal"]
                if at is None:
                    continue
                first.append(record.seconds[at, 0])
                begun = process_time()
                proven += record.certificates["nominal"].verify()
                check.append(process_time() - begun)
    table = Table(title=f"Alarms of the Eclipse's nominal observer, N = 10, {len(first)} of them")
    for column in ("what", "median", "largest"):
        table.add_column(column, justify="right")
    table.add_row("sample of the alarm, its proof included, wall ms", *_milliseconds(first))
    table.add_row("exact check of the certificate, CPU ms", *_milliseconds(check))
    table.add_row("certificates that check", f"{proven} of {len(check)}", "-")
    table.add_row("undecided verdicts of four observers", f"{undecided} of {verdicts}", "-")
    return table


def _milliseconds(seconds: list[float]) -> tuple[str, str]:
    return f"{1e3 * np.median(seconds):.2f}", f"{1e3 * np.max(seconds):.2f}"


def main(arguments: list[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.window_endurance", description=__doc__.split("\n")[0])
    parser.add_argument("--samples", type=int, default=100_000, help="samples of the long run")
    parser.add_argument("--runs", type=int, default=3, help="flights of each fault and profile")
    options = parser.parse_args([] if arguments is None else arguments)
    console = Console(width=120)
    console.print(alarms(options.runs))
    console.print(endure(options.samples))


if __name__ == "__main__":
    main(sys.argv[1:])
