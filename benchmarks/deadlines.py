"""What a deadline does to a bank: time a sample, how late the answer is, and how much wider the sets are.

Run with ``python -m benchmarks.deadlines``. The Eclipse's bank of four, healthy flights, quiet noise; deadlines take
turns sample by sample on banks of their own. The last deadline is one that no bank can keep: what it takes is the
floor. Wall time, since a deadline is one; medians, since other programs take the processor away. Width: mean box of
the nominal model at one sample in ten, relative to that without a deadline; it is read after the clock has stopped.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from time import perf_counter

import numpy as np
from rich.progress import track

from aircraft.eclipse.plant import Eclipse
from benchmarks._observers import arguments, console, table
from benchmarks._window_runs import NOISE, SEED, SETTLE
from svo.logs.drive import drive

HORIZONS, BOX_EVERY = (10, 50), 10
DEADLINES = (None, 2e-3, 1e-3, 0.5e-3, 0.25e-3, 1e-6)  # seconds


def main(given: list[str] | None = None) -> None:
    """Measure and print."""
    parser = arguments("deadlines", __doc__, out=False)
    parser.add_argument("--flights", type=int, default=1)
    options = parser.parse_args([] if given is None else given)
    plant, rows = Eclipse(model_kind="lpv"), []
    plant.bank(NOISE).warm_up()
    for N in HORIZONS:
        seconds: dict[float | None, list[float]] = {deadline: [] for deadline in DEADLINES}
        widths: dict[float | None, list[np.ndarray]] = {deadline: [] for deadline in DEADLINES}
        undecided = dict.fromkeys(DEADLINES, 0)
        for flight in range(options.flights):
            log = plant.simulate("none", "none", NOISE, SEED + flight)
            banks = {deadline: replace(plant, horizon=N).bank(NOISE) for deadline in DEADLINES}
            answers = {deadline: drive(bank, log, deadline=deadline) for deadline, bank in banks.items()}
            for k in track(range(len(log)), f"N = {N}", console=console, transient=True):
                for deadline, verdicts in answers.items():
                    begun = perf_counter()
                    verdict = next(verdicts)
                    if k >= SETTLE:
                        seconds[deadline].append(perf_counter() - begun)
                        undecided[deadline] += sum(step.verdict == "undecided" for step in verdict.steps.values())
                        if k % BOX_EVERY == 0:
                            lower, upper = verdict.steps["nominal"].box
                            widths[deadline].append(upper - lower)
                    assert verdict.state == "nominal"
        for deadline in DEADLINES:
            said = len(seconds[deadline]) * len(banks[deadline].names)
            times = 1e3 * np.array(seconds[deadline])
            late = "-" if deadline is None else f"{np.median(np.maximum(times - 1e3 * deadline, 0.0)):.2f}"
            width = np.mean(np.array(widths[deadline]) / np.array(widths[None]))
            rows.append([
                N, "none" if deadline is None else f"{1e3 * deadline:g}", f"{np.median(times):.2f}",
                f"{np.quantile(times, 0.9):.2f}", late, f"{width:.3g}", f"{100.0 * undecided[deadline] / said:.1f}",
            ])  # fmt: skip
    columns = ("N", "deadline, ms", "median, ms", "90 %, ms", "late, median ms", "width", "undecided, %")
    table(f"Bank of four, Eclipse, {options.flights} flight(s), {NOISE} noise", columns, rows)


if __name__ == "__main__":
    main(sys.argv[1:])
