"""The native core against the last commit with Numba: the same tasks in turns, in one run, as ratios.

Run with ``python -m benchmarks.native``. The tagged commit is installed beside (once, with pip), in an environment of
its own, and both interpreters do one turn of a task after the other; what counts is the median of the ratios of
neighbouring turns, and the CPU microseconds of both. ``--turns`` says how many, ``--only`` which tasks.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import venv
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[1]
LAST = "f04f1e67cc998b3760f8d320fc8f4ca2c435a897"  # the commit with the tag last-with-numba


class Worker:
    """One version of the project, in a process of its own."""

    def __init__(self, python: Path | str, folder: Path) -> None:
        command = [str(python), "-P", str(ROOT / "benchmarks" / "_timed_tasks.py")]
        self._process = subprocess.Popen(
            command, cwd=folder, env=_environment(folder), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.tasks = list(iter(self._line, ""))

    def turn(self, task: str) -> float:
        """CPU microseconds for each unit of work."""
        assert self._process.stdin is not None
        print(task, file=self._process.stdin, flush=True)
        return float(self._line())

    def _line(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"the worker ended with code {self._process.wait()}")
        return line.rstrip("\n")


def _environment(folder: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def installed(folder: Path) -> tuple[Path, Path]:
    """Interpreter and sources of the tagged commit; made where they are missing."""
    sources, python = folder / "sources", folder / "venv" / "bin" / "python"
    if not sources.exists():
        subprocess.run(["git", "clone", "--quiet", "--no-checkout", ROOT, sources], check=True)
        subprocess.run(["git", "-C", sources, "checkout", "--quiet", LAST], check=True)
    if not python.exists():
        venv.create(folder / "venv", with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--editable", sources], check=True)
    return python, sources


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=9, help="of each task (9)")
    parser.add_argument("--only", default="", help="tasks whose name has these words (all)")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "numba", help="for the tagged commit")
    options = parser.parse_args()
    old, new = Worker(*installed(options.folder)), Worker(sys.executable, ROOT)
    table = Table("task", "Numba, us", "native, us", "ratio", title=f"Median of {options.turns} turns, CPU time")
    ratios = []
    for task in (name for name in new.tasks if options.only in name and name in old.tasks):
        pairs = np.array([(old.turn(task), new.turn(task)) for _ in range(options.turns)])
        ratios.append(float(np.median(pairs[:, 1] / pairs[:, 0])))
        table.add_row(task, *(f"{value:.4g}" for value in np.median(pairs, axis=0)), f"{ratios[-1]:.2f}")
    Console(width=110).print(table)
    print(f"{len(ratios)} tasks: median ratio {np.median(ratios):.2f}, largest {max(ratios):.2f}")


if __name__ == "__main__":
    main()
