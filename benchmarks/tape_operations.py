"""Every operation of a tape beside ball arithmetic, over random and extreme arguments: points outside must be zero.

Run with ``python -m benchmarks.tape_operations --points 1000000``, shared out over the operations. Half of the operands
are sums of two variables, a third of the boxes has ends such as 0, 5e-324 or 1.7e308. Portion i of an
operation is drawn from seed (SEED, operation, i). The elementary functions of the core get ``--elementary`` points
each, a tenth of them where rounding is worst. Exit code 1 if anything is outside.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

import numpy as np
from rich.progress import track

from benchmarks._observers import console, table
from tests.core.elementary_in_balls import AT, draw, draw_worst
from tests.core.elementary_in_balls import examine as examine_values
from tests.svo.functions.operations_in_balls import OPERATIONS, POINTS, examine

SEED = 20_261_129
BOXES = 200  # of a portion
ARGUMENTS = 10_000  # of a portion of an elementary function
OUTSIDE = ("outside the interval", "outside the form's range", "outside the form")


def main() -> None:
    """Examine every operation and print what was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tape_operations", description=__doc__)
    parser.add_argument("--points", type=int, default=20_000, help="of all operations together")
    parser.add_argument("--elementary", type=int, default=10_000, help="of each elementary function")
    chosen = parser.parse_args()
    cases, outside = map(sum, zip(_operations(chosen.points), _elementary(chosen.elementary), strict=True))
    print(f"{cases} cases, {outside} failures")
    sys.exit(outside > 0)


def _operations(points: int) -> tuple[int, int]:
    """Cases and failures of the operations of a tape."""
    portions = -(-points // (len(OPERATIONS) * BOXES * POINTS))
    counts = {op: Counter[str]() for op in OPERATIONS}
    for i in track(range(portions), description="portions", console=console):
        for op in OPERATIONS:
            counts[op] += examine(op, np.random.default_rng([SEED, op, i]), BOXES)
    shown = ("points", *OUTSIDE, "refused")
    rows = [[op.name.lower(), *(count[what] for what in shown)] for op, count in counts.items()]
    table("Operations beside ball arithmetic", ["operation", *shown], rows)
    outside = sum(count[what] for count in counts.values() for what in OUTSIDE)
    return sum(count["points"] for count in counts.values()), outside


def _elementary(points: int) -> tuple[int, int]:
    """Cases and failures of the core's elementary functions."""
    counts = {name: Counter[str]() for name in AT}
    for i in track(range(-(-points // ARGUMENTS)), description="functions", console=console):
        for name in AT:
            rng = np.random.default_rng([SEED, *name.encode(), i])
            worst = ARGUMENTS // 10
            counts[name] += examine_values(name, draw(name, rng, ARGUMENTS - worst) + draw_worst(name, rng, worst))
    shown = ("points", "outside", *(f"{k} apart" for k in range(5)))
    rows = [[name, *(count[what] for what in shown)] for name, count in counts.items()]
    table("The core's functions beside ball arithmetic: ends so many doubles apart", ["function", *shown], rows)
    return sum(count["points"] for count in counts.values()), sum(count["outside"] for count in counts.values())


if __name__ == "__main__":
    main()
