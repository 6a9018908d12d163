"""Every operation of a tape beside ball arithmetic, over random and extreme arguments: points outside must be zero.

Run with ``python -m benchmarks.tape_operations --points 1000000``, shared out over the operations. Half of the operands
are sums of two variables, a third of the boxes has ends such as 0, 5e-324 or 1.7e308. Portion i of an
operation is drawn from seed (SEED, operation, i). Exit code 1 if anything is outside.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

import numpy as np
from rich.progress import track

from benchmarks._observers import console, table
from tests.svo.functions.operations_in_balls import OPERATIONS, POINTS, examine

SEED = 20_261_129
BOXES = 200  # of a portion
OUTSIDE = ("outside the interval", "outside the form's range", "outside the form")


def main() -> None:
    """Examine every operation and print what was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tape_operations", description=__doc__)
    parser.add_argument("--points", type=int, default=20_000, help="of all operations together")
    points = parser.parse_args().points
    portions = -(-points // (len(OPERATIONS) * BOXES * POINTS))
    counts = {op: Counter[str]() for op in OPERATIONS}
    for i in track(range(portions), description="portions", console=console):
        for op in OPERATIONS:
            counts[op] += examine(op, np.random.default_rng([SEED, op, i]), BOXES)
    shown = ("points", *OUTSIDE, "refused")
    rows = [[op.name.lower(), *(count[what] for what in shown)] for op, count in counts.items()]
    table("Operations beside ball arithmetic", ["operation", *shown], rows)
    outside = sum(count[what] for count in counts.values() for what in OUTSIDE)
    print(f"{sum(count['points'] for count in counts.values())} cases, {outside} failures")
    sys.exit(outside > 0)


if __name__ == "__main__":
    main()
