"""Change one tolerance at a time and see its test fail: ``python -m tests.mutation [NAME ...]``.

A mutant of an outward-rounding constant or a tolerance survives if its test still passes; one of a heuristic constant
must survive. Ends on the count of cases and failures; exit code 1 if a mutant did not do what its kind says.
"""

from __future__ import annotations

import os
import subprocess
import sys

from tests.mutation.constants import CONSTANTS, Constant
from tests.mutation.plugin import VARIABLE

SECONDS = 600


def passes(constant: Constant) -> bool:
    """Whether the constant's test is green with the mutant."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "tests.mutation.plugin", "--no-header", constant.test]
    environment = os.environ | {VARIABLE: f"{constant}={constant.changed!r}"}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        raise SystemExit(f"{constant}: {constant.test} took more than {SECONDS} s") from None
    if done.returncode not in (0, 1):
        raise SystemExit(f"{constant}: {constant.test} did not run:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.returncode == 0


def main() -> None:
    chosen = [c for c in CONSTANTS if not sys.argv[1:] or any(word in str(c) for word in sys.argv[1:])]
    wrong = 0
    for constant in chosen:
        green = passes(constant)
        right = green == (constant.kind == "heuristic")
        wrong += not right
        end = "green" if green else "red"
        print(f"{'ok   ' if right else 'WRONG'} {constant} = {constant.changed:g} ({constant.kind}): {end}", flush=True)
    print(f"{len(chosen)} cases, {wrong} failures")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
