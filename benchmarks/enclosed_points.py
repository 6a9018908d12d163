"""Linearisations of nonlinear plants against random points of their enclosures: points outside must be zero.

Run with ``python -m benchmarks.enclosed_points --count 300 --points 100000 --out points.jsonl``; what the file
already holds is not run again. Linearisation i is of plant i modulo their number, from seed (SEED, i): a random box
about a state of the plant, often with an end at zero, a random interval, held or varying; half of them in other units.
Points are corners, on edges and faces, and inside; w and p at corners too. Exit code 1 if anything is outside.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from rich.progress import track

from benchmarks._observers import console, table
from benchmarks.nonlinear import PLANTS, stored
from tests.svo.models.linearised_points import OUTSIDE, examine_linearisation
from tests.svo.models.units import in_other_units

SEED = 20_261_130


def examine(i: int, points: int) -> tuple[str, Counter[str]]:
    """The plant of linearisation i, and what was outside."""
    rng, name = np.random.default_rng([SEED, i]), list(PLANTS)[i % len(PLANTS)]
    case = PLANTS[name](**({"varying": "all"} if rng.random() < 0.3 else {}))
    if rng.random() < 0.5:
        case = in_other_units(case, rng)
    return name, examine_linearisation(case, rng, points)


def main() -> None:
    """Examine linearisations in turn and print what was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.enclosed_points", description=__doc__)
    parser.add_argument("--count", type=int, default=len(PLANTS), help="of linearisations")
    parser.add_argument("--points", type=int, default=20_000, help="of each")
    parser.add_argument("--out", type=Path, default=None, help="a file that keeps them, and is gone on with")
    chosen = parser.parse_args()
    kept = () if chosen.out is None else stored(chosen.out)
    found = {row["i"]: (row["plant"], Counter(row["count"])) for row in kept if row["points"] == chosen.points}
    for i in track([i for i in range(chosen.count) if i not in found], description="linearisations", console=console):
        name, count = found[i] = examine(i, chosen.points)
        if chosen.out is not None:
            row = {"i": i, "plant": name, "points": chosen.points, "count": dict(count)}
            with chosen.out.open("a", encoding="utf-8") as file:
                file.write("\n" + json.dumps(row))
    shown, rows, total = ("linearisations", "points", *OUTSIDE, "undecided"), [], Counter[str]()
    for plant in dict.fromkeys(found[i][0] for i in range(chosen.count)):
        count = sum((found[i][1] for i in range(chosen.count) if found[i][0] == plant), Counter[str]())
        rows.append([plant, *(count[what] for what in shown)])
        total += count
    table("Linearisations against points", ["plant", *shown], rows)
    outside = sum(total[what] for what in OUTSIDE)
    print(f"{total['linearisations']} linearisations, {total['undecided']} undecided")
    print(f"{total['points']} cases, {outside} failures")
    sys.exit(outside > 0)


if __name__ == "__main__":
    main()
