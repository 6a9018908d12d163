"""Every operation of a tape beside ball arithmetic, over random and extreme arguments: points outside must be zero.

Run with ``python -m benchmarks.tape_operations --points 1000000 --out points.jsonl``: so many for each operation and
for random tapes of many, those of refused boxes not counted; what the file already holds is not run again, so it may
be interrupted at any time. Half of the operands are sums of two variables; two boxes in seven have ends such as 0,
5e-324 or 1.7e308, others are a few doubles about multiples of pi/2 or in units of 2^-300 to 2^300. Portion i of an
operation is drawn from seed (SEED, operation, i). The elementary functions of the core get ``--elementary`` points
each, a tenth of them where rounding is worst. Exit code 1 if anything is outside.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from rich.progress import Progress, track

from benchmarks._observers import console, table
from benchmarks.nonlinear import stored
from tests.core.elementary_in_balls import AT, draw, draw_worst
from tests.core.elementary_in_balls import examine as examine_values
from tests.svo.functions.operations_in_balls import OPERATIONS, examine
from tests.svo.functions.random_tapes import examine as examine_tapes

SEED = 20_261_129
BOXES, POINTS = 400, 25  # of a portion, and of each box
ARGUMENTS = 10_000  # of a portion of an elementary function
OUTSIDE = ("outside the interval", "outside the form's range", "outside the form")
EXAMINED: dict[str, Callable[..., Counter[str]]] = {
    **{op.name.lower(): partial(examine, op) for op in OPERATIONS},
    "random tapes": examine_tapes,
}


def main() -> None:
    """Examine every operation and print what was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tape_operations", description=__doc__)
    parser.add_argument("--points", type=int, default=1_000, help="of each operation")
    parser.add_argument("--elementary", type=int, default=10_000, help="of each elementary function")
    parser.add_argument("--out", type=Path, default=None, help="a file that keeps the portions, and is gone on with")
    chosen = parser.parse_args()
    found = zip(_operations(chosen.points, chosen.out), _elementary(chosen.elementary), strict=True)
    cases, outside = map(sum, found)
    print(f"{cases} cases, {outside} failures")
    sys.exit(outside > 0)


def _operations(points: int, out: Path | None) -> tuple[int, int]:
    """Cases and failures of the operations of a tape."""
    kept = {} if out is None else {(part["name"], part["portion"]): Counter(part["count"]) for part in stored(out)}
    counts: dict[str, Counter[str]] = {name: Counter() for name in EXAMINED}
    with Progress(console=console) as progress:
        task = progress.add_task("points", total=points * len(EXAMINED))
        for name, count in counts.items():
            portion = 0
            while count["points"] < points:
                found = kept.get((name, portion)) or _examine(name, portion, out)
                count.update(found)
                progress.advance(task, found["points"])
                portion += 1
    shown = ("points", *OUTSIDE, "refused")
    rows = [[name, *(count[what] for what in shown)] for name, count in counts.items()]
    table("Operations beside ball arithmetic", ["operation", *shown], rows)
    outside = sum(count[what] for count in counts.values() for what in OUTSIDE)
    return sum(count["points"] for count in counts.values()), outside


def _examine(name: str, portion: int, out: Path | None) -> Counter[str]:
    """What a portion of an operation gives, added to the file."""
    found = EXAMINED[name](np.random.default_rng([SEED, *name.encode(), portion]), BOXES, POINTS)
    if out is not None:
        with out.open("a", encoding="utf-8") as file:
            file.write("\n" + json.dumps({"name": name, "portion": portion, "count": found}))
    return found


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
