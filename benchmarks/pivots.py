"""Pivots of the window observer, what one takes, and what its arithmetic alone would take on this machine.

Run with ``python -m benchmarks.pivots``. A flight of the Eclipse (quiet noise, fixed seed); of every sample only the
programs are timed, in CPU time. A pivot of a window of Z variables and R rows with a basis of k rows needs
2 k (Z + R) flops for its row of the tableau and its move, and 6 k^2 for the inverse; a program begins with its point,
2 Z R, and ends with its bound, 4 k Z. Flips of bounds and the comparisons of both tests are not counted. The limit is
these flops at the rate of the core's own loop over k rows of length Z that lie in the cache, measured in the same run;
it needs a C compiler (CC, cc, gcc or clang).
"""

from __future__ import annotations

import ctypes
import os
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time_ns
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from aircraft.eclipse.plant import Eclipse
from benchmarks._window_runs import NOISE, SEED, SETTLE, observer_of
from polytopes.native import address
from svo.logs.log import Log
from svo.observers import window_kernel as kernel
from svo.observers.window.observer import WindowObserver

HORIZONS = (5, 10, 20, 50)
FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fno-trapping-math", "-fPIC", "-shared")  # as core/CMakeLists.txt
CORE = Path(__file__).parents[1] / "core"


@dataclass(frozen=True)
class Programs:
    """Programs of a flight: sizes of the window, mean rows of a basis, and by sample their number, pivots and ns."""

    variables: int
    rows: int
    basis: float
    programs: float
    pivots: float
    nanoseconds: float

    @property
    def flops(self) -> float:
        """Of a pivot, with its share of the program's begin and end."""
        Z, R, k = self.variables, self.rows, self.basis
        return 2 * k * (Z + R) + 6 * k**2 + (2 * Z * R + 4 * k * Z) * self.programs / self.pivots


def programs_of(observer: WindowObserver, log: Log, schedule: list[Any]) -> Programs:
    """Take a flight sample by sample, and time its programs apart from the rest."""
    window, k, spent, empty = observer._window, [], [], []
    memory, before = window.memory, (0, 0)
    for i in range(len(log)):
        u = log.u[i - 1] if i else np.zeros(log.u.shape[1])
        window._enter(observer._sampler.sample(u, log.u[i], log.y[i], schedule[i], i), None)
        begun = process_time_ns()
        verdict, _ = memory.solve(kernel.ARRIVAL, 0, kernel.ALL, kernel.UNLIMITED)
        solved = process_time_ns()
        empty.append(process_time_ns() - solved)
        assert verdict == kernel.CONSISTENT
        clock = memory.arrays["clock"]
        if i == SETTLE:
            before = int(clock[kernel.PROGRAMS]), int(clock[kernel.PIVOTS])
        elif i > SETTLE:
            spent.append(solved - begun)
            k += [size for size in memory.arrays["k"][: 2 * memory.size.nt] if size]
    programs, pivots = (int(clock[at]) - n for at, n in zip((kernel.PROGRAMS, kernel.PIVOTS), before, strict=True))
    count, arrays = len(spent), memory.arrays
    nanoseconds = float(np.mean(spent) - np.median(empty))
    rows, variables = arrays["G"].shape
    return Programs(variables, rows, float(np.mean(k)), programs / count, pivots / count, nanoseconds)


class Loop:
    """The core's loop over rows, compiled alone with the core's flags; None of it where there is no compiler."""

    def __init__(self, folder: Path) -> None:
        named = shlex.split(os.environ.get("CC", ""))
        command = named or [name for name in ("cc", "gcc", "clang") if shutil.which(name)][:1]
        self._combine: Any = None
        if command:
            library, source = folder / "flop_rate.so", Path(__file__).with_name("_flop_rate.c")
            subprocess.run([*command, *FLAGS, f"-I{CORE}", str(source), "-o", str(library), "-lm"], check=True)
            self._combine = ctypes.CDLL(str(library)).combine_again
            self._combine.argtypes = [*[ctypes.c_void_p] * 4, *[ctypes.c_int64] * 3]

    def rate(self, rows: int, length: int) -> float:
        """Flops a nanosecond of sums of so many rows, the best of several runs; NaN without a compiler."""
        if self._combine is None:
            return float("nan")
        matrix, target = np.full((rows, length), 0.5), np.zeros(length)
        index, factors, best = np.arange(rows), np.full(rows, 1e-9), float("inf")
        times = max(1, 4_000_000 // (rows * length))
        for _ in range(15):
            begun = process_time_ns()
            self._combine(*map(address, (target, matrix, index, factors)), rows, length, times)
            best = min(best, process_time_ns() - begun)
        return 2.0 * rows * length * times / best


def main() -> None:
    """Measure and print."""
    plant: Any = Eclipse(model_kind="lpv")
    log = plant.simulate("none", "none", NOISE, SEED)
    schedule, models = list(map(plant.scheduler(), log.y)), plant.models(NOISE)
    table = Table(title="Programs of the window observer, CPU time: a flight of the Eclipse")
    for column in ("observer", "N", "variables", "rows", "rows of a basis", "programs a sample", "pivots a sample",
                   "us a sample", "ns a pivot", "flops a pivot", "flops a ns", "limit, ns", "ns / limit"):  # fmt: skip
        table.add_column(column, justify="right")
    with TemporaryDirectory() as folder:
        loop = Loop(Path(folder))
        for name in models:
            for N in HORIZONS:
                found = programs_of(observer_of(models[name], N), log, schedule)
                rate, pivot = loop.rate(max(1, round(found.basis)), found.variables), found.nanoseconds / found.pivots
                limit = found.flops / rate
                table.add_row(
                    name, str(N), str(found.variables), str(found.rows), f"{found.basis:.1f}", f"{found.programs:.1f}",
                    f"{found.pivots:.1f}", f"{found.nanoseconds / 1e3:.0f}", f"{pivot:.0f}", f"{found.flops:.0f}",
                    f"{rate:.1f}", f"{limit:.0f}", f"{pivot / limit:.1f}",
                )  # fmt: skip
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
