"""Interval detector and set-valued observer on real recordings of a servo (EMPS), with injected faults.

Run with ``SVO_DATA=FOLDER python -m benchmarks.real_servo [--figure FILE.png]``. The recordings (1 kHz, 24.84 s each)
are healthy; in "pulses" a force of 5 N disturbs the servo for half of every second. From the first half of one, g and
h of x+ = g x + (1 - g) h u are identified and the noise is characterised; the detectors run on the second half of the
same or of the other one. Faults are INJECTED: from an instant on the recorded position stands still (jam) or drifts
away at a constant rate (runaway), at 39 instants 0.3 s apart. The recorded command is kept: it does not depend on the
position.

A delay is counted from the first faulty sample to the first alarm that the healthy run does not have there, plus one
sampling time; a fault without such an alarm within 2 s is missed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks._servo_detectors import (
    QBAR,
    SAFETY,
    Fault,
    Outcome,
    learn,
    predictor,
    run_interval,
    run_observer,
    smallest_noise,
)
from benchmarks._servo_figure import draw
from benchmarks._servo_records import VARIABLE, data_folder, halves, jam, part, record, runaway
from svo.interval import IntervalDetector
from svo.interval.identification import FirstOrderFit, identify_first_order

POLES = (0.0, 0.8, 0.9, 0.95, 0.99)
HORIZONS = (1, 10, 50)
INSTANTS = tuple(80 + 300 * i for i in range(39))  # samples of the second half
FAULTS: Mapping[str, Fault] = {
    "jam": jam,
    "runaway 100 mm/s": partial(runaway, rate=0.1),
    "runaway 2 mm/s": partial(runaway, rate=0.002),
}
CASES = (("standard", "standard"), ("pulses", "pulses"), ("standard", "pulses"))


def study(folder: Path, learnt_on: str, run_on: str) -> tuple[Table, list[str]]:
    """The table of one case, and what was learnt in words."""
    learning, running = halves(record(folder, learnt_on))[0], halves(record(folder, run_on))[1]
    fit, noise = learn(learning)
    outcomes: dict[str, Outcome] = {}
    for pole in POLES:
        detector = IntervalDetector(predictor(fit, running), noise, pole)
        outcomes[f"interval, a = {pole:g}"] = run_interval(detector, running, FAULTS, INSTANTS)
    for horizon in HORIZONS:
        bound = SAFETY * smallest_noise(fit, learning, horizon)
        name = f"set-valued, N = {horizon}, n = {1e6 * bound:.0f} um"
        outcomes[name] = run_observer(fit, bound, horizon, running, FAULTS, INSTANTS)
    check = noise.check(predictor(fit, running).predict(running).residual)
    violated = f"{check.violated.size} of {QBAR} q" + (
        f" (q = {check.violated[0]} to {check.violated[-1]}, by up to {100 * (np.max(check.ratio) - 1):.0f} %)"
        if check.violated.size
        else ""
    )
    words = [_fit_in_words(fit), f"Assumption (7) fails on the healthy second half at {violated}."]
    return _table(f"Learnt on {learnt_on}, run on {run_on}", outcomes), words


def pole_at(folder: Path, step: int) -> float:
    """The g that is identified from every ``step``-th sample of the standard recording's first half."""
    return float(identify_first_order(part(halves(record(folder, "standard"))[0], 0, None, step), parts=1).gains.gc)


def main(arguments: list[str] | None = None) -> None:
    """Run and print; without recordings, say so."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.real_servo", description=__doc__.split("\n")[0])
    parser.add_argument("--figure", type=Path, help="also draw a jam and the pulses into this file")
    options = parser.parse_args([] if arguments is None else arguments)
    folder = data_folder()
    if folder is None:
        print(f"skipped: set {VARIABLE} to the folder that has emps/DATA_EMPS.mat")
        return
    console = Console(width=150)
    for case in CASES:
        table, words = study(folder, *case)
        console.print(table)
        for line in words:
            console.print(line, highlight=False)
        console.print()
    slow = f"At 10 ms the fitted g is {pole_at(folder, 10):.3f}: the servo settles within a sample."
    console.print(slow, highlight=False)
    console.print("The recordings are real and healthy; jams and runaways are injected into them.", highlight=False)
    if options.figure:
        draw(folder, options.figure)


def _fit_in_words(fit: FirstOrderFit) -> str:
    g = fit.gains
    return (
        f"g = {g.gc:.4f} +- {g.gr:.4f}, h = {g.hc:.5f} +- {g.hr:.5f}; largest simulation error of the first half "
        f"{1e6 * fit.largest_error:.0f} um."
    )


def _table(title: str, outcomes: Mapping[str, Outcome]) -> Table:
    table = Table(title=title, title_justify="left")
    table.add_column("detector")
    for column in ("healthy alarms", *(f"{name} [ms]" for name in FAULTS), "us/sample"):
        table.add_column(column, justify="right")
    for name, outcome in outcomes.items():
        cells = (_delays(outcome.delays[fault]) for fault in FAULTS)
        table.add_row(name, f"{100 * outcome.alarm_share:.2f} %", *cells, f"{outcome.microseconds:.2f}")
    return table


def _delays(delays: np.ndarray) -> str:
    """Median (5 % - 95 %), missed of all; missed ones count as infinite."""
    low, median, high = (float(np.quantile(1e3 * delays, q, method="inverted_cdf")) for q in (0.05, 0.5, 0.95))
    missed = int(np.isinf(delays).sum())
    return f"{median:.0f} ({low:.0f}-{high:.0f}), {missed} missed" if missed else f"{median:.0f} ({low:.0f}-{high:.0f})"


if __name__ == "__main__":
    main(sys.argv[1:])
