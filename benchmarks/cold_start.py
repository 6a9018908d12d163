"""CPU time of the first answer: ``svo`` as a process of its own, against the import of what it stands on.

Run with ``python -m benchmarks.cold_start``. Each command is a process, beside `REFERENCE` in the same turn: once with
no bytecode, as after an installation that compiled none, then with all of it there, where the median of the ratios
counts. Last comes the CPU time of the core's own build, as ``pip install .`` runs it (with CMake, which must be there).
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[1]
REFERENCE = (sys.executable, "-c", "import scipy.linalg, pyarrow.csv")
SVO = (sys.executable, "-m", "svo")
TURNS = 5


def cpu_seconds(command: Sequence[str], environment: Mapping[str, str]) -> float:
    """User and system time of a command and its children [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env=environment, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def environment_with(bytecode: Path) -> dict[str, str]:
    """This environment with bytecode in a folder of its own, and with this checkout's packages."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    found = os.pathsep.join([str(ROOT), *filter(None, [kept.get("PYTHONPATH")])])
    return kept | {"PYTHONPATH": found, "PYTHONPYCACHEPREFIX": str(bytecode)}


def write_log(path: Path) -> None:
    """A flight of the Eclipse with a fault, 550 samples, as CSV."""
    simulate = (*SVO, "simulate", "eclipse", "--fault", "alpha", "--out", str(path))
    subprocess.run(simulate, env=os.environ | {"PYTHONPATH": str(ROOT)}, check=True, capture_output=True)


def turns(command: Sequence[str], bytecode: Path, count: int) -> list[tuple[float, float]]:
    """Seconds of a command and of the reference, one after the other, ``count`` times."""
    environment = environment_with(bytecode)
    return [(cpu_seconds(command, environment), cpu_seconds(REFERENCE, environment)) for _ in range(count)]


def build_seconds(folder: Path) -> float:
    """CPU seconds of the core's configuration and build from nothing."""
    steps = (["cmake", "-S", str(ROOT / "core"), "-B", str(folder)], ["cmake", "--build", str(folder)])
    return sum(cpu_seconds(step, os.environ) for step in steps)


def main() -> None:
    """Print the table of first answers, and what the core's build takes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log, warm = folder / "log.csv", folder / "warm"
        write_log(log)
        table = Table("command", "bytecode", "CPU s", "of the reference", "ratio")
        for given in (("detect", "eclipse", str(log)), ("plants",), ("--help",)):
            command = (*SVO, *given)
            [cold] = turns(command, folder / f"cold {given[0]}", 1)
            turns(command, warm, 1)
            several = turns(command, warm, TURNS)
            shown = ("svo " + " ".join(given)).replace(str(log), "LOG")
            for state, pairs in (("none", [cold]), ("there", several)):
                ours, theirs = (median(column) for column in zip(*pairs, strict=True))
                ratio = median(mine / other for mine, other in pairs)
                table.add_row(shown, state, f"{ours:.2f}", f"{theirs:.2f}", f"{ratio:.2f}")
        Console().print(table)
        if shutil.which("cmake"):
            print(f"core's own build: {build_seconds(folder / 'core'):.1f} s of CPU")
        else:
            print("no cmake is found here, so the core's own build was not measured")


if __name__ == "__main__":
    main()
