"""Fuzz what users hand over: ``python -m tests.fuzz --cases 10000 --seed 0``.

Each kind of input gets its share of the cases; ``--kind "csv logs"`` takes one. A case that fails is printed with what
repeats it: ``python -m tests.fuzz --kind KIND --seed SEED --first I --cases 1``. Ends on the count of cases and
failures; exit code 1 if anything was wrong, a traceback, a hang (more than 30 s of computing, or 5 minutes by the
clock) or more than 1 GB.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from tests.fuzz.kinds import KINDS
from tests.fuzz.workers import run

STRIDE = 1_000_000  # between the cases of two seeds


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first case of each kind")
    parser.add_argument("--kind", choices=list(KINDS), action="append", help="one of them; all by default")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    shares = {kind: KINDS[kind][1] for kind in options.kind or KINDS}
    counts = {kind: -(-options.cases * share // sum(shares.values())) for kind, share in shares.items()}
    begin = options.seed * STRIDE + options.first
    jobs = [(kind, begin + i) for kind, count in counts.items() for i in range(count)]
    done: Counter[str] = Counter()
    failed: Counter[str] = Counter()
    for (kind, seed), failure in run(jobs, options.processes):
        done[kind] += 1
        if failure is not None:
            failed[kind] += 1
            print(f"{kind}, case {seed - options.seed * STRIDE}: {failure}", flush=True)
    for kind in counts:
        print(f"{kind}: {done[kind]} cases, {failed[kind]} failed")
    print(f"{done.total()} cases, {failed.total()} failures")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
