"""Fuzz the window's kernel under AddressSanitizer and UBSan: ``python -m tests.core.fuzz --cases 2000 --seed 1``.

A case is a window of random sizes and a state that is its own, or one of arbitrary numbers that the check of saved
states lets pass, and then calls in any order with samples of ordinary numbers, NaN, zeros, huge and tiny ones. Nothing
is asked of the answers, but that they come, within their ranges. A case that fails is printed with the number that
repeats it (``--first I --cases 1``). Ends on the count of cases and failures.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import pytest

from tests.core.sanitized import python, sanitized


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.core.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    options = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="sanitized") as name:
            folder = Path(name)
            failures = run(sanitized(folder), folder, options.seed, options.first, options.first + options.cases)
    except pytest.skip.Exception as reason:
        print(f"skipped: {reason}\n0 cases, 0 failures")
        return
    print(f"{options.cases} cases, {failures} failures")
    sys.exit(failures > 0)


def run(environment: dict[str, str], folder: Path, seed: int, first: int, end: int) -> int:
    """How many cases failed; after one that did, another process goes on."""
    failures = 0
    while first < end:
        done = python(environment, folder, "-m", "tests.core.random_windows", str(seed), str(first), str(end))
        if done.returncode == 0:
            break
        reached = int((done.stdout.split() or [str(first)])[-1])
        print(f"case {reached}: {done.stderr[-4000:]}", flush=True)
        failures, first = failures + 1, reached + 1
    return failures


if __name__ == "__main__":
    main()
